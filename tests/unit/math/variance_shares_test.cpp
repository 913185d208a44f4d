// The parts of a path's variance, beside dense matrices.

#include "math/variance_shares.hpp"

#include <vector>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::Random;

// The error of X_AB by that of each edge, by differences: the adjoints are not used.
Eigen::MatrixXd jacobian(const std::vector<ObservedEdge>& edges) {
  const auto X_AB = [&](std::size_t disturbed, const Twist& xi) {
    Pose X;
    for (std::size_t k = 0; k < edges.size(); ++k) {
      Pose X_PC = edges[k].X_PC.pose;
      if (k == disturbed) X_PC = X_PC * tfdude::exp(xi);
      X = X * (edges[k].way == ObservedEdge::Way::kUp ? X_PC.inverse() : X_PC);
    }
    return X;
  };
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd J(6, 6 * static_cast<Eigen::Index>(edges.size()));
  const Pose mean = X_AB(edges.size(), Twist::Zero());
  for (std::size_t k = 0; k < edges.size(); ++k) {
    for (int i = 0; i < 6; ++i) {
      const Twist step = Twist::Unit(i) * kStep;
      const Twist forth = tfdude::log(mean.inverse() * X_AB(k, step));
      const Twist back = tfdude::log(mean.inverse() * X_AB(k, -step));
      J.col(6 * static_cast<Eigen::Index>(k) + i) = (forth - back) / (2 * kStep);
    }
  }
  return J;
}

// The joint covariance of all errors: own parts, and the loadings of the sources.
Eigen::MatrixXd joint(const std::vector<ObservedEdge>& edges) {
  const auto size = 6 * static_cast<Eigen::Index>(edges.size());
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(size, size);
  for (const std::string source : {"s", "t", "observed:1", "observed:2"}) {
    for (const bool subtracts : {false, true}) {
      Eigen::MatrixXd F = Eigen::MatrixXd::Zero(size, 3);
      for (std::size_t k = 0; k < edges.size(); ++k) {
        for (const CommonError& error : edges[k].X_PC.common_errors) {
          if (error.source != source || error.subtracts != subtracts) continue;
          F.block(6 * static_cast<Eigen::Index>(k), 0, 6, error.loading.cols()) = error.loading;
        }
      }
      P += (subtracts ? -1 : 1) * F * F.transpose();
    }
  }
  for (std::size_t k = 0; k < edges.size(); ++k) {
    const auto at = 6 * static_cast<Eigen::Index>(k);
    P.block<6, 6>(at, at) += edges[k].X_PC.own.matrix();
  }
  return P;
}

bool are_tied(const ObservedEdge& one, const ObservedEdge& other) {
  for (const CommonError& a : one.X_PC.common_errors) {
    for (const CommonError& b : other.X_PC.common_errors) {
      const bool observed = a.source == "observed:1" || a.source == "observed:2";
      if (observed && a.source == b.source && a.subtracts == b.subtracts) return true;
    }
  }
  return false;
}

// As observe() corrects: the edge, and those that are tied to it, also over others.
std::vector<bool> corrected_with(const std::vector<ObservedEdge>& edges, std::size_t edge) {
  std::vector<bool> all(edges.size());
  all[edge] = true;
  for (std::size_t round = 0; round < edges.size(); ++round) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
      for (std::size_t j = 0; j < edges.size(); ++j) {
        if (all[i] && are_tied(edges[i], edges[j])) all[j] = true;
      }
    }
  }
  return all;
}

}  // namespace

TEST_CASE("variance shares: they add up to the variance, and observations are those of a filter") {
  Random random(4612);
  INFO("seed " << random.seed());
  for (int run = 0; run < 20; ++run) {
    std::vector<ObservedEdge> edges(1 + random.index(6));
    for (ObservedEdge& edge : edges) {
      edge.X_PC.pose = random.pose();
      edge.X_PC.own = random.covariance(0.1, 0.1);
      edge.way = random.index(2) == 0 ? ObservedEdge::Way::kUp : ObservedEdge::Way::kDown;
      for (const std::string source : {"s", "t", "observed:1", "observed:2"}) {
        if (random.index(2) == 0) continue;
        Loading loading = Loading::Random(6, 1 + static_cast<Eigen::Index>(random.index(3))) * 0.1;
        edge.X_PC.common_errors.push_back({source, false, loading});
        if (random.index(3) == 0) {
          edge.X_PC.common_errors.push_back({source, true, loading * 0.3});
        }
      }
    }
    const Eigen::MatrixXd P = joint(edges);
    const Eigen::MatrixXd J = jacobian(edges);
    const Matrix6d sigma = J * P * J.transpose();
    Pose mean;
    for (const ObservedEdge& edge : edges) {
      const Pose& X = edge.X_PC.pose;
      mean = mean * (edge.way == ObservedEdge::Way::kUp ? X.inverse() : X);
    }
    const PathFunctional worst = worst_direction({mean, Covariance::trusted(sigma)});
    CHECK_FALSE(worst.is_rotation);
    // No direction is less certain.
    const Eigen::Matrix3d R = mean.rotation().toRotationMatrix();
    const Eigen::Matrix3d position = R * sigma.topLeftCorner<3, 3>() * R.transpose();
    const double largest = worst.direction.dot(position * worst.direction);
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d other = random.direction();
      CHECK(other.dot(position * other) <= largest * (1 + 1e-9));
    }
    const Eigen::Matrix<double, 6, 1> sensor =
        Eigen::Matrix<double, 6, 1>::Constant(random.uniform(1e-6, 1e-2));
    const VarianceShares shares = variance_shares(edges, worst, sensor);
    CHECK(std::abs(shares.total - largest) < 1e-6 * largest);
    double sum = 0;
    for (const double one : shares.edges) sum += one;
    for (const auto& [name, one] : shares.sources) sum += one;
    CHECK(std::abs(sum - shares.total) < 1e-12 * shares.total);
    for (std::size_t k = 0; k < edges.size(); ++k) {
      const auto at = 6 * static_cast<Eigen::Index>(k);
      Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6, P.cols());
      H.middleCols<6>(at).setIdentity();
      Matrix6d S = H * P * H.transpose();
      S.diagonal() += sensor;
      Eigen::MatrixXd K = P * H.transpose() * S.inverse();
      const std::vector<bool> corrected = corrected_with(edges, k);
      for (std::size_t i = 0; i < edges.size(); ++i) {
        if (!corrected[i]) K.middleRows<6>(6 * static_cast<Eigen::Index>(i)).setZero();
      }
      const Eigen::MatrixXd left = Eigen::MatrixXd::Identity(P.rows(), P.cols()) - K * H;
      const Eigen::MatrixXd after =
          left * P * left.transpose() + K * sensor.asDiagonal() * K.transpose();
      const double expected = worst.gradient.dot(J * after * J.transpose() * worst.gradient);
      CHECK(std::abs(shares.after[k] - expected) < 1e-6 * largest);
    }
  }
}

TEST_CASE("variance shares: where the position is exact, the direction is that of a rotation") {
  const Transform X{Pose(), *Covariance::from_stddev({0, 0, 0, 1e-3, 3e-3, 2e-3})};
  const PathFunctional worst = worst_direction(X);
  CHECK(worst.is_rotation);
  CHECK((worst.direction - Eigen::Vector3d::UnitY()).norm() < 1e-12);
  const VarianceShares shares = variance_shares(
      {{{X.pose, X.covariance.of_specified(), {}, {}, false}, ObservedEdge::Way::kUp}}, worst,
      Eigen::Matrix<double, 6, 1>::Constant(9e-6));
  CHECK(std::abs(shares.total - 9e-6) < 1e-18);
  CHECK(std::abs(shares.after[0] - 4.5e-6) < 1e-18);
}

}  // namespace tfdude
