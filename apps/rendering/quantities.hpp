#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tfdude/client/client.hpp"

// Numbers that several answers have.
namespace tfdude::cli {

[[nodiscard]] inline double seconds(std::chrono::nanoseconds duration) {
  return static_cast<double>(duration.count()) * 1e-9;
}

/// Mean rate of an edge's samples [Hz]; 0 if there are fewer than two.
[[nodiscard]] inline double rate_of(const HistoryInfo& history) {
  return history.mean_gap.count() > 0 ? 1.0 / seconds(history.mean_gap) : 0.0;
}

/// Number of an edge's rejected samples.
[[nodiscard]] inline std::uint64_t rejected_of(const HistoryInfo& history) {
  return history.refused_old + history.refused_equal + history.refused_ahead;
}

/// The total of a partition's histories.
struct HistorySum {
  std::size_t edges = 0;  ///< dynamic ones
  std::size_t samples = 0;
  std::size_t bytes = 0;
};
[[nodiscard]] inline HistorySum sum_of(const std::vector<HistoryInfo>& histories) {
  HistorySum sum;
  for (const HistoryInfo& history : histories) {
    if (history.dynamic()) ++sum.edges;
    sum.samples += history.samples;
    sum.bytes += history.bytes;
  }
  return sum;
}

}  // namespace tfdude::cli
