#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/math/observation.hpp"
#include "tfdude/math/perturbation.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

// One base that drifts sees many objects, each from another place. So their errors have nearly as
// many columns in common as rows. All is beside a dense Kalman filter of the same joint covariance.
namespace tfdude {
namespace {

using testing::Random;

constexpr auto kUp = ObservedEdge::Way::kUp;
constexpr auto kDown = ObservedEdge::Way::kDown;
constexpr auto kBeside = ObservedEdge::Way::kBeside;

Eigen::Index row(std::size_t edge) { return 6 * static_cast<Eigen::Index>(edge); }

Matrix6d diagonal(double metres, double radians) {
  Twist sigma;
  sigma << Eigen::Vector3d::Constant(metres), Eigen::Vector3d::Constant(radians);
  return sigma.cwiseAbs2().asDiagonal();
}

// world -> base drifts, world -> objects stand. Each sighting is what was expected, so that poses
// stay and only covariances change.
class Drifting {
 public:
  explicit Drifting(std::size_t objects, Random& random) {
    edges_.push_back({{random.pose(), Covariance::trusted(kStart), std::nullopt, {}}});
    for (std::size_t i = 0; i < objects; ++i) {
      edges_.push_back({{random.pose(), {}, std::nullopt, {}}});
      edges_.back().X_PC.unspecified = true;
    }
    P_ = Eigen::MatrixXd::Zero(row(edges_.size()), row(edges_.size()));
    P_.topLeftCorner<6, 6>() = kStart;
  }

  [[nodiscard]] std::size_t objects() const { return edges_.size() - 1; }
  [[nodiscard]] const Belief& edge(std::size_t i) const { return edges_[i].X_PC; }

  void drive(const Pose& way) {
    Belief& base = edges_[0].X_PC;
    const Matrix6d to_there = adjoint(way.inverse());
    base.pose = base.pose * way;
    base.own =
        Covariance::trusted(Matrix6d(to_there * base.own.matrix() * to_there.transpose() + kDrift));
    for (CommonError& one : base.common_errors) one.loading = (to_there * one.loading).eval();
    P_.topRows<6>() = (to_there * P_.topRows<6>()).eval();
    P_.leftCols<6>() = (P_.leftCols<6>() * to_there.transpose()).eval();
    P_.topLeftCorner<6, 6>() += kDrift;
  }

  // The number of edges that were forgotten.
  std::size_t see(std::size_t object) {
    const bool fresh = edges_[object].X_PC.unspecified;
    const Pose Z = edges_[0].X_PC.pose.inverse() * edges_[object].X_PC.pose;
    update(object, fresh, Z);
    std::vector<ObservedEdge> all{edges_[0], edges_[object]};
    all[0].way = kUp;
    all[1].way = kDown;
    std::vector<std::size_t> at{0, object};
    for (std::size_t i = 1; i < edges_.size(); ++i) {
      const bool tied = !edges_[i].X_PC.unspecified && !edges_[i].X_PC.common_errors.empty();
      if (i == object || !tied) continue;
      all.push_back({edges_[i].X_PC, kBeside});
      at.push_back(i);
    }
    const std::string source = std::string(kObservedPrefix) + std::to_string(++count_);
    const auto found = observe(all, {Z, Covariance::trusted(kSighting)}, source, {1.0, true});
    REQUIRE(found);
    REQUIRE(found->accepted);
    std::size_t forgotten = 0;
    for (std::size_t k = 0; k < at.size(); ++k) {
      edges_[at[k]].X_PC = found->edges[k].X_PC;
      if (found->edges[k].forgotten) ++forgotten;
    }
    return forgotten;
  }

  // Of the path from one frame to another, each that at the end of an edge.
  [[nodiscard]] Matrix6d claimed(std::size_t a, std::size_t b) const {
    const Belief path = compose(inverse(edges_[a].X_PC), edges_[b].X_PC, Order::kSecond);
    return collapse(path).covariance.of_specified().matrix();
  }
  [[nodiscard]] Matrix6d right(std::size_t a, std::size_t b) const {
    const Pose X = edges_[a].X_PC.pose.inverse() * edges_[b].X_PC.pose;
    const Matrix6d H = -adjoint(X.inverse());
    const auto block = [&](std::size_t i, std::size_t j) {
      return Matrix6d(P_.block<6, 6>(row(i), row(j)));
    };
    return H * block(a, a) * H.transpose() + H * block(a, b) + block(b, a) * H.transpose() +
           block(b, b);
  }
  [[nodiscard]] Matrix6d right(std::size_t a) const { return P_.block<6, 6>(row(a), row(a)); }

  [[nodiscard]] Eigen::Index columns(std::size_t edge) const {
    Eigen::Index sum = 0;
    for (const CommonError& one : edges_[edge].X_PC.common_errors) sum += one.loading.cols();
    return sum;
  }

 private:
  void update(std::size_t object, bool fresh, const Pose& Z) {
    const Matrix6d H = adjoint(Z.inverse());
    if (fresh) {
      P_.middleRows<6>(row(object)) = H * P_.topRows<6>();
      P_.middleCols<6>(row(object)) = P_.middleRows<6>(row(object)).transpose();
      P_.block<6, 6>(row(object), row(object)) =
          H * P_.topLeftCorner<6, 6>() * H.transpose() + kSighting;
      return;
    }
    const Eigen::MatrixXd seen = P_.middleRows<6>(row(object)) - H * P_.topRows<6>();
    const Matrix6d S =
        seen.middleCols<6>(row(object)) - seen.leftCols<6>() * H.transpose() + kSighting;
    const Eigen::MatrixXd rest = P_ - seen.transpose() * testing::inverse_of(S) * seen;
    P_ = (rest + rest.transpose()) / 2;
  }

  const Matrix6d kStart = diagonal(0.02, 0.01);
  const Matrix6d kDrift = diagonal(7e-3, 2e-3);
  const Matrix6d kSighting = diagonal(5e-3, 3e-3);
  std::vector<ObservedEdge> edges_;
  Eigen::MatrixXd P_;
  int count_ = 0;
};

// The least and the greatest ratio of variances over all directions.
std::pair<double, double> ratios(const Matrix6d& claimed, const Matrix6d& right) {
  const Twist all = testing::ratios(claimed, right);
  return {all.minCoeff(), all.maxCoeff()};
}

// In a random order, at first in that of their numbers.
std::vector<std::size_t> sightings(std::size_t objects, int each, Random& random) {
  std::vector<std::size_t> all;
  for (int k = 0; k < each; ++k) {
    const auto begin = static_cast<std::ptrdiff_t>(all.size());
    for (std::size_t i = 1; i <= objects; ++i) all.push_back(i);
    if (k > 0) std::shuffle(all.begin() + begin, all.end(), random.engine());
  }
  return all;
}

TEST_CASE("Many columns: objects that one drifting base has seen stay as in a dense filter") {
  Random random(642);
  INFO("seed " << random.seed());
  const auto objects = GENERATE(std::size_t{8}, std::size_t{24}, std::size_t{40});
  INFO(objects << " objects");
  Drifting all(objects, random);
  for (const std::size_t object : sightings(objects, 3, random)) {
    all.drive(random.pose(0.05));
    REQUIRE(all.see(object) == 0);
    REQUIRE(all.columns(0) <= row(objects + 1) + std::max<Eigen::Index>(36, row(objects + 1) / 8));
  }
  for (std::size_t a = 0; a <= objects; ++a) {
    const std::size_t b = (a + 1) % (objects + 1);
    const auto [least, most] = ratios(all.claimed(a, b), all.right(a, b));
    INFO("from " << a << " to " << b << ": " << least << " to " << most);
    CHECK(least > 1 - 1e-5);
    CHECK(most < 1 + 1e-5);
    const auto [less, more] =
        ratios(collapse(all.edge(a)).covariance.of_specified().matrix(), all.right(a));
    CHECK(less > 1 - 1e-5);
    CHECK(more < 1 + 1e-5);
  }
}

TEST_CASE(
    "Many columns: beyond the maximum those least correlated are forgotten and never too certain") {
  Random random(643);
  INFO("seed " << random.seed());
  constexpr std::size_t kObjects = kMaxObservedTogether + 8;
  Drifting all(kObjects, random);
  std::size_t forgotten = 0;
  for (std::size_t object = 1; object <= kObjects; ++object) {
    all.drive(random.pose(0.05));
    forgotten += all.see(object);
  }
  CHECK(forgotten == kObjects + 1 - kMaxObservedTogether);
  for (std::size_t a = 0; a < kObjects; ++a) {
    INFO("from " << a << " to the next, and to the last one");
    // What depends on others counts as of unknown correlation.
    CHECK(all.edge(a).common_errors.empty() == all.edge(a).unknown.has_value());
    CHECK(ratios(all.claimed(a, a + 1), all.right(a, a + 1)).first > 1 - 1e-5);
    CHECK(ratios(all.claimed(a, kObjects), all.right(a, kObjects)).first > 1 - 1e-5);
  }
  // Those that are kept are exact.
  const auto [least, most] = ratios(all.claimed(0, kObjects), all.right(0, kObjects));
  CHECK(least > 1 - 1e-5);
  CHECK(most < 1 + 1e-5);
}

}  // namespace
}  // namespace tfdude
