#include "transport/fastdds/crowd.hpp"

#include <string_view>
#include <utility>

namespace tfdude::fastdds {

std::size_t Crowd::Hash::operator()(const PeerId& peer) const {
  return std::hash<std::string_view>()(
      std::string_view(reinterpret_cast<const char*>(peer.data()), peer.size()));
}

bool Crowd::admit(const PeerId& peer, Clock::time_point now) {
  const Lock lock(mutex_);
  if (verifies_ && now - listened_ > std::chrono::seconds(1)) drop_silent(now);
  const auto same = announced_.find(peer);
  if (same != announced_.end()) {
    same->second.heard = now;
    return true;
  }
  // Not for each announcement of a flood.
  constexpr std::chrono::milliseconds kLookEvery{100};
  if (!has_room() && now - looked_ > kLookEvery) make_room(now);
  if (!has_room()) return false;
  announced_.emplace(peer, Present{now, now});
  ++unverified_;
  return true;
}

void Crowd::make_room(Clock::time_point now) {
  looked_ = now;
  drop([&](const Present& there) {
    const bool unproven = verifies_ && !there.verified && now - there.since > kVerifiedWithin;
    return unproven || now - there.heard > kPatience;
  });
}

void Crowd::drop_silent(Clock::time_point now) {
  listened_ = now;
  drop([&](const Present& there) { return now - there.heard > kSilence; });
}

template <class Leaves>
void Crowd::drop(const Leaves& leaves) {
  for (auto one = announced_.begin(); one != announced_.end();) {
    if (!leaves(one->second)) {
      ++one;
      continue;
    }
    leave_.push_back(one->first);
    one = erase(one);
  }
  any_ = !leave_.empty();
}

Crowd::All::iterator Crowd::erase(All::iterator one) {
  if (!one->second.verified) --unverified_;
  return announced_.erase(one);
}

void Crowd::left(const PeerId& peer) {
  const Lock lock(mutex_);
  const auto there = announced_.find(peer);
  if (there != announced_.end()) erase(there);
}

void Crowd::verified(const PeerId& peer) {
  const Lock lock(mutex_);
  const auto there = announced_.find(peer);
  if (there != announced_.end() && !std::exchange(there->second.verified, true)) --unverified_;
}

std::vector<PeerId> Crowd::take_all() {
  const Lock lock(mutex_);
  any_ = false;
  return std::exchange(leave_, {});
}

}  // namespace tfdude::fastdds
