#include "tfdude/math/interpolate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "math/columns.hpp"
#include "math/interpolate_far.hpp"
#include "math/small_angle.hpp"

namespace tfdude {
namespace {

// The series omit terms of the fourth power of the larger of θ and s θ [rad]; the closed forms lose
// digits in proportion to its inverse. At this threshold both are exact to 1e-12.
constexpr double kSmallAngle = 1e-3;

// (1 - exp(-i s θ)) / s, without a difference of nearly equal numbers; i θ at s = 0.
std::complex<double> turned(double s, double angle) {
  const double half = 0.5 * s * angle;
  const double sinc = half == 0 ? 1.0 : std::sin(half) / half;
  return std::complex<double>(0.0, angle * sinc) * std::polar(1.0, -half);
}

// g(x) = (1 - exp(-s x)) / (s (1 - exp(-x))) at x = ad(ξ) is Jr(s ξ) Jr⁻¹(ξ), computed as a
// polynomial. The eigenvalues of ad(ξ) are 0, once in a block, and ±iθ, twice each. So g equals the
// polynomial of fourth degree that agrees with it there, at ±iθ with its derivative (Higham,
// Functions of Matrices, definition 1.4).
std::array<double, 4> coefficients(double s, double angle) {
  if (std::max(std::abs(s), 1.0) * angle < kSmallAngle) return small_angle_coefficients(s);
  using Complex = std::complex<double>;
  const Complex down = std::polar(1.0, -angle);
  const Complex D = turned(1.0, angle);
  const Complex N = turned(s, angle);
  const Complex dN = std::polar(1.0, -s * angle);
  const Complex g = N / D;
  const Complex dg = (dN * D - N * down) / (D * D);
  const double angle2 = angle * angle;
  const double c3 = (g.imag() / angle - dg.real()) / (2.0 * angle2);
  const double c4 = -((g.real() - 1.0) + 0.5 * dg.imag() * angle) / (angle2 * angle2);
  return {g.imag() / angle + c3 * angle2, 0.5 * dg.imag() / angle + 2.0 * c4 * angle2, c3, c4};
}

// [M, N; 0, M], the form of every function of ad(ξ).
struct Blocks {
  Eigen::Matrix3d M;
  Eigen::Matrix3d N;
};

Blocks operator*(const Blocks& a, const Blocks& b) { return {a.M * b.M, a.M * b.N + a.N * b.M}; }

// weight · B Σ Bᵀ with B = Jr(s ξ) Jr⁻¹(ξ).
Matrix6d carried(const Covariance& sigma, const Twist& xi, double s, double weight) {
  const auto c = coefficients(s, xi.tail<3>().norm());
  const Blocks ad{skew(xi.tail<3>()), skew(xi.head<3>())};
  const Blocks ad2 = ad * ad;
  const Blocks ad3 = ad2 * ad;
  const Blocks ad4 = ad2 * ad2;
  Matrix6d B = Matrix6d::Zero();
  B.topLeftCorner<3, 3>() =
      Eigen::Matrix3d::Identity() + c[0] * ad.M + c[1] * ad2.M + c[2] * ad3.M + c[3] * ad4.M;
  B.topRightCorner<3, 3>() = c[0] * ad.N + c[1] * ad2.N + c[2] * ad3.N + c[3] * ad4.N;
  B.bottomRightCorner<3, 3>() = B.topLeftCorner<3, 3>();
  return weight * (B * sigma.matrix() * B.transpose());
}

// Both with the covariance of the one that is not complete.
struct Alike {
  Transform X0;
  Transform X1;
};
Alike alike(const Transform& X0, const Transform& X1) {
  const StatedCovariance& covariance = X0.covariance.complete() ? X1.covariance : X0.covariance;
  return {{X0.pose, covariance}, {X1.pose, covariance}};
}

}  // namespace

void interpolate(const Transform& X0, const Transform& X1, double s, Transform& X) {
  if (X0.covariance.complete() != X1.covariance.complete()) {
    const Alike both = alike(X0, X1);
    return interpolate(both.X0, both.X1, s, X);
  }
  kernel::Edge edge{};
  kernel::Blend one{kernel::edge_of(X0), kernel::edge_of(X1), s, kernel::numbers_of(X), &edge};
  kernel::Blend* const all[] = {&one};
  kernel::functions().blend_with_covariance(all, 1);
  if (!one.near) return interpolate_far(X0, X1, s, X);
  if (edge.upper == one.X0.upper) {
    X.covariance = X0.covariance;
  } else {
    X.covariance.set_complete(X0.covariance.complete());
  }
}

void interpolate_far(const Transform& X0, const Transform& X1, double s, Transform& X) {
  const Twist xi = log(X0.pose.inverse() * X1.pose);
  const Matrix6d sigma = carried(X0.covariance.of_specified(), -xi, 1.0 - s, 1.0 - s) +
                         carried(X1.covariance.of_specified(), xi, s, s);
  X = {X0.pose * exp(s * xi), Covariance::trusted(sigma)};
  X.covariance.set_complete(X0.covariance.complete());
}

void interpolate(const Pose& X0, const Pose& X1, double s, Pose& X) {
  kernel::Edge edge{};
  kernel::Blend one{kernel::edge_of(X0), kernel::edge_of(X1), s, kernel::numbers_of(X), &edge};
  kernel::Blend* const all[] = {&one};
  kernel::functions().blend_poses(all, 1);
  if (!one.near) interpolate_far(X0, X1, s, X);
}

void interpolate_far(const Pose& X0, const Pose& X1, double s, Pose& X) {
  X = X0 * exp(s * log(X0.inverse() * X1));
}

Transform interpolate(const Transform& X0, const Transform& X1, double s) {
  Transform X;
  interpolate(X0, X1, s, X);
  return X;
}

Pose extrapolate(const Pose& X0, const Pose& X1, double s) {
  return X0 * exp(s * log(X0.inverse() * X1));
}

Transform extrapolate(const Transform& X0, const Transform& X1, double s) {
  if (X0.covariance.complete() != X1.covariance.complete()) {
    const Alike both = alike(X0, X1);
    return extrapolate(both.X0, both.X1, s);
  }
  const Twist xi = log(X0.pose.inverse() * X1.pose);
  const double beyond = s - 1.0;
  const Matrix6d sigma =
      carried(X0.covariance.of_specified(), -xi, -beyond, beyond * (s + beyond)) +
      carried(X1.covariance.of_specified(), xi, s, s * (s + beyond));
  Transform X{X0.pose * exp(s * xi), Covariance::trusted(sigma)};
  X.covariance.set_complete(X0.covariance.complete());
  return X;
}

}  // namespace tfdude
