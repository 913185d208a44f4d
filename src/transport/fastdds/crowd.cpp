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
  const auto same = announced_.find(peer);
  if (same != announced_.end()) {
    same->second = now;
    return true;
  }
  // Not for each announcement of a flood.
  constexpr std::chrono::milliseconds kLookEvery{100};
  if (announced_.size() >= kMost && now - looked_ > kLookEvery) {
    looked_ = now;
    for (auto one = announced_.begin(); one != announced_.end();) {
      if (now - one->second <= kPatience) {
        ++one;
        continue;
      }
      leave_.push_back(one->first);
      one = announced_.erase(one);
    }
    any_ = !leave_.empty();
  }
  if (announced_.size() >= kMost) return false;
  announced_.emplace(peer, now);
  return true;
}

std::vector<PeerId> Crowd::take_all() {
  const Lock lock(mutex_);
  any_ = false;
  return std::exchange(leave_, {});
}

}  // namespace tfdude::fastdds
