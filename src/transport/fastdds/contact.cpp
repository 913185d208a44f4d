#include "transport/fastdds/contact.hpp"

#include <algorithm>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace tfdude::fastdds {
namespace {

// Where the announcements of DDS are not heard, presence is repeated in their place.
constexpr std::chrono::milliseconds kRepeatEvery{800};

// The number of servers that this one hears changes often just when there is most to do.
constexpr std::chrono::milliseconds kCountEvery{200};

// Of a server that is gone without anybody missing it, such as an earlier process of a partition.
constexpr std::chrono::seconds kUncountedWithin{1};

}  // namespace

void Contact::announce(Writer& writer, const Presence& presence) {
  const Lock lock(mutex_);
  writer_ = &writer;
  wire::Presence next = to_wire(presence);
  const bool same_missed = said_ && said_->absent() == next.absent();
  next.peers(same_missed ? said_->peers() : 0);
  said_ = std::move(next);
  say(std::max(said_->peers(), peers_.heard_count()));
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

// A new participant knows by this number whether it has discovered all, or heard who is missed. So
// who is gone counts until it is announced as missed.
// @return false if others must be told later
bool Contact::announce_count() {
  const auto heard = peers_.heard_count();
  const Lock lock(mutex_);
  if (!said_) return true;
  const auto now = Peers::Clock::now();
  const auto age = now - said_at_;
  const bool fewer = heard < said_->peers();
  if (!fewer) all_heard_at_ = now;
  const bool changed = said_->peers() != heard;
  if (changed && age < kCountEvery) return false;
  if (fewer && now - all_heard_at_ < kUncountedWithin) return false;
  if (changed || (repeats_ && age >= kRepeatEvery)) say(heard);
  return true;
}

void Contact::say(std::uint32_t heard) {
  said_->peers(heard);
  said_at_ = Peers::Clock::now();
  writer_->write(&*said_);
}

}  // namespace tfdude::fastdds
