#include "tfdude/math/observation.hpp"

#include <cmath>
#include <cstring>

#include "tfdude/math/fusion.hpp"

#include "math/semidefinite.hpp"
#include "support/catch.hpp"
#include "support/consistency.hpp"
#include "support/observed_chain.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Consistency;
using testing::ContainsSubstring;
using testing::Gaussian;
using testing::ObservedChain;
using testing::Random;

constexpr int kRuns = 1000;
constexpr auto kDown = ObservedEdge::Way::kDown;
constexpr auto kBeside = ObservedEdge::Way::kBeside;
constexpr auto kUp = ObservedEdge::Way::kUp;
const std::string kSource = "observed:once";

struct Ends {
  std::size_t from;
  std::size_t to;
};

// Each run a new robot of the same uncertainties, whose paths are observed one after the other.
std::vector<Consistency> simulate(Random& random, const std::vector<Ends>& observed,
                                  const std::vector<Ends>& asked, bool keep_common_errors) {
  std::vector<Consistency> found(asked.size());
  for (int run = 0; run < kRuns; ++run) {
    ObservedChain chain(random, 5);
    chain.add_source("s", {0, 2, 4}, random);
    chain.set_exact(1);
    chain.make_true(random);
    for (const Ends& ends : observed) {
      chain.observe(ends.from, ends.to, random.covariance(0.001, 0.001), random);
      if (!keep_common_errors) chain.forget_common_errors();
    }
    for (std::size_t i = 0; i < asked.size(); ++i) {
      found[i].add(chain.believed(asked[i].from, asked[i].to),
                   chain.truth(asked[i].from, asked[i].to));
    }
  }
  return found;
}

TEST_CASE("After observations the errors of edges and paths match their covariance in 1000 runs") {
  Random random(631);
  INFO("seed " << random.seed());
  const std::vector<Ends> asked = {{0, 1}, {2, 3}, {3, 4}, {4, 5}, {0, 5}, {0, 3}, {2, 5}, {3, 0}};
  const std::vector<std::vector<Ends>> plans = {
      {{0, 4}}, {{0, 4}, {0, 4}, {0, 4}}, {{0, 4}, {2, 5}, {5, 1}, {0, 4}}};
  for (const auto& plan : plans) {
    INFO(plan.size() << " observations");
    const auto found = simulate(random, plan, asked, true);
    for (std::size_t i = 0; i < asked.size(); ++i) {
      INFO("from " << asked[i].from << " to " << asked[i].to);
      CHECK_CONSISTENT(found[i]);
    }
  }
}

TEST_CASE("Without correlation between edges repeated observation makes a path overconfident") {
  Random random(632);
  INFO("seed " << random.seed());
  const auto found = simulate(random, std::vector<Ends>(8, {0, 4}), {{0, 1}}, false);
  INFO(found[0].mean() << ", at most " << found[0].high());
  CHECK(found[0].mean() > 1.5 * found[0].high());
}

TEST_CASE("The joint covariance equals that of a dense filter") {
  Random random(633);
  INFO("seed " << random.seed());
  for (int run = 0; run < 20; ++run) {
    ObservedChain chain(random, 5);
    chain.add_source("s", {0, 2, 4}, random);
    chain.add_source("t", {1, 2}, random);
    chain.set_exact(3);
    Eigen::MatrixXd P = chain.dense();
    for (const Ends& ends :
         std::vector<Ends>{{0, 2}, {0, 2}, {1, 5}, {5, 2}, {0, 3}, {1, 5}, {0, 1}, {5, 0}}) {
      const Covariance R = random.covariance(0.003, 0.003);
      P = chain.dense_update(P, ends.from, ends.to, R);
      chain.observe_exactly(ends.from, ends.to, R);
      const Eigen::MatrixXd rest = chain.dense() - P.topLeftCorner(30, 30);
      INFO("from " << ends.from << " to " << ends.to << ", differs by "
                   << rest.cwiseAbs().maxCoeff() << " of " << P.cwiseAbs().maxCoeff());
      CHECK(rest.cwiseAbs().maxCoeff() < 1e-9 * P.cwiseAbs().maxCoeff());
    }
    // However often all was observed.
    for (std::size_t i = 0; i < 5; ++i) {
      Eigen::Index columns = 0;
      for (const CommonError& common_error : chain.edges()[i].X_PC.common_errors)
        columns += common_error.loading.cols();
      CHECK(columns <= 3 + 3 + 2 * kMaxLoadingColumns);
    }
  }
}

TEST_CASE("One edge seen by many others stays exact with few columns") {
  Random random(641);
  INFO("seed " << random.seed());
  // The error of a mount, and of forty sensors on it, each of which is measured in the mount's
  // parent once.
  std::vector<ObservedEdge> edges(41);
  const Covariance wide = *Covariance::from_stddev({0.02, 0.02, 0.02, 0.02, 0.02, 0.02});
  const Covariance narrow = *Covariance::from_stddev({1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3});
  for (ObservedEdge& edge : edges) {
    edge.X_PC = {random.pose(), wide, std::nullopt, {}};
    edge.way = kBeside;
  }
  for (std::size_t sensor = 1; sensor < edges.size(); ++sensor) {
    std::vector<ObservedEdge> all{edges[0], edges[sensor]};
    all[0].way = all[1].way = kDown;
    for (std::size_t other = 1; other < sensor; ++other) all.push_back(edges[other]);
    const Pose Z = all[0].X_PC.pose * all[1].X_PC.pose;
    const auto found = observe(all, {Z, narrow}, "observed:" + std::to_string(sensor), {1.0, true});
    REQUIRE(found);
    edges[0].X_PC = found->edges[0].X_PC;
    edges[sensor].X_PC = found->edges[1].X_PC;
    for (std::size_t other = 1; other < sensor; ++other) {
      edges[other].X_PC = found->edges[1 + other].X_PC;
    }
  }
  for (std::size_t sensor = 1; sensor < edges.size(); ++sensor) {
    const Belief path = compose(edges[0].X_PC, edges[sensor].X_PC, Order::kSecond);
    const Twist variances = collapse(path).covariance.of_specified().matrix().diagonal();
    INFO("sensor " << sensor);
    // R, as the path was known so much less before.
    CHECK(variances.maxCoeff() < 1.0001e-6);
    CHECK(variances.minCoeff() > 0.99e-6);
    Eigen::Index columns = 0;
    for (const CommonError& one : edges[sensor].X_PC.common_errors) columns += one.loading.cols();
    CHECK(columns <= kMaxLoadingColumns);
  }
}

TEST_CASE("A long chain that is observed often stays exact, whatever columns that takes") {
  Random random(640);
  INFO("seed " << random.seed());
  ObservedChain chain(random, 40);
  Eigen::MatrixXd P = chain.dense();
  for (int i = 0; i < 40; ++i) {
    const Ends ends{random.index(20), 20 + random.index(20)};
    const Covariance R = random.covariance(0.003, 0.003);
    P = chain.dense_update(P, ends.from, ends.to, R);
    chain.observe_exactly(ends.from, ends.to, R);
    for (const ObservedEdge& edge : chain.edges()) {
      for (const CommonError& common_error : edge.X_PC.common_errors)
        CHECK(common_error.loading.cols() <= kMaxLoadingColumns);
    }
  }
  CHECK((chain.dense() - P).cwiseAbs().maxCoeff() < 1e-9 * P.cwiseAbs().maxCoeff());
}

// What a path has in common is that of its derivatives where it was observed. Each observation
// moves it a little, and that must not be taken for information about what was never measured.
TEST_CASE("A bent path that is observed again says no more about its edges") {
  const auto stddev = [](double metres, double radians) {
    return *Covariance::from_stddev({metres, metres, metres, radians, radians, radians});
  };
  std::vector<ObservedEdge> edges;
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(1, 0, 0), {0, 1, 0}, {1, 0, 0}}) {
    edges.push_back(
        {{Pose::trusted(Eigen::Quaterniond::Identity(), at), stddev(0.01, 0.05), {}, {}}});
  }
  const Pose Z_AB = edges[0].X_PC.pose * edges[1].X_PC.pose * edges[2].X_PC.pose;
  Twist noise;
  noise << 1, -1, 1, 1, -1, 1;
  Matrix6d first;
  int count = 0;
  for (const double deviations : {0.0, 1.0, -1.0}) {
    const Transform Z{Z_AB * exp(Twist(1e-4 * deviations * noise)), stddev(1e-4, 1e-4)};
    const auto found = observe(edges, Z, kSource, {});
    REQUIRE(found);
    CHECK(found->accepted);
    ++count;
    Belief path;
    for (std::size_t k = 0; k < edges.size(); ++k) {
      const Twist moved = log(edges[k].X_PC.pose.inverse() * found->edges[k].X_PC.pose);
      CHECK(moved.cwiseAbs().maxCoeff() < 1e-3);
      edges[k].X_PC = found->edges[k].X_PC;
      path = compose(path, edges[k].X_PC, Order::kSecond);
    }
    const Matrix6d edge = collapse({{}, edges[0].X_PC.own, {}, edges[0].X_PC.common_errors})
                              .covariance.of_specified()
                              .matrix();
    if (count == 1) first = edge;
    CHECK((edge - first).norm() < 1e-2 * first.norm());
    const Matrix6d whole = collapse(path).covariance.of_specified().matrix();
    CHECK(std::sqrt(whole(0, 0)) == testing::Approx(1e-4 / std::sqrt(count)).epsilon(0.02));
  }
}

TEST_CASE("A measurement of one uncertain edge is fused with it") {
  Random random(634);
  INFO("seed " << random.seed());
  for (int i = 0; i < 50; ++i) {
    const Transform X = random.transform(2.0, 0.1, 0.1);
    const Transform Z{X.pose * exp(0.1 * random.twist(1.0, 1.0)), random.covariance(0.1, 0.1)};
    const auto observed =
        observe({{{X.pose, X.covariance.of_specified(), std::nullopt, {}}, kDown}}, Z, kSource,
                {1.0, true});
    const auto fused = fuse({X, Z});
    REQUIRE(observed);
    REQUIRE(fused);
    CHECK(testing::transform_diff(collapse(observed->edges[0].X_PC), fused->X, 1e-8) == "");
    CHECK(observed->edges[0].X_PC.common_errors.empty());
  }
}

TEST_CASE("The gate rejects a distant measurement and reports the distance and changes nothing") {
  Random random(635);
  INFO("seed " << random.seed());
  ObservedChain chain(random, 3);
  Pose Z = chain.believed(0, 3).pose;
  const Covariance R = random.covariance(0.001, 0.001);
  const auto right = observe(chain.path(0, 3), {Z, R}, kSource);
  REQUIRE(right);
  CHECK(right->accepted);
  CHECK(right->distance_squared == testing::Approx(0).margin(1e-12));
  CHECK(right->dimensions == 6);
  CHECK(right->limit == testing::Approx(22.458).epsilon(1e-4));
  Z = Z * exp(0.5 * Twist::Unit(3));
  const auto wrong = observe(chain.path(0, 3), {Z, R}, kSource);
  REQUIRE(wrong);
  CHECK_FALSE(wrong->accepted);
  CHECK(wrong->distance_squared > 100.0);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK_FALSE(wrong->edges[i].corrected);
    const Belief& before = chain.edges()[i].X_PC;
    CHECK(std::memcmp(&wrong->edges[i].X_PC.pose, &before.pose, sizeof(Pose)) == 0);
    CHECK(wrong->edges[i].innovation.squares > 0);
  }
  const auto ungated = observe(chain.path(0, 3), {Z, R}, kSource, {1.0, true});
  REQUIRE(ungated);
  CHECK(ungated->accepted);
  CHECK_FALSE(observe(chain.path(0, 3), {Z, R}, kSource, {0.0, true}));
  CHECK_FALSE(observe(chain.path(0, 3), {Z, R}, kSource, {std::nan(""), true}));
}

TEST_CASE("Edges that are known exactly stay the same to the last bit") {
  Random random(636);
  ObservedChain chain(random, 4);
  chain.set_exact(1);
  chain.set_exact(2);
  chain.make_true(random);
  const auto before = chain.edges();
  chain.observe(0, 4, random.covariance(0.001, 0.001), random);
  for (const std::size_t i : {std::size_t{1}, std::size_t{2}}) {
    CHECK(std::memcmp(&chain.edges()[i].X_PC.pose, &before[i].X_PC.pose, sizeof(Pose)) == 0);
    CHECK(chain.edges()[i].X_PC.own.upper() == Covariance::Upper{});
    CHECK(chain.edges()[i].X_PC.common_errors.empty());
  }
  CHECK(testing::pose_diff(chain.edges()[0].X_PC.pose, before[0].X_PC.pose, 1e-9) != "");
  ObservedChain exact(random, 2);
  exact.set_exact(0);
  exact.set_exact(1);
  const auto nothing =
      observe(exact.path(0, 2), {exact.believed(0, 2).pose, random.covariance()}, kSource);
  REQUIRE_FALSE(nothing);
  CHECK_THAT(nothing.error().message, ContainsSubstring("all edges of the path are known exactly"));
}

TEST_CASE("An exact measurement far away is reached exactly") {
  Random random(637);
  INFO("seed " << random.seed());
  for (int i = 0; i < 20; ++i) {
    ObservedChain chain(random, 4);
    const Pose Z = chain.believed(0, 4).pose * exp(random.twist(0.8, 1.0));
    const auto observed = observe(chain.path(0, 4), Transform::exact(Z), kSource, {1.0, true});
    REQUIRE(observed);
    Pose X;
    for (const ObservedResult& edge : observed->edges) X = X * edge.X_PC.pose;
    CHECK(testing::pose_diff(X, Z, 1e-9) == "");
  }
}

TEST_CASE("An edge of unknown correlation gains nothing from the same measurement twice") {
  Random random(638);
  INFO("seed " << random.seed());
  const Transform X = random.transform(1.0, 0.1, 0.1);
  const Belief alone{X.pose, {}, X.covariance.of_specified(), {}};
  const Transform Z{X.pose, random.covariance(0.01, 0.01)};
  // By covariance intersection: the same again tells nothing more.
  const auto once = observe({{alone, kDown}}, Z, kSource);
  REQUIRE(once);
  CHECK(once->accepted);
  const Belief& after = once->edges[0].X_PC;
  REQUIRE(after.unknown);
  CHECK(after.own.upper() == Covariance::Upper{});
  const auto twice = observe({{after, kDown}}, Z, kSource);
  REQUIRE(twice);
  CHECK(twice->edges[0].X_PC.unknown->matrix().trace() > 0.99 * after.unknown->matrix().trace());
  const auto as_if = fuse({X, Z, Z});
  REQUIRE(as_if);
  CHECK(as_if->X.covariance.of_specified().matrix().trace() <
        0.7 * after.unknown->matrix().trace());

  const auto both = observe({{alone, kDown}, {alone, kUp}}, Z, kSource);
  REQUIRE_FALSE(both);
  CHECK_THAT(both.error().message, ContainsSubstring("all 2 uncertain edges"));
  // Beside an edge that may be corrected, the unknown one stays.
  const Belief known{random.pose(), random.covariance(1.0, 1.0), std::nullopt, {}};
  const auto mixed = observe({{alone, kDown}, {known, kDown}},
                             {X.pose * known.pose, random.covariance(0.001, 0.001)}, kSource);
  REQUIRE(mixed);
  CHECK_FALSE(mixed->edges[0].corrected);
  CHECK(mixed->edges[1].corrected);
  // The edge gets no better than the unknown edge between it and the measurement.
  const Matrix6d left = mixed->edges[1].X_PC.own.matrix();
  CHECK(left.trace() < known.own.matrix().trace());
  CHECK(testing::domination(
            left, X.covariance.transported(known.pose.inverse()).of_specified().matrix()) > -1e-9);
}

TEST_CASE("NormalizedInnovation finds the edge whose covariance is too small") {
  Random random(639);
  INFO("seed " << random.seed());
  for (const double lie : {1.0, 3.0}) {
    INFO("the errors of edge 2 are " << lie << " times what it says");
    std::vector<NormalizedInnovation> sum(3);
    for (int run = 0; run < kRuns; ++run) {
      ObservedChain chain(random, 3);
      chain.make_true(random, 2, lie);
      const auto observed = chain.observe(0, 3, random.covariance(0.001, 0.001), random);
      for (std::size_t i = 0; i < 3; ++i) {
        sum[i].squares += observed.edges[i].innovation.squares;
        sum[i].expected += observed.edges[i].innovation.expected;
        sum[i].variance += observed.edges[i].innovation.variance;
      }
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const double ratio = sum[i].squares / sum[i].expected;
      const double deviations = (sum[i].squares - sum[i].expected) / std::sqrt(sum[i].variance);
      INFO("edge " << i << ": ratio " << ratio << ", " << deviations << " standard deviations");
      if (lie == 1.0) CHECK(std::abs(deviations) < 4.0);
      if (lie > 1.0 && i == 2) CHECK(ratio > 2.5);
      if (lie > 1.0 && i != 2) CHECK(ratio < sum[2].squares / sum[2].expected);
    }
  }
}

// The joint covariance of the edges of a path down, after a measurement equal to the belief.
Eigen::MatrixXd dense_after(const std::vector<ObservedEdge>& edges, const Covariance& R) {
  const auto size = static_cast<Eigen::Index>(6 * edges.size());
  Eigen::MatrixXd P = Eigen::MatrixXd::Zero(size, size);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6, size);
  Pose X_CB;
  for (Eigen::Index i = size - 6; i >= 0; i -= 6) {
    const Belief& X = edges[static_cast<std::size_t>(i / 6)].X_PC;
    P.block<6, 6>(i, i) = X.own.matrix();
    H.middleCols<6>(i) = adjoint(X_CB.inverse());
    X_CB = X.pose * X_CB;
  }
  const Matrix6d S = H * P * H.transpose() + R.matrix();
  return P - P * H.transpose() * testing::inverse_of(S) * H * P;
}

Covariance isotropic(double metres, double radians) {
  return *Covariance::from_stddev({metres, metres, metres, radians, radians, radians});
}

TEST_CASE("To fourth order an observed path is as certain as samples of its edges") {
  Random random(913);
  INFO("seed " << random.seed());
  const int count = GENERATE(2, 3);
  const double radians = GENERATE(0.1, 0.2, 0.3);
  const double measured = GENERATE(0.01, 0.001);
  CAPTURE(count, radians, measured);
  std::vector<ObservedEdge> edges;
  Pose X;
  for (int i = 0; i < count; ++i) {
    const Pose X_PC = Pose::trusted(Eigen::Quaterniond::Identity(), random.vector(1.0));
    edges.push_back({{X_PC, isotropic(0.1, radians), std::nullopt, {}}, kDown});
    X = X * X_PC;
  }
  const Covariance R = isotropic(measured, measured);
  const auto observed = observe(edges, {X, R}, kSource);
  REQUIRE(observed);
  // From the end up, as lookups compose.
  Belief path;
  for (auto edge = observed->edges.rbegin(); edge != observed->edges.rend(); ++edge) {
    path = compose(edge->X_PC, path, Order::kFourth);
  }
  const Matrix6d claimed = collapse(path).covariance.of_specified().matrix();
  const Gaussian errors(dense_after(edges, R));
  constexpr int kSamples = 20'000;
  const Matrix6d sampled = testing::second_moment(kSamples, [&]() -> Twist {
    const Eigen::VectorXd e = errors(random);
    Pose moved;
    for (std::size_t i = 0; i < edges.size(); ++i) {
      moved = moved * edges[i].X_PC.pose * exp(e.segment<6>(static_cast<Eigen::Index>(6 * i)));
    }
    return log(X.inverse() * moved);
  });
  // Two edges cancel; between three, terms of sixth order are left.
  const double left = count == 2 ? 0.02 : 0.02 + 2 * std::pow(radians, 2);
  CHECK(testing::moment_diff(sampled, claimed, kSamples, left) == "");
}

}  // namespace
}  // namespace tfdude
