#include "tfdude/math/transform.hpp"

namespace tfdude {

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

void Climb::up(const Transform& X_PC) {
  left_ += X_PC.covariance.transported(X_SH_);
  X_SH_ = X_SH_ * X_PC.pose.inverse();
}

Transform join(const Climb& from_a, const Climb& from_b) {
  const Pose X_BA = from_b.pose() * from_a.pose().inverse();
  return {X_BA.inverse(), from_a.left_.transported(X_BA) + from_b.left_};
}

}  // namespace tfdude
