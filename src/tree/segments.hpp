#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"

#include "tree/path_correlation.hpp"

namespace tfdude {

/// Whose an edge is, as a small number that the layer above gives a meaning to.
using Owner = std::uint32_t;

/// The edge's value is held in this very forest.
inline constexpr Owner kHeldHere = 0;

/// The ends of a run of edges.
struct PathEnds {
  std::string from;
  std::string to;
};

/// A run of edges on a path that one owner holds: X from `from` to `to`.
struct Segment {
  Owner owner = kHeldHere;
  std::string from;
  std::string to;
};

/// What one owner says of its part of a path: all of one commit, and of one instant.
struct SegmentValues {
  std::vector<Transform> values;  ///< one a segment
  std::optional<Time> stamp;
  /// Since the sample before the newest, of the edge whose newest sample is the oldest.
  std::chrono::nanoseconds period{0};
  std::vector<Transform> at_hint;  ///< the same at another instant; empty if that is not to be had
  /// By segment, whose values' covariances are of own parts then; empty if no edge is correlated with any other.
  std::vector<PathCorrelation> correlations{};
  std::vector<PathCorrelation> correlations_at_hint{};
  std::uint64_t commit = 0;       ///< of which the values are; see revise()
  std::uint64_t history = 0;      ///< the newest of their edges': see PushedValue
  std::uint64_t incarnation = 0;  ///< of the owner that counts the commits; see Partition
};

/// What is known of one frame besides its value.
struct FrameInfo {
  std::string id;
  std::string parent;  ///< empty: a root
  Owner owner = kHeldHere;
  bool attached = false;           ///< its parent is there
  std::uint64_t lamport_time = 0;  ///< when it was hung where it hangs
};

}  // namespace tfdude
