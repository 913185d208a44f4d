#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace bench {

using Clock = std::chrono::steady_clock;

inline double microseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::micro>(Clock::now() - start).count();
}

/// The measured values of one figure, in repetitions, so that two figures measured in turns can be
/// compared repetition by repetition.
class Series {
 public:
  /// @param key   the figure's name in the results, words separated by slashes; must stay the same
  /// @param unit  of the values
  Series(std::string key, std::string unit) : key_(std::move(key)), unit_(std::move(unit)) {}

  void reserve(std::size_t values) { values_.reserve(values); }
  void add(double value) { values_.push_back(value); }
  void end_repetition();

  /// Prints one line of JSON: key, unit, n, mean, quantiles, and the median of each repetition.
  void print() const;

 private:
  std::string key_;
  std::string unit_;
  std::vector<double> values_;
  std::vector<double> medians_;
  std::size_t begin_ = 0;  // of the current repetition
};

}  // namespace bench
