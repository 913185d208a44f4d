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

/// The owner of an edge, as a small number whose meaning the layer above defines.
using Owner = std::uint32_t;

/// The edge's value is held in this forest.
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

/// An edge of a segment whose covariance is unspecified.
struct UnspecifiedEdge {
  std::size_t segment = 0;
  std::string id;
};

/// A sample of an edge that drifts, at another instant than that of the answer, which is corrected
/// together with the edge: its error is another row of the joint covariance.
struct RowOfSample {
  std::uint32_t segment = 0;
  Time stamp{};
  Transform X_PC;
  PathCorrelation correlation{};
};

/// Which of these are asked for.
enum class Rows : std::uint8_t {
  kNone,
  kOfPath,  ///< those without which the value at the instant cannot be corrected
  kAll,     ///< all that are kept, as they are stored
};

/// The values of some segments at one instant.
struct ValuesAtInstant {
  std::vector<Transform> values;  ///< one per segment
  /// One per segment, whose covariance is then that of the own part; empty if no edge is
  /// correlated.
  std::vector<PathCorrelation> correlations{};
  /// Of the segments whose covariance is not complete, in the order of the path.
  std::vector<UnspecifiedEdge> unspecified{};
};

/// The values of one owner's part of a path: all from one commit and for one instant.
struct SegmentValues : ValuesAtInstant {
  std::optional<Time> stamp;
  /// Time between the two newest samples of the edge whose newest sample is the oldest.
  std::chrono::nanoseconds period{0};
  ValuesAtInstant at_hint{};      ///< at the other instant; empty if they are not available
  std::uint64_t commit = 0;       ///< the commit of the values; see revise()
  std::uint64_t history = 0;      ///< the newest history of their edges; see PushedValue
  std::uint64_t incarnation = 0;  ///< of the owner that counts the commits; see Partition
  /// Identifies what is said of the errors of their edges, besides those of joints. Only of
  /// segments_since().
  std::uint64_t said = 0;
  /// There are no values: the history of an edge was cleared. Only of segments_since().
  bool cleared = false;
  /// They are those of no instant: an edge had no sample yet. Only of segments_since().
  bool unsampled = false;
  std::vector<RowOfSample> rows{};  ///< of edges, the latest of each first
};

/// What was seen of segments: their values at a commit, at instants up to their newest one. Late
/// samples, and new values of edges without samples, have changed these since.
struct SeenSegments {
  std::uint64_t commit = 0;
  Time until{};
  bool newest_only = false;  ///< of the later instants
  /// SegmentValues::said then, which is said of all samples of an edge; none: it is not compared.
  std::optional<std::uint64_t> said{};
};

/// Information about one frame, without its value.
struct FrameInfo {
  std::string id;
  std::string parent;  ///< empty: a root
  Owner owner = kHeldHere;
  bool attached = false;           ///< its parent exists
  std::uint64_t lamport_time = 0;  ///< when it got its parent
};

}  // namespace tfdude
