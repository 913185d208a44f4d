#pragma once

#include "tfdude/math/belief.hpp"

namespace tfdude {

/// A measurement, with a root of the covariance of its error (square_root.hpp).
struct Measured {
  Pose X_AB;
  Loading root;
};

/// How many axes there are about which a measurement says nothing: of at least the deviation of an
/// angle that is anywhere, π/√3 rad.
/// @param root  of the covariance
[[nodiscard]] int unknown_rotations(const Loading& root);

/// The measurement with the rotation that X_AB has about such axes. Its translation stays, and so
/// does the covariance of that in A's axes. Otherwise the logarithm of their difference would turn
/// and stretch the translation by a rotation that nobody has measured.
[[nodiscard]] Measured with_unknown_rotation_of(const Pose& X_AB, const Measured& Z_AB);

}  // namespace tfdude
