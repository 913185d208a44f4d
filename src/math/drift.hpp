#pragma once

#include <optional>

#include "tfdude/math/belief.hpp"

namespace tfdude {

/// The errors e0, e1 of one edge at two instants, where e1 = F e0 + w, and w is independent of e0.
struct Drift {
  Matrix6d F = Matrix6d::Identity();
  Covariance added;  ///< of w
};

/// Of an edge that drifts: it has moved from one value to the other as it was told (F is the
/// adjoint of that motion's inverse), and w is what the drift has added (random_walk.hpp), the
/// difference of the two covariances. Where a pose that came late leaves it a little below zero, an
/// upper bound.
/// @return nothing if the later value does not follow from the earlier one, as an observation has
///   corrected it alone
[[nodiscard]] std::optional<Drift> drift_between(const Belief& earlier, const Belief& later);

/// Of an edge that drifts: whether the same observations have corrected both values, so that what
/// is left of their errors is of the same sources, and lasts from one to the other. Their own parts
/// may be correlated in any way.
[[nodiscard]] bool are_corrected_together(const Belief& a, const Belief& b);

/// Whether it is a part of an edge's error that an observation may have tied to those of others.
[[nodiscard]] bool ties(const CommonError& common_error);

/// Removes all errors of an edge, but for those of named sources. @return  their covariance, as
/// large as before any observation
[[nodiscard]] Covariance take_whole(Belief& X);

}  // namespace tfdude
