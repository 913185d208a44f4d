#pragma once

#include "tfdude/math/transform.hpp"

namespace tfdude {

/// How many axes there are about which a measurement says nothing: of at least the deviation of an
/// angle that is anywhere, π/√3 rad.
[[nodiscard]] int unknown_rotations(const Covariance& R);

/// The measurement with the rotation that X_AB has about such axes. Its translation stays, and so
/// does the covariance of that in A's axes. Otherwise the logarithm of their difference would turn
/// and stretch the translation by a rotation that nobody has measured.
[[nodiscard]] Transform with_unknown_rotation_of(const Pose& X_AB, const Transform& Z_AB);

}  // namespace tfdude
