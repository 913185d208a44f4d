#pragma once

#include <array>
#include <cstdint>

#include "tfdude/math/transform.hpp"

#include "math/path_accumulation.hpp"

namespace tfdude {

/// The stamp of a value that holds for all times.
inline constexpr std::int64_t kAlways = INT64_MIN;

/// The covariance of consecutive samples that have the same. Three cache lines.
struct alignas(64) SharedCovariance {
  StatedCovariance value;
  std::uint64_t samples = 0;  ///< that have it; for the writer only
};

/// A sample of an edge. Immutable once its commit is visible.
struct Sample {
  std::int64_t stamp = 0;
  std::uint64_t commit = 0;  ///< that added it
  const SharedCovariance* covariance = nullptr;
  Pose pose;

  [[nodiscard]] Transform value() const { return {pose, covariance->value}; }
  [[nodiscard]] TransformParts parts() const { return {&pose, &covariance->value}; }
  [[nodiscard]] bool complete() const { return covariance->value.complete(); }
};

/// Consecutive samples of one history.
struct SampleChunk {
  static constexpr std::uint64_t kSize = 8;

  std::uint64_t first = 0;  ///< number of the first of them
  std::array<Sample, kSize> samples;
};

}  // namespace tfdude
