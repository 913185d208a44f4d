#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/correlation.hpp"

namespace tfdude {

/// A frame of a watched partition.
struct WatchedFrame {
  std::string id;
  std::string parent;  ///< empty: a root, which has no values

  friend bool operator==(const WatchedFrame& a, const WatchedFrame& b) {
    return a.id == b.id && a.parent == b.parent;
  }
};

/// The frames of the partition have changed; these are all. Values of edges that stay are not
/// repeated.
struct FramesNews {
  std::vector<WatchedFrame> frames;  ///< sorted by id
  /// Of the owner's process. With another number all values come again.
  std::uint64_t incarnation = 0;
};

/// A value X_PC of an edge.
struct WatchedValue {
  std::uint32_t frame = 0;    ///< index among the last reported frames
  std::optional<Time> stamp;  ///< absent: it holds for all times, if nothing else is said below
  Transform X_PC;
  /// Of the edge, from now on and for all its history; but see of_sample().
  Correlation correlation{};
  /// Process noise of the edge per second. Given with the first value of a history: what is known
  /// of the edge so far does not hold any more.
  std::optional<Covariance> begins{};
  /// The history was cleared: the edge is dynamic, and has no value until its next sample.
  bool cleared = false;
  /// The edge is dynamic, and had no sample yet. The value, as configured, is that of no instant.
  bool unsampled = false;
  /// Given with `begins` if the past was rewritten (Client::rewrite()): samples before this instant
  /// still hold, and all from then on follow.
  std::optional<Time> kept_before{};
  /// With `begins`: the edge drifts (EdgeTiming::drifts).
  bool drifts = false;

  /// Whether the correlation is that of this sample alone, which an observation has corrected. What
  /// is said of the edge stays.
  [[nodiscard]] bool of_sample() const { return stamp && !correlation.observed_with.empty(); }
};

/// What the owner has written in one commit, or in several consecutive ones. Samples of an edge are
/// mostly in the order of their stamps, but may come late.
struct ValuesNews {
  std::uint64_t commit = 0;  ///< the owner's last one that is contained
  std::vector<WatchedValue> values;
};

/// The owner is reachable, or not. Its last values hold on while it is not. One that denies the
/// watch is not, until it answers.
struct ReachNews {
  bool reachable = false;
  std::string why;  ///< if it is not
};

/// What a watch of a partition reports. The first are that it is reachable, and its frames.
struct PartitionNews {
  std::string partition;
  std::variant<ReachNews, FramesNews, ValuesNews> what;
};

}  // namespace tfdude
