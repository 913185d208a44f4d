#include "math/random_walk.hpp"

#include <array>
#include <cstddef>

#include "math/columns.hpp"
#include "math/semidefinite.hpp"

namespace tfdude {
namespace {

// The integral by Gauss and Legendre, with positive weights: the sum is a covariance. Of a straight
// motion the integrand is of second degree in a, so that two points are exact.
struct Point {
  double at;
  double weight;
};
constexpr std::array<Point, 2> kTwo{{{0.21132486540518713, 0.5}, {0.78867513459481287, 0.5}}};
constexpr std::array<Point, 3> kThree{
    {{0.11270166537925831, 5.0 / 18.0}, {0.5, 8.0 / 18.0}, {0.88729833462074169, 5.0 / 18.0}}};
constexpr std::array<Point, 4> kFour{{{0.06943184420297371, 0.17392742256872693},
                                      {0.33000947820757187, 0.32607257743127307},
                                      {0.66999052179242813, 0.32607257743127307},
                                      {0.93056815579702629, 0.17392742256872693}}};

// Up to these squared angles [rad²] two, three and four points miss less than 1e-7 of the variance
// along each axis that has at least 1e-9 of the largest one of its unit.
constexpr double kStraight = 1e-16;
constexpr double kLittle = 0.01 * 0.01;
constexpr double kMost = 0.2 * 0.2;
constexpr int kMostHalved = 5;

double series(double x, const std::array<double, 4>& terms) {
  return terms[0] + x * (terms[1] + x * (terms[2] + x * terms[3]));
}

// Exp(-a ξ), by power series for angles up to kMost: exact to 1e-12.
kernel::Columns moved_back(const Twist& xi, double angle2, double a) {
  const double a2 = a * a;
  const double x = a2 * angle2;
  const double b = a * series(x, {1.0, -1.0 / 6, 1.0 / 120, -1.0 / 5040});  // sin(aθ)/θ
  const double c = a2 * series(x, {1.0 / 2, -1.0 / 24, 1.0 / 720, -1.0 / 40320});
  const double d = a * a2 * series(x, {1.0 / 6, -1.0 / 120, 1.0 / 5040, -1.0 / 362880});
  const Eigen::Vector3d rho = xi.head<3>();
  const Eigen::Vector3d theta = xi.tail<3>();
  kernel::Columns X{};
  for (int k = 0; k < 3; ++k) {
    for (int i = 0; i < 3; ++i) X.R[k][i] = c * theta[i] * theta[k];
    X.R[k][k] += 1.0 - c * angle2;
    const int next = (k + 1) % 3;
    const int last = (k + 2) % 3;
    X.R[k][next] -= b * theta[last];
    X.R[k][last] += b * theta[next];
  }
  const Eigen::Vector3d t =
      (d * angle2 - a) * rho + c * theta.cross(rho) - d * theta.dot(rho) * theta;
  for (int i = 0; i < 3; ++i) X.t[i] = t[i];
  return X;
}

template <std::size_t N>
void mean_of(const std::array<Point, N>& points, const Twist& xi, double angle2,
             const Covariance& Q, double* mean) {
  std::array<kernel::Weighted, N> all;
  for (std::size_t k = 0; k < N; ++k) {
    all[k] = {moved_back(xi, angle2, points[k].at), points[k].weight};
  }
  kernel::functions().transport_sum(all.data(), N, Q.upper().data(), mean);
}

}  // namespace

Covariance walked(const Covariance& density, const Pose& increment, double seconds) {
  Covariance::Upper mean = density.upper();
  if (const Twist xi = log(increment); !xi.isZero(0)) {
    Twist part = xi;
    double angle2 = xi.tail<3>().squaredNorm();
    int halvings = 0;
    for (; angle2 > kMost && halvings < kMostHalved; ++halvings) {
      part *= 0.5;
      angle2 *= 0.25;
    }
    if (angle2 <= kStraight) {
      mean_of(kTwo, part, angle2, density, mean.data());
    } else if (angle2 <= kLittle) {
      mean_of(kThree, part, angle2, density, mean.data());
    } else {
      mean_of(kFour, part, angle2, density, mean.data());
    }
    // The second half adds as much as the first one, which it moves along.
    for (; halvings > 0; --halvings) {
      Covariance::Upper first;
      kernel::functions().transport(kernel::columns_of(exp(-part)), mean.data(), first.data());
      for (std::size_t i = 0; i < mean.size(); ++i) mean[i] = 0.5 * (mean[i] + first[i]);
      part *= 2.0;
    }
  }
  for (double& one : mean) one *= seconds;
  return Covariance::trusted(mean);
}

// The rest is a sum of two covariances, as a difference would have rounding errors below zero.
Bridge bridged(const Matrix6d& until, const Matrix6d& F, const Matrix6d& since) {
  const Matrix6d with_later = until * F.transpose();
  const Matrix6d K = with_later * pseudo_inverse(F * with_later + since);
  const Matrix6d left = Matrix6d::Identity() - K * F;
  return {K, left * until * left.transpose() + K * since * K.transpose()};
}

}  // namespace tfdude
