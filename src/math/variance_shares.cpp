#include "math/variance_shares.hpp"

#include <algorithm>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "math/common_errors.hpp"
#include "math/drift.hpp"

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

// The covariance of the errors of two edges.
Matrix6d between(const std::vector<ObservedEdge>& edges, std::size_t j, std::size_t k) {
  Matrix6d P = j == k ? edges[k].X_PC.own.matrix() : Matrix6d::Zero();
  for (const CommonError& one : edges[j].X_PC.common_errors) {
    const CommonError* other = of_same_source(edges[k].X_PC.common_errors, one);
    if (other == nullptr) continue;
    const Eigen::Index columns = std::min(one.loading.cols(), other->loading.cols());
    P += (one.subtracts ? -1 : 1) * one.loading.leftCols(columns) *
         other->loading.leftCols(columns).transpose();
  }
  return P;
}

// The edges that an observation of this one corrects: itself, and those that observations have tied
// to it, or to one of these.
std::vector<std::size_t> corrected_with(const std::vector<ObservedEdge>& edges, std::size_t edge) {
  const auto are_tied = [&](std::size_t j, std::size_t k) {
    const auto& errors = edges[k].X_PC.common_errors;
    return std::any_of(errors.begin(), errors.end(), [&](const CommonError& one) {
      const CommonError* other = of_same_source(edges[j].X_PC.common_errors, one);
      return ties(one) && other != nullptr && ties(*other);
    });
  };
  std::vector<std::size_t> all{edge};
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t j = 0; j < edges.size(); ++j) {
      const bool known = std::find(all.begin(), all.end(), j) != all.end();
      if (!known && are_tied(j, all[i])) all.push_back(j);
    }
  }
  return all;
}

// The variance of the number, after those edges are corrected.
double after_measuring(const std::vector<ObservedEdge>& edges, std::size_t edge,
                       const std::vector<RowVector6d>& gradients, double total,
                       const Eigen::Matrix<double, 6, 1>& sensor) {
  RowVector6d c = RowVector6d::Zero();  // of the number with the edge's error
  for (std::size_t j = 0; j < edges.size(); ++j) c += gradients[j] * between(edges, j, edge);
  RowVector6d d = RowVector6d::Zero();  // what is used of it
  for (const std::size_t j : corrected_with(edges, edge)) {
    d += gradients[j] * between(edges, j, edge);
  }
  Matrix6d S = between(edges, edge, edge);
  S.diagonal() += sensor;
  const RowVector6d gain = S.ldlt().solve(d.transpose()).transpose();
  return total - 2 * gain.dot(c) + gain.dot(d);
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
    shares.after.push_back(after_measuring(edges, k, gradients, shares.total, sensor));
  }
  return shares;
}

}  // namespace tfdude
