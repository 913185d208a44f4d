#pragma once

#include "calls/time_limit.hpp"

namespace tfdude {

/// The time limit of a call that begins now. Created once, at the start of the call, and passed to
/// everything that it waits for.
class Deadline : public TimeLimit {
 public:
  explicit Deadline(Milliseconds wait, Clock::time_point now = Clock::now())
      : TimeLimit(wait, now) {}

  /// This deadline, or the one `wait` from now if that is earlier.
  [[nodiscard]] Deadline within(Milliseconds wait, Clock::time_point now = Clock::now()) const {
    const Deadline other(wait, now);
    return other.at() < at() ? other : *this;
  }

  /// What is left of it.
  [[nodiscard]] Milliseconds left(Clock::time_point now = Clock::now()) const {
    if (at() == Clock::time_point::max()) return Milliseconds::max();
    return std::chrono::ceil<Milliseconds>(at() - now);
  }

  [[nodiscard]] bool over(Clock::time_point now = Clock::now()) const {
    return TimeLimit::over(now);
  }
};

}  // namespace tfdude
