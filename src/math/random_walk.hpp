#pragma once

#include "tfdude/math/covariance.hpp"
#include "tfdude/math/pose.hpp"

namespace tfdude {

/// The covariance that a random walk adds to the error of a pose that moves evenly: Δt ∫ A(a) Q
/// A(a)ᵀ da, a from 0 to 1, with A(a) = Ad(Exp(-a ξ)) and ξ = Log(increment). What was added early
/// is moved along: a rotation becomes an error across the rest of the way. So two parts of a way
/// add as much as the whole: walked(whole) = A walked(first) Aᵀ + walked(second).
///
/// The result is exact to 1e-7 along each axis to which at least 1e-9 of the largest variance in m²
/// (in rad²) is added.
/// @param density  Q per second, of the right perturbation
/// @param increment  from the pose before to the one after; half a turn at most (log())
/// @param seconds  Δt, not negative
/// @note O(1): the time of 1 to 4 transports of a covariance for less than a quarter of a radian,
///   that of up to 12 for half a turn
[[nodiscard]] Covariance walked(const Covariance& density, const Pose& increment, double seconds);

/// What is known of an error between two instants, e = E e0 + u, if that at the later one is
/// e1 = F e + w: it is E e0 + K (e1 - F E e0) and an independent rest.
struct Bridge {
  Matrix6d K;
  Matrix6d rest;  ///< the covariance of the rest
};

/// @param until  the covariance of u, what was added until the instant between
/// @param since  that of w
[[nodiscard]] Bridge bridged(const Matrix6d& until, const Matrix6d& F, const Matrix6d& since);

}  // namespace tfdude
