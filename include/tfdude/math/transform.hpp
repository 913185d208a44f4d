#pragma once

#include <type_traits>

#include "tfdude/base/export.hpp"
#include "tfdude/math/pose.hpp"
#include "tfdude/math/stated_covariance.hpp"

namespace tfdude {

/// A pose X_AB with the covariance of its right perturbation, expressed in B: the value of an edge
/// and the answer to a lookup. 28 doubles and a flag, trivially copyable; always valid, since its
/// parts are.
struct Transform {
  Transform() = default;
  Transform(const Pose& X_AB, const StatedCovariance& sigma) : pose(X_AB), covariance(sigma) {}
  /// With an unspecified covariance.
  explicit Transform(const Pose& X_AB) : pose(X_AB) {}
  /// Of an answer, transform() leaves out the instant and the basis; no copy does so unasked.
  template <class Answer, class = std::enable_if_t<!std::is_same_v<Answer, Transform> &&
                                                   std::is_base_of_v<Transform, Answer>>>
  Transform(const Answer& more) = delete;

  /// A pose that is known exactly.
  [[nodiscard]] static Transform exact(const Pose& X_AB) {
    return {X_AB, StatedCovariance::exact()};
  }

  Pose pose;
  StatedCovariance covariance;  ///< unspecified, unless given
};

/// Checks values that did not pass the checked constructors, for example the result of a
/// computation, which may be NaN. Takes some nanoseconds.
/// @return kInvalidInput naming the field: NaN, infinity.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_finite(const Transform& X);

/// X_AC of X_AB and X_BC with independent errors, first order: Σ_AC = Ad(X_BC⁻¹) Σ_AB Ad(X_BC⁻¹)ᵀ +
/// Σ_BC. Unspecified covariances add nothing to the numbers; the result then is not complete.
/// Barfoot & Furgale 2014, Eq. 40 to second order, written for the right perturbation.
[[nodiscard]] TFDUDE_EXPORT Transform compose(const Transform& X_AB, const Transform& X_BC);

/// X_BA of X_AB, first order (and exact for the perturbation's distribution): Σ_BA = Ad(X_AB) Σ_AB
/// Ad(X_AB)ᵀ.
[[nodiscard]] TFDUDE_EXPORT Transform inverse(const Transform& X_AB);

/// X_AB of X_WA and X_WB with independent errors: compose(inverse(X_WA), X_WB).
[[nodiscard]] TFDUDE_EXPORT Transform between(const Transform& X_WA, const Transform& X_WB);

}  // namespace tfdude
