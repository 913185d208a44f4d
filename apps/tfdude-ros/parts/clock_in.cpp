#include "clock_in.hpp"

#include <utility>

#include <spdlog/spdlog.h>

namespace tfdude::ros {

Result<void> ClockIn::start(RosDomain& domain, const IsNeighbour& is_own) {
  return domain.subscribe(clock_topic(), [this, is_own](Message&& message, const Source& source) {
    if (source.bridge && is_own(*source.bridge)) return;
    worker_.post([this, now = std::get<ClockTime>(message).now] { take(now); });
  });
}

void ClockIn::take(Time now) {
  const auto sent = node_.publish_clock(now);
  if (sent || std::exchange(logged_, sent.error().message) == sent.error().message) return;
  spdlog::warn("/clock: {}", sent.error().message);
}

}  // namespace tfdude::ros
