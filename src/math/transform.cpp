#include "tfdude/math/transform.hpp"

#include "math/finite.hpp"

namespace tfdude {
Result<void> check_finite(const Transform& X) {
  if (is_finite(X)) return {};
  const auto pose = Pose::create(X.pose.rotation(), X.pose.translation());
  if (!pose) return tl::unexpected(pose.error());
  const auto covariance = Covariance::from_upper(X.covariance.of_specified().upper());
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
