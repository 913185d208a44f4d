#include <cstdio>
#include <cstdlib>

#include "tfdude/math/transform.hpp"

// Two edges of known uncertainty: the variances of the translation add up along x.
int main() {
  const auto covariance = tfdude::Covariance::from_stddev({0.3, 0, 0, 0, 0, 0});
  const auto pose = tfdude::Pose::create(Eigen::Quaterniond::Identity(), {1, 0, 0});
  if (!covariance || !pose) return EXIT_FAILURE;

  const tfdude::Transform X_AB{*pose, *covariance};
  const tfdude::Transform X_AC = tfdude::compose(X_AB, X_AB);
  const double x = X_AC.pose.translation().x();
  const double variance = X_AC.covariance.upper()[0];
  std::printf("x = %g m, variance = %g m2\n", x, variance);
  const bool right = x == 2.0 && variance > 0.1799 && variance < 0.1801;
  return right ? EXIT_SUCCESS : EXIT_FAILURE;
}
