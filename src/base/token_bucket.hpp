#pragma once

#include <algorithm>
#include <chrono>

namespace tfdude {

/// Permits so many things at once, and so many in a second on average. Time comes from outside.
class TokenBucket {
 public:
  using Clock = std::chrono::steady_clock;

  TokenBucket(double per_second, double at_once)
      : rate_(per_second), most_(at_once), tokens_(at_once) {}

  /// Whether there is one more; if so, takes it.
  [[nodiscard]] bool take(Clock::time_point now) {
    const std::chrono::duration<double> passed = now - at_;
    tokens_ = std::min(most_, tokens_ + std::max(0.0, passed.count()) * rate_);
    at_ = std::max(at_, now);
    if (tokens_ < 1) return false;
    tokens_ -= 1;
    return true;
  }

 private:
  double rate_;
  double most_;
  double tokens_;
  Clock::time_point at_{};
};

}  // namespace tfdude
