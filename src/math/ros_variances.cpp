#include "tfdude/math/ros_variances.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tfdude/math/perturbation.hpp"

namespace tfdude::ros {
namespace {

using RowMajor = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;

// What a variance says.
enum class Says : std::uint8_t { kNothing, kZero, kItself };

Says meaning(const Variances& variances, int axis, double variance) {
  const double most = axis < 3 ? kNoPosition : kNoAngle;
  if (variance == -1 || variance >= std::min(most, variances.none_from.value_or(most))) {
    return Says::kNothing;
  }
  if (variance != 0) return Says::kItself;
  return variances.zero_is_none && !variances.stddev ? Says::kNothing : Says::kZero;
}

// Replaces the variances that are no numbers, and the covariances with their axes.
Matrix6d spelled_out(const Variances& variances, const Pose& X, const Matrix6d& numbers) {
  Matrix6d sigma = numbers;
  for (int axis = 0; axis < 6; ++axis) {
    const Says says = meaning(variances, axis, numbers(axis, axis));
    if (says == Says::kItself || (says == Says::kZero && !variances.stddev)) continue;
    sigma.row(axis).setZero();
    sigma.col(axis).setZero();
    if (says == Says::kNothing) {
      sigma(axis, axis) = axis < 3 ? kNoPosition : kNoAngle;
    } else {
      const double stddev = stddev_at(*variances.stddev, X)[static_cast<std::size_t>(axis)];
      sigma(axis, axis) = stddev * stddev;
    }
  }
  return sigma;
}

}  // namespace

std::array<double, 6> stddev_at(const StddevModel& model, const Pose& X) {
  const Eigen::Vector3d p = X.translation();
  const double distance = p.norm();
  const Eigen::Vector3d z = X.rotation() * Eigen::Vector3d::UnitZ();
  const double cosine = distance > 0 ? std::abs(z.dot(p)) / distance : 1.0;
  const double angle = std::acos(std::min(cosine, 1.0));
  std::array<double, 6> stddev = model.constant;
  for (std::size_t i = 0; i < stddev.size(); ++i) {
    stddev[i] += distance * model.per_metre[i] + angle * model.per_radian[i];
  }
  return stddev;
}

Result<Transform> with_ros_covariance(const Pose& X, const Variances& variances,
                                      const std::array<double, 36>& numbers) {
  const bool all_zero =
      std::all_of(numbers.begin(), numbers.end(), [](double one) { return one == 0; });
  const bool is_unknown = numbers[0] == -1 && !variances.minus_one_is_none;
  const bool is_exact = all_zero && variances.all_zero_is_exact;
  if (is_unknown || (all_zero && !variances.stddev && !is_exact)) return Transform{X, {}};
  if (is_exact && !variances.stddev) return Transform{X, StatedCovariance::exact()};
  const Matrix6d given = Eigen::Map<const RowMajor>(numbers.data());
  const auto ros = Covariance::from_matrix(spelled_out(variances, X, given));
  if (!ros) return tl::unexpected(ros.error());
  return from_ros_covariance(X, *ros);
}

}  // namespace tfdude::ros
