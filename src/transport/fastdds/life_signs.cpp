#include "transport/fastdds/life_signs.hpp"

#include <algorithm>
#include <cstring>

#include "transport/fastdds/rtps_layout.hpp"

namespace tfdude::fastdds {

void LifeSigns::follow(const PeerId& peer) {
  const Lock lock(mutex_);
  last_.try_emplace(peer);
}

void LifeSigns::forget(const PeerId& peer) {
  const Lock lock(mutex_);
  last_.erase(peer);
}

void LifeSigns::heard(const std::uint8_t* datagram, std::size_t size, Clock::time_point now) {
  PeerId sender;
  if (size < rtps::kPrefixAt + sender.size() || std::memcmp(datagram, "RTPS", 4) != 0) return;
  std::copy_n(datagram + rtps::kPrefixAt, sender.size(), sender.begin());
  const Lock lock(mutex_);
  if (const auto known = last_.find(sender); known != last_.end()) known->second = now;
}

std::optional<LifeSigns::Clock::time_point> LifeSigns::last(const PeerId& peer) const {
  const Lock lock(mutex_);
  const auto known = last_.find(peer);
  return known != last_.end() ? known->second : std::nullopt;
}

}  // namespace tfdude::fastdds
