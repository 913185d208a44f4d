#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "tfdude/base/time.hpp"
#include "tfdude/math/observation.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// A frame by number: find it once by id, then use it without hashing. It is valid in one forest
/// only and until the frame is removed: a later frame with the same id gets another handle, and
/// other forests of the process treat the handle as an unknown frame.
struct Handle {
  std::uint32_t slot = 0;
  std::uint32_t generation = 0;
};

/// A new value X_PC for the edge, which is named by the child's id.
struct EdgeUpdate {
  std::string id;
  Transform X_PC;
};

/// As EdgeUpdate, with the child's handle.
struct HandleUpdate {
  Handle frame;
  Transform X_PC;
};

/// Parts of a transform. A whole transform converts to all of its parts.
struct PartialTransform {
  PartialTransform() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): so that {translation} is one
  PartialTransform(std::optional<Eigen::Vector3d> p,
                   std::optional<Eigen::Quaterniond> q = std::nullopt,
                   std::optional<StatedCovariance> cov = std::nullopt)
      : translation(std::move(p)), rotation(std::move(q)), covariance(cov) {}
  // NOLINTNEXTLINE(google-explicit-constructor): it is the whole, of the same meaning
  PartialTransform(const Transform& X)
      : translation(X.pose.translation()), rotation(X.pose.rotation()), covariance(X.covariance) {}

  [[nodiscard]] bool empty() const { return !translation && !rotation && !covariance; }

  std::optional<Eigen::Vector3d> translation;  ///< [m]
  std::optional<Eigen::Quaterniond> rotation;
  std::optional<StatedCovariance> covariance;
};

/// Parts of a new value X_PC for the edge, which is named by the child's id. Absent parts stay as
/// they are.
struct PartialUpdate {
  std::string id;
  PartialTransform X_PC{};
};

/// How an edge behaves in time.
struct EdgeTiming {
  /// Samples that are older than the newest one by more than this are dropped.
  std::chrono::nanoseconds span = std::chrono::seconds(10);
  /// Maximum number of samples; at least 2. The default is 10 s at 1 kHz, and a little more.
  std::size_t count = 10'240;
  /// Covariance per second by which the edge may deviate from the geodesic between two samples, or
  /// from its last value. At the fraction a of the interval Δt between two samples this adds a
  /// (1-a) Δt Q (Brownian bridge).
  Covariance process_noise{};
  /// True: the edge's error is a random walk of that density, as is that of odometry. Its values
  /// tell how it moves from one to the next; their covariance does not count, except for the first.
  /// So the error of each value is that of the one before, and what has been added since: Q Δt, and
  /// what the way makes of it, along which the edge moves evenly.
  /// What observations find out about it is kept, and so is its correlation with what was observed.
  /// A lookup gets the corrected pose: that of the value before, moved as the given values tell.
  bool drifts = false;
  /// True: dynamic from the first update on. False: dynamic from the first update with a stamp on.
  bool moving = false;
  /// Samples further ahead of the owner's clock are rejected; max(): no limit.
  std::chrono::nanoseconds max_ahead = std::chrono::seconds(60);
  /// After this many consecutive samples that are older than the span, each later than the one
  /// before, the history restarts: the clock of their source has jumped back. 0: never.
  std::size_t restart_after = 5;
  /// How long what the edge was is remembered after a later commit has changed it: late samples,
  /// observations, rewrites, cleared histories, values, and what is dropped from the history. See
  /// Query::believed_at. 0: not at all. As long as the longest of the owner's edges, and within the
  /// memory of its histories (NodeOptions::max_history), of which it is dropped first. It takes
  /// about 90 bytes for each sample that is dropped, and 400 for each new value of a static edge.
  std::chrono::nanoseconds believed{0};
};

/// Statistics of one edge's stored history. Of a static edge no more than its rejected samples.
struct HistoryInfo {
  std::string id;
  std::size_t samples = 0;
  std::size_t bytes = 0;
  std::chrono::nanoseconds span_limit{0};
  std::size_t count_limit = 0;
  std::optional<Time> oldest;
  std::optional<Time> newest;
  std::chrono::nanoseconds mean_gap{0};  ///< mean time between samples
  std::chrono::nanoseconds max_gap{0};
  std::chrono::nanoseconds jitter{0};  ///< standard deviation of the gaps
  std::uint64_t refused_old = 0;       ///< samples rejected: older than the kept history
  std::uint64_t refused_equal = 0;     ///< samples rejected: stamp of another sample
  std::uint64_t refused_ahead = 0;     ///< samples rejected: too far ahead of the owner's clock

  /// Whether the edge is dynamic. It may have no sample yet, or none any more.
  [[nodiscard]] bool dynamic() const { return count_limit > 0; }
};

/// What observations have shown so far about one edge's covariance.
struct EdgeConsistency {
  std::string id;
  std::uint64_t observations = 0;
  std::uint64_t refused = 0;  ///< of these, rejected by the gate
  NormalizedInnovation sum;   ///< over all of them
};

}  // namespace tfdude
