#pragma once

#include "tfdude/math/belief.hpp"
#include "tfdude/math/fusion.hpp"
#include "tfdude/math/pose.hpp"

#include "math/semidefinite.hpp"

namespace tfdude::testing {

/// Mean normalized squared errors of one quantity over the runs, which must lie where 99 % of all
/// such means do.
class Consistency {
 public:
  void add(const Belief& X, const Pose& truth) { add(collapse(X), truth); }
  void add(const Transform& X, const Pose& truth) {
    const Twist e = log(X.pose.inverse() * truth);
    int rank = 0;
    const Matrix6d inverse = pseudo_inverse(X.covariance.of_specified().matrix(), &rank);
    sum_ += e.dot(inverse * e);
    dimensions_ += rank;
    ++runs_;
  }
  [[nodiscard]] double mean() const { return sum_ / runs_; }
  [[nodiscard]] double low() const { return chi_squared_quantile(0.005, dimensions_) / runs_; }
  [[nodiscard]] double high() const { return chi_squared_quantile(0.995, dimensions_) / runs_; }

 private:
  double sum_ = 0;
  int dimensions_ = 0;
  int runs_ = 0;
};

}  // namespace tfdude::testing

#define CHECK_CONSISTENT(one)                                                  \
  do {                                                                         \
    INFO((one).mean() << " within " << (one).low() << " to " << (one).high()); \
    CHECK(((one).mean() > (one).low() && (one).mean() < (one).high()));        \
  } while (false)
