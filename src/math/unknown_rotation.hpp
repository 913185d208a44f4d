#pragma once

#include <vector>

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

/// Loadings of edges, each column of which is an independent error: those that turn an edge by more
/// than 100 rad do so by 100 rad, and move all else by as much less. Either says of an angle that
/// nothing is known, but over a lever of the Earth's radius the larger ones would leave no digit of
/// what is known to a centimetre. O(elements).
/// @param loadings  all with the same columns
void bound_rotations(std::vector<Loading>& loadings);
/// The same of a covariance, of which nothing changes otherwise.
[[nodiscard]] Matrix6d with_bounded_rotations(const Matrix6d& covariance);

}  // namespace tfdude
