// The experiments of docs/accuracy.md, run with the library: prints one JSON document, the same
// each time. bench/uncertainty.py draws it.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include <Eigen/LU>
#include <nlohmann/json.hpp>

#include "tfdude/math/fusion.hpp"

#include "support/published.hpp"
#include "uncertainty/outline.hpp"

namespace {

using namespace tfdude;
using Json = nlohmann::json;

constexpr std::uint64_t kSeed = 20140629;
constexpr int kPairs = 1'000'000;     // samples of two poses
constexpr int kCorrelated = 300'000;  // samples per correlation, or per length of the trajectory
constexpr int kChains = 100'000;      // samples of the chain
constexpr int kShownChains = 800;     // of these, in the picture
constexpr int kTrials = 4000;         // of a fusion
constexpr double kCorrelatedAlpha = 0.2;

// E[eᵀ Σ⁻¹ e] / 6 for errors of this second moment: above one if Σ is too small for them.
double nees(const Matrix6d& sigma, const Matrix6d& moment) {
  return sigma.ldlt().solve(moment).trace() / 6.0;
}

double metres(const Matrix6d& sigma) { return std::sqrt(sigma.topLeftCorner<3, 3>().trace()); }
double radians(const Matrix6d& sigma) { return std::sqrt(sigma.bottomRightCorner<3, 3>().trace()); }

// Compares a covariance with the sampled moment.
Json beside(const Matrix6d& sigma, const Matrix6d& moment) {
  return {{"error", (sigma - moment).norm()},
          {"nees", nees(sigma, moment)},
          {"least", testing::domination(sigma, moment)},
          {"metres", metres(sigma)},
          {"radians", radians(sigma)}};
}

// ---- two poses

Json two_poses() {
  Json rows = Json::array();
  testing::Random random(kSeed);
  for (const double alpha : {0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 3.0}) {
    const auto poses = testing::two_poses(alpha);
    const Matrix6d drawn = testing::sampled_product(poses, 0, random, kPairs);
    rows.push_back({{"alpha", alpha},
                    {"norm", drawn.norm()},
                    {"second", beside(testing::composed(poses, Order::kSecond), drawn)},
                    {"fourth", beside(testing::composed(poses, Order::kFourth), drawn)}});
  }
  return {{"samples", kPairs}, {"rows", rows}};
}

// ---- the chain

// Of the left perturbation, as the paper has it.
Json elements(const Matrix6d& left) {
  return {
      {"xx", left(0, 0)}, {"yy", left(1, 1)}, {"ytheta", left(1, 5)}, {"thetatheta", left(5, 5)}};
}

struct DrawnChains {
  Matrix6d left = Matrix6d::Zero();  // E[ξ ξᵀ] of the left perturbation
  std::vector<Pose> poses;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();  // of the positions
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

DrawnChains draw_chains(const Pose& mean) {
  testing::Random random(kSeed + 1);
  DrawnChains drawn;
  const Pose back = mean.inverse();
  for (int i = 0; i < kChains; ++i) {
    const Pose& X = drawn.poses.emplace_back(testing::sampled_chain(testing::kChainSteps, random));
    const Twist xi = log(X * back);
    drawn.left += xi * xi.transpose() / kChains;
    drawn.mean += X.translation().head<2>() / kChains;
  }
  for (const Pose& X : drawn.poses) {
    const Eigen::Vector2d d = X.translation().head<2>() - drawn.mean;
    drawn.covariance += d * d.transpose() / kChains;
  }
  return drawn;
}

// The fractions of all chains within one and three standard deviations, by a squared distance, and
// those of a Gaussian with so many dimensions.
template <class Distance>
Json share_within(const std::vector<Pose>& poses, int dimensions, const Distance& squared) {
  Json shares = Json::array();
  for (const double sigmas : {1.0, 3.0}) {
    int inside = 0;
    for (const Pose& X : poses) inside += squared(X) <= sigmas * sigmas ? 1 : 0;
    // χ² with two and three degrees of freedom.
    double expected = 1.0 - std::exp(-sigmas * sigmas / 2.0);
    if (dimensions == 3) {
      expected = std::erf(sigmas / std::sqrt(2.0)) -
                 std::sqrt(2.0 / M_PI) * sigmas * std::exp(-sigmas * sigmas / 2.0);
    }
    shares.push_back({{"drawn", static_cast<double>(inside) / static_cast<double>(poses.size())},
                      {"expected", expected}});
  }
  return shares;
}

Json shares_of_chains(const DrawnChains& drawn, const Transform& second, const Transform& fourth) {
  const Pose back = second.pose.inverse();
  const Eigen::Matrix2d of_second =
      bench::planar(second.covariance.of_specified()).bottomRightCorner<2, 2>().inverse();
  const Eigen::Matrix3d of_fourth = bench::planar(fourth.covariance.of_specified()).inverse();
  const Eigen::Matrix2d of_drawn = drawn.covariance.inverse();
  const auto error = [&](const Pose& X) {
    const Twist xi = log(back * X);
    return Eigen::Vector3d(xi[0], xi[1], xi[5]);
  };
  return {{"second", share_within(drawn.poses, 2,
                                  [&](const Pose& X) {
                                    const Eigen::Vector2d e = error(X).tail<2>();
                                    return e.dot(of_second * e);
                                  })},
          {"fourth", share_within(drawn.poses, 3,
                                  [&](const Pose& X) {
                                    const Eigen::Vector3d e = error(X);
                                    return e.dot(of_fourth * e);
                                  })},
          {"moments", share_within(drawn.poses, 2, [&](const Pose& X) {
             const Eigen::Vector2d e = X.translation().head<2>() - drawn.mean;
             return e.dot(of_drawn * e);
           })}};
}

Json chain() {
  const Transform second = testing::chain(testing::kChainSteps, Order::kSecond);
  const Transform fourth = testing::chain(testing::kChainSteps, Order::kFourth);
  const DrawnChains drawn = draw_chains(second.pose);
  Json points = Json::array();
  for (int i = 0; i < kShownChains; ++i) {
    const Eigen::Vector3d p = drawn.poses[static_cast<std::size_t>(i)].translation();
    points.push_back({p.x(), p.y()});
  }
  Json outlines;
  for (const int sigmas : {1, 3}) {
    outlines["second"].push_back(bench::mapped_ellipse(second, sigmas));
    outlines["fourth"].push_back(bench::mapped_ellipsoid(fourth, sigmas));
    outlines["moments"].push_back(bench::ellipse(drawn.mean, drawn.covariance, sigmas));
  }
  return {{"samples", kChains},
          {"second", elements(left_covariance(second).of_specified().matrix())},
          {"fourth", elements(left_covariance(fourth).of_specified().matrix())},
          {"drawn", elements(drawn.left)},
          {"mean", {drawn.mean.x(), drawn.mean.y()}},
          {"linear",
           {{"x", second.pose.translation().x()},
            {"stddev_x", std::sqrt(ros_covariance(second).of_specified().matrix()(0, 0))},
            {"stddev_y", std::sqrt(ros_covariance(second).of_specified().matrix()(1, 1))}}},
          {"within", shares_of_chains(drawn, second, fourth)},
          {"points", points},
          {"outlines", outlines}};
}

// ---- fusion

Json fuse_often(double alpha, testing::Random& random) {
  const Pose truth = testing::fused_truth();
  double cost = 0;
  double squares = 0;
  double claimed = 0;
  double distance = 0;
  int fused = 0;
  for (int i = 0; i < kTrials; ++i) {
    const std::vector<Transform> estimates = testing::drawn_estimates(alpha, random);
    const auto result = fuse(estimates);
    if (!result) continue;
    ++fused;
    const Transform& X = result->X;
    for (const Transform& one : estimates) cost += testing::squared_distance(one, X.pose);
    squares += log(truth * X.pose.inverse()).squaredNorm();
    claimed += left_covariance(X).of_specified().matrix().trace();
    distance += testing::squared_distance(X, truth);
  }
  return {{"alpha", alpha},
          {"cost", cost / fused},
          {"error", std::sqrt(squares / fused)},
          {"claimed", std::sqrt(claimed / fused)},
          {"nees", distance / fused},
          {"failed", kTrials - fused}};
}

Json fusion() {
  Json rows = Json::array();
  testing::Random random(kSeed + 2);
  for (const double alpha : {0.001, 0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0}) {
    rows.push_back(fuse_often(alpha, random));
  }
  return {{"trials", kTrials}, {"rows", rows}};
}

// ---- correlated errors

Json correlation() {
  Json rows = Json::array();
  testing::Random random(kSeed + 3);
  const auto poses = testing::two_poses(kCorrelatedAlpha);
  const auto product = [](const testing::SharedPair& pair, Order order) {
    return left_covariance(collapse(compose(pair.first, pair.second, order)))
        .of_specified()
        .matrix();
  };
  const Matrix6d independent = testing::composed(poses, Order::kFourth);
  const Matrix6d bounded = product(testing::unknown_pair(poses), Order::kSecond);
  for (const double rho : {-0.95, -0.9, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 0.9, 0.95, 1.0}) {
    const Matrix6d drawn = testing::sampled_product(poses, rho, random, kCorrelated);
    const auto pair = testing::shared_pair(poses, rho);
    rows.push_back({{"correlation", rho},
                    {"norm", drawn.norm()},
                    {"independent", beside(independent, drawn)},
                    {"second", beside(product(pair, Order::kSecond), drawn)},
                    {"fourth", beside(product(pair, Order::kFourth), drawn)},
                    {"bound", beside(bounded, drawn)}});
  }
  return {{"samples", kCorrelated}, {"alpha", kCorrelatedAlpha}, {"rows", rows}};
}

Json way_after(int steps, testing::Random& random) {
  const testing::Trajectory t = testing::trajectory(steps);
  const auto way = [](const Belief& X_WA, const Belief& X_WB, Order order) {
    return collapse(compose(inverse(X_WA), X_WB, order)).covariance.of_specified().matrix();
  };
  const auto unknown = [](const Belief& X) {
    return Belief{X.pose, {}, collapse(X).covariance.of_specified(), {}};
  };
  const Belief A = t.A();
  const Belief B = t.B();
  // B is composed of A and of the way: to fourth order by an error of B that contains both.
  const Belief X_AB{t.X_AB.pose, t.X_AB.covariance.of_specified(), std::nullopt, {}};
  const Matrix6d second = way(A, compose(A, X_AB, Order::kSecond), Order::kSecond);
  const Matrix6d fourth = way(A, compose(A, X_AB, Order::kFourth), Order::kFourth);
  const Matrix6d joint = testing::sampled_way(t, random, kCorrelated);
  const Matrix6d driven = t.X_AB.covariance.of_specified().matrix();
  return {{"steps", steps},
          {"metres_A", metres(collapse(A).covariance.of_specified().matrix())},
          {"radians_A", radians(collapse(A).covariance.of_specified().matrix())},
          {"joint", beside(joint, joint)},
          {"driven", beside(driven, driven)},
          {"independent",
           beside(between(collapse(A), collapse(B)).covariance.of_specified().matrix(), joint)},
          {"second", beside(way(A, B, Order::kSecond), joint)},
          {"fourth", beside(way(A, B, Order::kFourth), joint)},
          {"second_driven", beside(second, driven)},
          {"fourth_driven", beside(fourth, driven)},
          {"bound", beside(way(unknown(A), unknown(B), Order::kSecond), joint)}};
}

Json trajectories() {
  Json rows = Json::array();
  testing::Random random(kSeed + 4);
  for (const int steps : {1, 3, 10, 30, 100, 300, 1000}) rows.push_back(way_after(steps, random));
  return {{"samples", kCorrelated}, {"rows", rows}};
}

// Six digits are enough for a reader and for a picture.
void round_all(Json& value) {
  if (value.is_structured()) {
    for (Json& part : value) round_all(part);
  } else if (value.is_number_float()) {
    char text[32];
    std::snprintf(text, sizeof text, "%.5e", value.get<double>());
    value = std::strtod(text, nullptr);
  }
}

}  // namespace

int main() {
  Json all{{"seed", testing::seed_or(kSeed)},
           {"two_poses", two_poses()},
           {"chain", chain()},
           {"fusion", fusion()},
           {"correlation", correlation()},
           {"trajectory", trajectories()}};
  round_all(all);
  std::puts(all.dump().c_str());
}
