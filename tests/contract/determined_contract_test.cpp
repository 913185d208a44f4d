// A filter's poses are values: each replaces the one before, and says where odometry begins.

#include <cmath>
#include <random>

#include "tfdude/client/node.hpp"
#include "tfdude/math/pose.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

const std::array<double, 6> kWalk{0.06, 0.06, 0.06, 0.03, 0.03, 0.03};  // after one second
const std::array<double, 6> kFilter{0.05, 0.04, 0.03, 0.01, 0.01, 0.02};
constexpr double kPeriod = 0.02;

Time at(int k) { return time_of(1'000'000'000'000 + k * 20'000'000LL); }

// A base that turns, its odometry, and a filter that has other errors each time.
struct Drive {
  explicit Drive(std::uint64_t seed) : random(seed) {}

  Pose noise(const std::array<double, 6>& stddev, double factor) {
    Twist xi;
    for (int i = 0; i < 6; ++i) {
      xi[i] = factor * stddev[static_cast<std::size_t>(i)] * std::normal_distribution<>()(random);
    }
    return exp(xi);
  }
  void step() {
    const Twist motion = (Twist() << 0.02, 0, 0, 0, 0, 0.01).finished();
    X_MB = X_MB * exp(motion);
    X_OB = X_OB * exp(motion) * noise(kWalk, std::sqrt(kPeriod));
  }

  std::mt19937_64 random;
  Pose X_MB = *Pose::create(from_rpy(0, 0, 0.6), Eigen::Vector3d(1, 2, 0.1));  // as it is
  Pose X_OB;
};

double nees(const Transform& X, const Pose& truth) {
  return testing::squared_distance(log(X.pose.inverse() * truth),
                                   X.covariance.of_specified().matrix());
}

EdgeTiming drifting(const std::array<double, 6>& density) {
  EdgeTiming timing;
  timing.drifts = true;
  timing.moving = true;
  timing.process_noise = *Covariance::from_stddev(density);
  timing.max_ahead = std::chrono::nanoseconds::max();
  return timing;
}

}  // namespace

TEST_CASE("uncertainty: a filter's pose determines the edge above odometry, and no other") {
  // Samples of odom may be stamped in advance, so that a pose lies between two of them.
  const int ahead = GENERATE(0, 30);
  CAPTURE(ahead);
  const Pose X_BG = *Pose::create(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.5, 0, 0.3));
  double sum[4] = {};
  constexpr int kFixes = 60;
  int counted = 0;
  Node node = Node::open(LoopbackNetwork().join(), "robot",
                         {{"map", "", {}}, {"odom", "map", {}}, {"base", "odom", {}}})
                  .value();
  REQUIRE(node.add("gripper", "base", {X_BG, StatedCovariance::exact()}));
  REQUIRE(node.set_timing("odom", drifting({})));
  REQUIRE(node.set_timing("base", drifting(kWalk)));
  constexpr std::uint64_t kSeed = 7;
  CAPTURE(kSeed);
  Drive drive(kSeed);
  std::vector<Pose> truth;
  for (int k = 0; k < 25 * kFixes; ++k) {
    if (k > 0) drive.step();
    truth.push_back(drive.X_MB);
    REQUIRE(node.update("base", {drive.X_OB, StatedCovariance::exact()}, at(k)));
    REQUIRE(node.update("odom", {}, at(k < 45 ? k : k + ahead)));
    if (k % 25 != 20) continue;
    // Of three periods ago.
    const Pose before = node.lookup_pose("odom", "base").value();
    const Transform Z{truth[static_cast<std::size_t>(k - 3)] * drive.noise(kFilter, 1),
                      *Covariance::from_stddev(kFilter)};
    const auto found = node.determine("odom", "map", "base", Z, at(k - 3));
    REQUIRE(found);
    CHECK(found->accepted);
    // What the wheels have measured stays.
    const Pose after = node.lookup_pose("odom", "base").value();
    CHECK(log(before.inverse() * after).norm() < 1e-9);
    Query query;
    query.at = at(k - 3);
    const auto there = node.lookup("map", "base", query).value();
    CHECK(log(there.pose.inverse() * Z.pose).norm() < 1e-9);
    CHECK((there.covariance.of_specified().matrix() - Z.covariance.of_specified().matrix()).norm() <
          1e-9);
    // Now; at the measurement; while the pose before held; two such poses ago.
    ++counted;
    int which = 0;
    for (const int back : {0, 3, 13, 40}) {
      if (counted < 3) break;
      query.at = at(k - back);
      const auto X = node.lookup("map", "gripper", query);
      REQUIRE(X);
      sum[which++] += nees(*X, truth[static_cast<std::size_t>(k - back)] * X_BG);
    }
  }
  for (const double one : sum) {
    const double mean = one / (counted - 2);
    CAPTURE(mean);
    // χ² of 6 · 58 degrees of freedom: 95 % are within 0.86 and 1.15 of its mean.
    CHECK(mean > 6 * 0.86);
    CHECK(mean < 6 * 1.15);
  }
}

TEST_CASE("uncertainty: only an edge of the path can be determined") {
  Node node = Node::open(LoopbackNetwork().join(), "robot",
                         {{"map", "", {}},
                          {"odom", "map", {{}, *Covariance::from_stddev(kFilter)}},
                          {"aside", "map", {}}})
                  .value();
  const Transform Z{Pose(), *Covariance::from_stddev(kFilter)};
  const auto found = node.determine("aside", "map", "odom", Z);
  REQUIRE(!found);
  CHECK(found.error().code == Errc::kInvalidInput);
  REQUIRE(node.determine("odom", "map", "odom", Z));
  // The second pose replaces the first one, and is no second measurement.
  const auto X = node.lookup("map", "odom").value();
  CHECK((X.covariance.of_specified().matrix() - Z.covariance.of_specified().matrix()).norm() <
        1e-12);
}

}  // namespace tfdude
