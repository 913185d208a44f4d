#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <deque>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "tfdude/base/result.hpp"

namespace tfdude::faults {

using Clock = std::chrono::steady_clock;

inline double milliseconds_since(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

/// How long after the last fault all participants must be up to date [s].
inline constexpr double kGrace = 5.0;

/// The events of a run: how often each kind of operation ended in which way, the faults, and the
/// contradictions to the model. Thread-safe.
class Journal {
 public:
  /// Seconds since the run began.
  [[nodiscard]] double now() const {
    return std::chrono::duration<double>(Clock::now() - begin_).count();
  }

  void count(const std::string& operation, const std::string& outcome);
  /// A fault, or its end.
  void fault(const std::string& what);
  /// Prints it at once, with its history and the faults before it.
  void violation(const std::string& what, const std::vector<std::string>& history = {});

  [[nodiscard]] std::size_t violations() const { return violations_; }
  /// A line for each operation, with its outcomes.
  [[nodiscard]] std::string counts() const;

  /// A fault is on until it is over; several may be on at a time.
  void disturb() { ++disturbances_; }
  void calm_down();
  /// For how long no fault has been on [s].
  [[nodiscard]] double calm() const;

 private:
  const Clock::time_point begin_ = Clock::now();
  mutable std::mutex mutex_;
  std::map<std::string, std::map<std::string, std::size_t>> counts_;
  std::deque<std::string> faults_;  // the latest
  std::atomic<std::size_t> violations_{0};
  std::atomic<int> disturbances_{0};
  std::atomic<double> calm_since_{0};
};

/// "done", or the error's code.
template <class Value>
[[nodiscard]] std::string outcome_of(const Result<Value>& result) {
  return result ? "done" : std::string(to_string(result.error().code));
}

/// "  12.345", as times are printed here [s].
[[nodiscard]] std::string seconds(double time);

/// "p50 0.1 ms, p90 0.2 ms, p99 0.3 ms, longest 0.4 ms of 17"; "none" if there are none.
[[nodiscard]] std::string distribution(std::vector<double> milliseconds);

}  // namespace tfdude::faults
