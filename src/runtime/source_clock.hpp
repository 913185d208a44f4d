#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <optional>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

#include "base/mutex.hpp"
#include "base/stamp.hpp"
#include "runtime/deadline.hpp"
#include "runtime/wall_clock.hpp"

namespace tfdude {

/// The clock of a participant's stamps: the system's, or an external one, which is told the time.
/// @par Thread safety  All functions are thread-safe; now() takes no lock.
class SourceClock {
 public:
  explicit SourceClock(ClockKind kind) : kind_(kind) {}

  [[nodiscard]] ClockKind kind() const { return kind_; }

  /// Nothing if it is external and has not been told the time yet.
  [[nodiscard]] std::optional<Time> now() const {
    if (kind_ == ClockKind::kSystem) return wall_clock();
    const std::int64_t told = told_.load(std::memory_order_acquire);
    return told == kUntold ? std::nullopt : std::optional<Time>(time_of(told));
  }

  /// Waits until the time is known. @return kNotYet at the deadline
  [[nodiscard]] Result<Time> await(const Deadline& deadline) {
    {
      Lock lock(mutex_);
      (void)first_.wait_until(lock, deadline.at(), [this] { return ended_ || now().has_value(); });
    }
    if (const auto time = now()) return *time;
    return fail(Errc::kNotYet, "the clock is external, and nobody has published the time");
  }

  /// Waits until a time. The system's clock may be set meanwhile, so it is looked at repeatedly.
  /// @return kTimeout at the deadline, which says what time it is; kTransport: the client ends
  [[nodiscard]] Result<void> wait_until(Time time, const Deadline& deadline) {
    constexpr Milliseconds kLook{50};
    ++waiting_;
    {
      Lock lock(mutex_);
      for (auto now = this->now(); !now || *now < time; now = this->now()) {
        const auto steady = Deadline::Clock::now();
        if (ended_ || deadline.over(steady)) break;
        auto until = std::min(deadline.at(), steady + kLook);
        if (now && kind_ == ClockKind::kSystem) {
          const std::chrono::nanoseconds look = kLook;
          until = std::min(until, steady + std::min(time - *now, look));
        }
        (void)first_.wait_until(lock, until);
      }
    }
    --waiting_;
    const auto now = this->now();
    if (now && *now >= time) return {};
    if (ended_) {
      return fail(Errc::kTransport, "the client has ended before it was " + readable(time));
    }
    return fail(Errc::kTimeout, "it is not " + readable(time) + " within " + deadline.text() +
                                    ": the time is " + (now ? readable(*now) : "not known"));
  }

  /// The client ends: nobody waits for a time any more, or will.
  void end_waits() {
    ended_ = true;
    { const Lock lock(mutex_); }
    first_.notify_all();
  }

  /// Sets an external clock. @return the time before, if that was later; kInvalidInput.
  [[nodiscard]] Result<std::optional<Time>> set(Time time) {
    if (kind_ != ClockKind::kExternal) {
      return fail(Errc::kInvalidInput,
                  "the system's clock cannot be set: open with clock external");
    }
    if (auto ok = check_stamp(time); !ok) return tl::unexpected(std::move(ok.error()));
    const std::int64_t before = told_.exchange(nanoseconds(time));
    if (before == kUntold || waiting_.load() > 0) {
      // The lock prevents a notification between the check of a waiting thread and its sleep.
      { const Lock lock(mutex_); }
      first_.notify_all();
    }
    return before > nanoseconds(time) ? std::optional<Time>(time_of(before)) : std::nullopt;
  }

 private:
  static constexpr std::int64_t kUntold = -1;
  const ClockKind kind_;
  std::atomic<std::int64_t> told_{kUntold};
  Mutex mutex_;  // of the wait only
  Condition first_;
  std::atomic<int> waiting_{0};  // for a time
  std::atomic<bool> ended_{false};
};

}  // namespace tfdude
