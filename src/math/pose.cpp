#include "tfdude/math/pose.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "tfdude/base/number.hpp"

namespace tfdude {
namespace {

// Below this squared angle the closed forms lose digits to cancellation. Two terms of the series
// are then exact to rounding, unless noted otherwise: the next has a relative size of θ⁴/360 or
// less.
constexpr double kSmallAngleSquared = 1e-6;

constexpr double kQuaternionTolerance = 1e-3;

// Describes an invalid pose. Separate, so that valid poses do not pay for the text.
tl::unexpected<Error> what_is_wrong(const Eigen::Quaterniond& rotation,
                                    const Eigen::Vector3d& translation) {
  constexpr const char* kAxes[] = {"x", "y", "z", "w"};
  for (int i = 0; i < 4; ++i) {
    if (!std::isfinite(rotation.coeffs()[i])) {
      return fail(Errc::kInvalidInput,
                  std::string("rotation.") + kAxes[i] + " is not a finite number");
    }
  }
  for (int i = 0; i < 3; ++i) {
    const std::string field = std::string("translation.") + kAxes[i];
    if (!std::isfinite(translation[i])) {
      return fail(Errc::kInvalidInput, field + " is not a finite number");
    }
    if (std::abs(translation[i]) > kMaxTranslation) {
      return fail(Errc::kInvalidInput, field + " is beyond 1e9 m");
    }
  }
  return fail(Errc::kInvalidInput, "rotation has the norm " +
                                       number_text(rotation.coeffs().stableNorm()) +
                                       ", not that of a unit quaternion");
}

}  // namespace

Result<Pose> Pose::create(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
  const double norm = rotation.norm();
  // Also false for NaN.
  const bool good = std::abs(norm - 1.0) <= kQuaternionTolerance &&
                    translation.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= kMaxTranslation;
  if (!good) return what_is_wrong(rotation, translation);
  return trusted(Eigen::Quaterniond(rotation.coeffs() / norm), translation);
}

Result<Pose> Pose::from_matrix(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d R = matrix.topLeftCorner<3, 3>();
  constexpr double kTolerance = 1e-6;
  // Also true for NaN.
  if (!((R * R.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance) ||
      !(R.determinant() > 0)) {
    return fail(Errc::kInvalidInput, "matrix: the upper left 3x3 is not a rotation");
  }
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
    return fail(Errc::kInvalidInput, "matrix: the last row must be 0 0 0 1");
  }
  return create(Eigen::Quaterniond(R).normalized(), matrix.topRightCorner<3, 1>());
}

Pose Pose::trusted(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
  Pose X;
  Eigen::Map<Eigen::Vector4d>(X.q_) = rotation.coeffs();
  Eigen::Map<Eigen::Vector3d>(X.p_) = translation;
  return X;
}

Eigen::Matrix4d Pose::matrix() const {
  Eigen::Matrix4d M = Eigen::Matrix4d::Identity();
  M.topLeftCorner<3, 3>() = rotation().toRotationMatrix();
  M.topRightCorner<3, 1>() = translation();
  return M;
}

Pose Pose::inverse() const {
  const Eigen::Quaterniond q_BA = rotation().conjugate();
  return trusted(q_BA, -(q_BA * translation()));
}

Pose operator*(const Pose& X_AB, const Pose& X_BC) {
  const Eigen::Quaterniond q_AB = X_AB.rotation();
  return Pose::trusted((q_AB * X_BC.rotation()).normalized(),
                       q_AB * X_BC.translation() + X_AB.translation());
}

Pose exp(const Twist& xi) {
  const Eigen::Vector3d rho = xi.head<3>();
  const Eigen::Vector3d theta = xi.tail<3>();
  const double angle2 = theta.squaredNorm();
  const double angle = std::sqrt(angle2);
  double half_sinc = 0;  // sin(θ/2)/θ
  double b = 0;          // (1 - cos θ)/θ²
  double c = 0;          // (θ - sin θ)/θ³
  if (angle2 < kSmallAngleSquared) {
    half_sinc = 0.5 - angle2 / 48.0;
    b = 0.5 - angle2 / 24.0;
    c = 1.0 / 6.0 - angle2 / 120.0;
  } else {
    const double s = std::sin(0.5 * angle);
    half_sinc = s / angle;
    b = 2.0 * s * s / angle2;
    c = (angle - std::sin(angle)) / (angle2 * angle);
  }
  const Eigen::Vector3d vector = half_sinc * theta;
  const Eigen::Quaterniond q(std::cos(0.5 * angle), vector.x(), vector.y(), vector.z());
  const Eigen::Vector3d cross = theta.cross(rho);
  return Pose::trusted(q.normalized(), rho + b * cross + c * theta.cross(cross));
}

Twist log(const Pose& X) {
  Eigen::Quaterniond q = X.rotation();
  if (q.w() < 0) q.coeffs() = -q.coeffs();  // the shorter rotation
  const double s = q.vec().norm();          // sin(θ/2)
  const double angle = 2.0 * std::atan2(s, q.w());
  const double angle2 = angle * angle;
  const bool small = angle2 < kSmallAngleSquared;
  // θ = 2 atan2(s, w) · vec/s; for small s, 2/w · (1 - r/3 + r²/5) · vec with r = s²/w². This
  // series converges slowly: without its third term the angle would keep 14 digits only.
  const double r = s * s / (q.w() * q.w());
  const double scale = small ? 2.0 / q.w() * (1.0 - r / 3.0 + r * r / 5.0) : angle / s;
  const Eigen::Vector3d theta = scale * q.vec();
  // (1 - (θ/2) cot(θ/2)) / θ²
  const double d = small ? 1.0 / 12.0 + angle2 / 720.0 : (1.0 - 0.5 * angle * q.w() / s) / angle2;
  const Eigen::Vector3d t = X.translation();
  const Eigen::Vector3d cross = theta.cross(t);
  Twist xi;
  xi << t - 0.5 * cross + d * theta.cross(cross), theta;
  return xi;
}

Matrix6d adjoint(const Pose& X) {
  const Eigen::Matrix3d R = X.rotation().toRotationMatrix();
  Matrix6d Ad = Matrix6d::Zero();
  Ad.topLeftCorner<3, 3>() = R;
  Ad.topRightCorner<3, 3>() = skew(X.translation()) * R;
  Ad.bottomRightCorner<3, 3>() = R;
  return Ad;
}

Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d S;
  S << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return S;
}

Eigen::Quaterniond from_rpy(double roll, double pitch, double yaw) {
  using Eigen::AngleAxisd;
  using Eigen::Vector3d;
  return AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) *
         AngleAxisd(roll, Vector3d::UnitX());
}

Eigen::Vector3d to_rpy(const Eigen::Quaterniond& rotation) {
  constexpr double kGimbalLock = 1e-12;
  const Eigen::Matrix3d R = rotation.toRotationMatrix();
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  const double pitch = std::atan2(-R(2, 0), cos_pitch);
  if (cos_pitch < kGimbalLock) return {0.0, pitch, std::atan2(-R(0, 1), R(1, 1))};
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  // Roll from Rz(-yaw) R, the rotation without the yaw. Near gimbal lock its error then compensates
  // that of the yaw; atan2(R(2, 1), R(2, 2)) would add another one.
  const double c = std::cos(yaw);
  const double s = std::sin(yaw);
  const double roll = std::atan2(s * R(0, 2) - c * R(1, 2), c * R(1, 1) - s * R(0, 1));
  return {roll, pitch, yaw};
}

}  // namespace tfdude
