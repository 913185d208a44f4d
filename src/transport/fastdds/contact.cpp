#include "transport/fastdds/contact.hpp"

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "transport/fastdds/field_kinds.hpp"

namespace tfdude::fastdds {
namespace {

// Where the announcements of DDS are not heard, presence is repeated in their place.
constexpr std::chrono::milliseconds kRepeatEvery{800};

// The number of servers that this one hears changes often just when there is most to do.
constexpr std::chrono::milliseconds kCountEvery{200};

}  // namespace

void Contact::announce(Writer& writer, const Presence& presence) {
  const Lock lock(mutex_);
  writer_ = &writer;
  said_ = to_wire(presence);
  say(count());
}

std::chrono::milliseconds Contact::look() {
  attention_.lower();
  const std::set<std::string> used = senders_.used_owners();
  const std::vector<std::string> unheard =
      peers_.look_for_silent(Peers::Clock::now(), next_look_, senders_.askable(used));
  for (const std::string& partition : unheard) senders_.probe(partition);
  const bool up_to_date = announce_count();
  const bool waits = !used.empty() || !unheard.empty() || !up_to_date;
  next_look_ = waits ? Attention::kOften : Attention::kRarely;
  return next_look_;
}

// A new participant knows by this number whether it has discovered all, or heard who is missed.
std::uint32_t Contact::count() {
  std::set<std::string_view> missed;
  for (const auto& one : said_->absent()) missed.insert(text(one.partition()));
  return peers_.count(missed);
}

// @return false if others must be told later
bool Contact::announce_count() {
  const Lock lock(mutex_);
  if (!said_) return true;
  const auto heard = count();
  const auto age = Peers::Clock::now() - said_at_;
  const bool changed = said_->peers() != heard;
  if (changed && age < kCountEvery) return false;
  if (changed || (repeats_ && age >= kRepeatEvery)) say(heard);
  return true;
}

void Contact::say(std::uint32_t heard) {
  said_->peers(heard);
  said_at_ = Peers::Clock::now();
  writer_->write(&*said_);
}

}  // namespace tfdude::fastdds
