#include "transport/fastdds/departures.hpp"

#include <algorithm>

namespace tfdude::fastdds {

void Departures::said(const PeerId& peer, Clock::time_point now) {
  const Lock lock(mutex_);
  const auto same = std::find_if(leaving_.begin(), leaving_.end(),
                                 [&](const Leaving& one) { return one.peer == peer; });
  // A repetition does not make it later.
  if (same != leaving_.end() || leaving_.size() >= kMost) return;
  leaving_.push_back({peer, now});
  any_ = true;
}

void Departures::stays(const PeerId& peer, Clock::time_point now) {
  const Lock lock(mutex_);
  const auto is_here = [&](const Leaving& one) {
    return one.peer == peer && now - one.said > kOvertaken;
  };
  leaving_.erase(std::remove_if(leaving_.begin(), leaving_.end(), is_here), leaving_.end());
  any_ = !leaving_.empty();
}

std::vector<PeerId> Departures::take_silent(Clock::time_point now) {
  const Lock lock(mutex_);
  std::vector<PeerId> left;
  const auto is_silent = [&](const Leaving& one) {
    if (now - one.said < kSilence) return false;
    left.push_back(one.peer);
    return true;
  };
  leaving_.erase(std::remove_if(leaving_.begin(), leaving_.end(), is_silent), leaving_.end());
  any_ = !leaving_.empty();
  return left;
}

}  // namespace tfdude::fastdds
