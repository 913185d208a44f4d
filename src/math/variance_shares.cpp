#include "math/variance_shares.hpp"

#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace tfdude {
namespace {

using RowVector6d = Eigen::Matrix<double, 1, 6>;

// The gradient by the error of each edge: ± Ad(X_CB⁻¹)ᵀ g, C the child's frame. A path that goes up
// over an edge takes its inverse, whose error is the negative one.
std::vector<RowVector6d> gradients_of(const std::vector<ObservedEdge>& edges, const Twist& g) {
  std::vector<RowVector6d> gradients(edges.size());
  Pose X_HB;  // H: the frame reached, going back from B
  for (std::size_t k = edges.size(); k-- > 0;) {
    const bool up = edges[k].way == ObservedEdge::Way::kUp;
    const Pose& X_PC = edges[k].X_PC.pose;
    if (up) X_HB = X_PC.inverse() * X_HB;  // from the parent to the child
    gradients[k] = (up ? -1.0 : 1.0) * g.transpose() * adjoint(X_HB.inverse());
    if (!up) X_HB = X_PC * X_HB;
  }
  return gradients;
}

// A source, once for what it adds and once for what observations have removed.
using Key = std::pair<std::string, bool>;
// By the deviations of the source.
using Sums = std::map<Key, Eigen::RowVectorXd>;

void add(const RowVector6d& gradient, const CommonError& error, Eigen::RowVectorXd& sum) {
  const Eigen::RowVectorXd term = gradient * error.loading;
  if (sum.size() < term.size()) {
    const Eigen::Index known = sum.size();
    sum.conservativeResize(term.size());
    sum.tail(term.size() - known).setZero();
  }
  sum.head(term.size()) += term;
}

// The covariance of the number with an edge's error, and of that error.
double after_measuring(const Belief& X_PC, const RowVector6d& gradient, const Sums& sums,
                       double total, const Eigen::Matrix<double, 6, 1>& sensor) {
  Matrix6d V = X_PC.own.matrix();
  RowVector6d c = gradient * V;
  for (const CommonError& error : X_PC.common_errors) {
    const double sign = error.subtracts ? -1 : 1;
    const Eigen::RowVectorXd& sum = sums.at({error.source, error.subtracts});
    c += sign * sum.head(error.loading.cols()) * error.loading.transpose();
    V += sign * error.loading * error.loading.transpose();
  }
  V.diagonal() += sensor;
  return total - c.dot(V.ldlt().solve(c.transpose()));
}

}  // namespace

PathFunctional worst_direction(const Transform& X_AB) {
  const Matrix6d sigma = X_AB.covariance.of_specified().matrix();
  const Eigen::Matrix3d R = X_AB.pose.rotation().toRotationMatrix();
  const Eigen::Matrix3d position = R * sigma.topLeftCorner<3, 3>() * R.transpose();
  PathFunctional functional;
  functional.is_rotation = !(position.trace() > 0);
  const Eigen::Matrix3d block =
      functional.is_rotation ? Eigen::Matrix3d(sigma.bottomRightCorner<3, 3>()) : position;
  functional.direction =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(block).eigenvectors().col(2);
  // Of the two that are opposite, the one whose largest component is positive.
  Eigen::Index largest = 0;
  functional.direction.cwiseAbs().maxCoeff(&largest);
  if (functional.direction[largest] < 0) functional.direction *= -1;
  functional.gradient.setZero();
  if (functional.is_rotation) {
    functional.gradient.tail<3>() = functional.direction;
  } else {
    functional.gradient.head<3>() = R.transpose() * functional.direction;
  }
  return functional;
}

VarianceShares variance_shares(const std::vector<ObservedEdge>& edges,
                               const PathFunctional& functional,
                               const Eigen::Matrix<double, 6, 1>& sensor) {
  const auto gradients = gradients_of(edges, functional.gradient);
  VarianceShares shares;
  Sums sums;
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const Belief& X_PC = edges[k].X_PC;
    shares.edges.push_back((gradients[k] * X_PC.own.matrix()).dot(gradients[k]));
    shares.total += shares.edges.back();
    for (const CommonError& error : X_PC.common_errors) {
      add(gradients[k], error, sums[{error.source, error.subtracts}]);
    }
  }
  for (const auto& [key, sum] : sums) {
    const double variance = (key.second ? -1 : 1) * sum.squaredNorm();
    shares.sources[key.first] += variance;
    shares.total += variance;
  }
  for (std::size_t k = 0; k < edges.size(); ++k) {
    shares.after.push_back(
        after_measuring(edges[k].X_PC, gradients[k], sums, shares.total, sensor));
  }
  return shares;
}

}  // namespace tfdude
