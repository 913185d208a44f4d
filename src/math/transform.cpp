#include "tfdude/math/transform.hpp"

#include <string>

namespace tfdude {
namespace {

// Zero times each number, added up: zero for finite ones, else NaN.
bool all_finite(const double* numbers, std::size_t count) {
  double lanes[4] = {};
  for (std::size_t i = 0; i < count; i += 4) {
    for (std::size_t k = 0; k < 4; ++k) lanes[k] += 0.0 * numbers[i + k];
  }
  return lanes[0] + lanes[1] + lanes[2] + lanes[3] == 0.0;
}

}  // namespace

Result<void> check_finite(const Transform& X) {
  static_assert(sizeof(Transform) == 28 * sizeof(double));
  if (all_finite(reinterpret_cast<const double*>(&X), 28)) return {};
  const auto pose = Pose::create(X.pose.rotation(), X.pose.translation());
  if (!pose) return tl::unexpected(pose.error());
  const auto covariance = Covariance::from_upper(X.covariance.upper());
  if (!covariance) return tl::unexpected(covariance.error());
  return {};
}

Transform compose(const Transform& X_AB, const Transform& X_BC) {
  return {X_AB.pose * X_BC.pose,
          X_AB.covariance.transported(X_BC.pose.inverse()) + X_BC.covariance};
}

Transform inverse(const Transform& X_AB) {
  return {X_AB.pose.inverse(), X_AB.covariance.transported(X_AB.pose)};
}

Transform between(const Transform& X_WA, const Transform& X_WB) {
  return compose(inverse(X_WA), X_WB);
}

}  // namespace tfdude
