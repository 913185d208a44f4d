#include "clock.hpp"

#include <chrono>
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
  const auto sent = node_.publish_clock(external_time(now));
  if (sent || std::exchange(logged_, sent.error().message) == sent.error().message) return;
  spdlog::warn("/clock: {}", sent.error().message);
}

Result<void> ClockOut::start(RosDomain& domain) {
  auto publisher = domain.advertise(clock_topic());
  if (!publisher) return tl::unexpected(std::move(publisher.error()));
  publisher_ = *std::move(publisher);
  const std::chrono::duration<double> period(1 / rate_);
  worker_.repeat(std::chrono::duration_cast<std::chrono::nanoseconds>(period), [this] { send(); });
  return {};
}

void ClockOut::stop() {
  worker_.stop();
  publisher_ = nullptr;
}

void ClockOut::send() {
  const auto now = node_.now();
  if (now) publisher_->publish(ClockTime{*now});
}

}  // namespace tfdude::ros
