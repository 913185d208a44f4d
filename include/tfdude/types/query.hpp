#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/belief.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// What a lookup asks for: the instant, and the order to which covariance is propagated.
struct Query {
  /// Absent: the newest instant for which all dynamic edges of the path have data.
  std::optional<Time> at;
  /// How far beyond an edge's newest sample it may be extrapolated, with the motion of its last two
  /// samples: at most by 100 times the time between them, and not if one of them came without a
  /// stamp.
  std::chrono::nanoseconds extrapolate{0};
  /// Adds the process noise of the dynamic edges, from the instant of the answer until this one, to
  /// the covariance of the answer.
  std::optional<Time> age_noise_until;
  Order order = Order::kSecond;
  /// Where an owner on this computer has died, or does not respond: the last values of its edges,
  /// if this client has read its memory before. The answer names the owner (Basis::lost). Only of
  /// Client::lookup(). Otherwise such a lookup fails with kUnreachable.
  bool last_known = false;
  /// What the owners had committed by this instant of their clocks, instead of what they know now:
  /// without samples that came later, observations, rewrites and new values since. `at` is absent:
  /// the latest common time as of then. The structure is that of now: an edge that is younger, as
  /// its frame was moved, is kTooOld. Only where EdgeTiming::believed says that it is remembered,
  /// or nothing has changed since; otherwise kTooOld, naming the edge and since when it can be
  /// asked for. kNotYet: ahead of an owner's clock. The answer of an owner of an earlier version is
  /// kUnsupported. An owner looks through all samples of the edges since then, and its writers wait
  /// meanwhile. Watches remember nothing.
  std::optional<Time> believed_at{};
};

/// An owner that is gone.
struct LostOwner {
  std::string partition;
  std::chrono::nanoseconds ago{0};  ///< since that was noticed
};

/// What the covariance of an answer is based on. Edges without a stated correlation count as
/// independent.
struct Basis {
  Order order = Order::kSecond;
  /// The path has edges of unknown correlation: the covariance is an upper bound for any
  /// correlation.
  bool bound = false;
  /// Error sources that edges of the path share, including those of observations.
  std::vector<std::string> sources;
  /// The edges whose covariance is unspecified, named by their child frames, in the order of the
  /// path. The covariance is that of all others. A watched path that is sent composed names the
  /// frame at the end of a segment for all of its edges.
  std::vector<std::string> unspecified{};
  /// The owners that are gone: the answer has their last values. See Query::last_known.
  std::vector<LostOwner> lost{};
};

/// A transform and its instant. Without a stamp it holds for all times: all edges are static.
struct StampedTransform : Transform {
  std::optional<Time> stamp;
  Basis basis{};

  /// Without the instant and the basis.
  [[nodiscard]] Transform transform() const { return {pose, covariance}; }
};

/// The interval of a velocity.
struct VelocityQuery {
  /// The middle of the interval, which then ends no later than the newest instant for which all
  /// dynamic edges of the path have data. Absent: the interval ends there.
  std::optional<Time> at;
  std::chrono::nanoseconds over = std::chrono::milliseconds(100);  ///< the length; positive
};

/// The mean velocity of frame B in frame A over an interval. Both vectors are expressed in the axes
/// of A, and the reference point is the origin of B.
struct Velocity {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();   ///< of B's origin [m/s]
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();  ///< [rad/s]
  /// Of the errors of (linear, angular), to first order [m²/s², rad²/s²].
  StatedCovariance covariance{};
  /// The ends of the interval; absent: all edges are static, so the velocity is zero at all times.
  std::optional<Time> begin{};
  std::optional<Time> end{};
  Basis basis{};
};

/// The result of a measurement.
struct Observed {
  /// Squared Mahalanobis distance of the measurement from the estimate.
  double distance_squared = 0;
  int dimensions = 0;  ///< dimensions of that distance
  double limit = 0;    ///< of the gate
  bool accepted = false;
  std::vector<std::string> corrected;  ///< edges whose values have changed
  /// Edges that were correlated with those of the path, and are not any more: too many were
  /// (kMaxObservedTogether), and these the least.
  std::vector<std::string> forgotten;
  std::optional<Time> stamp;  ///< of the corrected dynamic edges
};

}  // namespace tfdude
