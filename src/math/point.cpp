#include "tfdude/math/point.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "math/square_root.hpp"

// With a square root of Σ, ξ = Σi li zi for independent zi of variance one, and Exp(ξ) p is a
// polynomial in z: the coefficients of its powers, applied to p, give all moments.
namespace tfdude {
namespace {

using Matrix3d = Eigen::Matrix3d;
using Matrix4d = Eigen::Matrix4d;
using Vector4d = Eigen::Vector4d;

// li^, the columns of the square root as elements of se(3).
struct Generators {
  Matrix4d l[6];
  Matrix4d squares;  // Σi (li^)²
};

Generators generators_of(const Covariance& sigma) {
  const Loading root = root_of(sigma.matrix());
  Generators all;
  all.squares.setZero();
  for (int i = 0; i < 6; ++i) {
    const Twist l = i < root.cols() ? Twist(root.col(i)) : Twist(Twist::Zero());
    all.l[i].setZero();
    all.l[i].topLeftCorner<3, 3>() = skew(l.tail<3>());
    all.l[i].topRightCorner<3, 1>() = l.head<3>();
    all.squares += all.l[i] * all.l[i];
  }
  return all;
}

Vector4d homogeneous(const Point& p) {
  Vector4d h;
  h << p.coordinates, p.direction ? 0.0 : 1.0;
  return h;
}

// The parts of X̄ Exp(ξ) p about X̄ p, in A.
struct Expansion {
  Eigen::Vector3d bias;               // the mean
  Eigen::Matrix<double, 3, 6> odd;    // of zi: first and third powers
  Eigen::Matrix<double, 3, 36> even;  // of zi zj, symmetric in i and j; not to second order
};

// Third powers enter by E[z_i z_j z_k z_l], which pairs three factors with the one of the first
// power: the sum over the three pairings.
Expansion expand(const Matrix3d& R, const Generators& generators, const Point& point, Order order) {
  const auto& l = generators.l;
  const Vector4d p = homogeneous(point);
  Expansion e;
  const Matrix4d& squares = generators.squares;
  Vector4d mean = 0.5 * squares * p;
  for (int i = 0; i < 6; ++i) {
    Vector4d odd = l[i] * p;
    if (order == Order::kFourth) {
      Matrix4d between = Matrix4d::Zero();
      for (int j = 0; j < 6; ++j) {
        between += l[j] * l[i] * l[j];
        e.even.col(6 * i + j) = 0.5 * R * ((l[i] * l[j] + l[j] * l[i]) * p).head<3>();
      }
      odd += (l[i] * squares + between + squares * l[i]) * p / 6;
      mean += (l[i] * squares * l[i] + l[i] * between + squares * l[i] * l[i]) * p / 24;
    }
    e.odd.col(i) = R * odd.head<3>();
  }
  e.bias = R * mean.head<3>();
  return e;
}

Matrix3d cross_covariance(const Expansion& p, const Expansion& q, Order order) {
  Matrix3d sum = p.odd * q.odd.transpose();
  if (order == Order::kFourth) sum += 0.5 * p.even * q.even.transpose();
  return sum;
}

// Of the point's own error δ: E[Exp(θ) δ δᵀ Exp(θ)ᵀ].
Matrix3d own_covariance(const Matrix3d& R, const Generators& l, const Matrix3d& S, Order order) {
  Matrix3d own = S;
  if (order == Order::kFourth && !S.isZero(0)) {
    Matrix3d squares = Matrix3d::Zero();
    for (const Matrix4d& li : l.l) {
      const Matrix3d turn = li.topLeftCorner<3, 3>();
      own += turn * S * turn.transpose();
      squares += 0.5 * turn * turn;
    }
    own += squares * S + S * squares.transpose();
  }
  return R * own * R.transpose();
}

}  // namespace

Result<void> check_point(const Point& p_B) {
  for (int i = 0; i < 3; ++i) {
    if (std::abs(p_B.coordinates[i]) <= kMaxTranslation) continue;
    return fail(Errc::kInvalidInput,
                "coordinate " + std::to_string(i) + " is not a number up to 1e9");
  }
  Matrix6d padded = Matrix6d::Zero();
  padded.topLeftCorner<3, 3>() = p_B.covariance;
  if (const auto checked = Covariance::from_matrix(padded); !checked) {
    return tl::unexpected(checked.error());
  }
  return {};
}

std::vector<TransformedPoint> transform(const Transform& X_AB, const std::vector<Point>& points_B,
                                        Order order) {
  const Matrix3d R = X_AB.pose.rotation().toRotationMatrix();
  const Generators l = generators_of(X_AB.covariance.of_specified());
  std::vector<TransformedPoint> points_A(points_B.size());
  for (std::size_t i = 0; i < points_B.size(); ++i) {
    const Point& p_B = points_B[i];
    TransformedPoint& p_A = points_A[i];
    const Expansion expansion = expand(R, l, p_B, order);
    p_A.coordinates = R * p_B.coordinates;
    if (!p_B.direction) p_A.coordinates += X_AB.pose.translation();
    p_A.bias = expansion.bias;
    p_A.of_specified =
        cross_covariance(expansion, expansion, order) + own_covariance(R, l, p_B.covariance, order);
    p_A.complete = X_AB.covariance.complete();
  }
  return points_A;
}

TransformedPoint transform(const Transform& X_AB, const Point& p_B, Order order) {
  return transform(X_AB, std::vector<Point>{p_B}, order).front();
}

Eigen::MatrixXd joint_covariance(const Transform& X_AB, const std::vector<Point>& points_B,
                                 Order order) {
  const Matrix3d R = X_AB.pose.rotation().toRotationMatrix();
  const Generators l = generators_of(X_AB.covariance.of_specified());
  std::vector<Expansion> expansions;
  expansions.reserve(points_B.size());
  for (const Point& p : points_B) expansions.push_back(expand(R, l, p, order));
  const auto size = static_cast<Eigen::Index>(3 * points_B.size());
  Eigen::MatrixXd joint(size, size);
  for (std::size_t i = 0; i < points_B.size(); ++i) {
    for (std::size_t j = 0; j < points_B.size(); ++j) {
      Matrix3d block = cross_covariance(expansions[i], expansions[j], order);
      if (i == j) block += own_covariance(R, l, points_B[i].covariance, order);
      joint.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) = block;
    }
  }
  return joint;
}

}  // namespace tfdude
