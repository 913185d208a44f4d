#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "tree/sample_rows.hpp"

// Lookups at instants before the last observation of a base that drifts, beside a dense smoother in
// which each sample is a variable of its own. All is on one line, so that it is linear.
namespace tfdude {
namespace {

using testing::along_x;
using testing::Approx;

constexpr double kStart = 0.1;      // of the base [m]
constexpr double kStep = 0.02;      // between two samples [s]
constexpr double kGrows = 0.05;     // of the drift [m²/s]
constexpr double kSighting = 0.01;  // [m]
constexpr int kObjects = 3;
constexpr int kSamples = 61;

Covariance on_line(double variance) {
  Covariance::Upper upper{};
  upper[0] = variance;
  return Covariance::trusted(upper);
}

Time at(int sample) { return Time(std::chrono::milliseconds(100 + 20 * sample)); }

std::string object(int i) { return "object " + std::to_string(i); }

// world -> base drifts; nothing is known of the objects in the world.
class Robot {
 public:
  Robot() : P_(Eigen::MatrixXd::Zero(kSamples + kObjects, kSamples + kObjects)) {
    FrameSpec base{"base", "world", {along_x(0).pose, on_line(kStart * kStart)}};
    base.timing = EdgeTiming();
    base.timing->drifts = true;
    base.timing->process_noise = on_line(kGrows);
    std::vector<FrameSpec> frames{{"world", "", {}}, base};
    const Transform somewhere{along_x(1).pose, StatedCovariance::unspecified()};
    for (int i = 0; i < kObjects; ++i) frames.push_back({object(i), "world", somewhere});
    node_.emplace(Node::open(network_.join(), "robot", frames).value());
    for (int i = 0; i < kSamples; ++i) {
      for (int j = 0; j < kSamples; ++j) {
        P_(i, j) = kStart * kStart + kGrows * kStep * std::min(i, j);
      }
    }
  }

  void drive() {
    ++newest_;
    REQUIRE(node_->update("base", {along_x(0).pose, on_line(kStart * kStart)}, at(newest_)));
  }

  // Sees what it expects, so that only covariances change.
  void see(int i) {
    REQUIRE(node_->observe("base", object(i), {along_x(1).pose, on_line(kSighting * kSighting)},
                           at(newest_)));
    const Eigen::VectorXd H = way("base", object(i), newest_);
    if (std::count(known_.begin(), known_.end(), i) == 0) {
      known_.push_back(i);
      P_.row(kSamples + i) = P_.row(newest_);
      P_.col(kSamples + i) = P_.col(newest_);
      P_(kSamples + i, kSamples + i) = P_(newest_, newest_) + kSighting * kSighting;
      return;
    }
    const Eigen::VectorXd gain = P_ * H / (H.dot(P_ * H) + kSighting * kSighting);
    P_ -= (gain * (H.transpose() * P_)).eval();
  }

  // The variance of a lookup, by that of the smoother.
  [[nodiscard]] double ratio(const std::string& from, const std::string& to, int sample) {
    const auto X = node_->lookup(from, to, when(sample)).value();
    return ratio(X, way(from, to, sample));
  }
  [[nodiscard]] double ratio_of_way(int first, int second) {
    const auto X = node_->lookup("base", when(first), "base", when(second), "world").value();
    return ratio(X, way("world", "base", second) - way("world", "base", first));
  }
  [[nodiscard]] int newest() const { return newest_; }

 private:
  static Query when(int sample) {
    Query query;
    query.at = at(sample);
    return query;
  }
  [[nodiscard]] double ratio(const Transform& X, const Eigen::VectorXd& H) const {
    return X.covariance.of_specified().upper()[0] / H.dot(P_ * H);
  }
  static Eigen::VectorXd way(const std::string& from, const std::string& to, int sample) {
    Eigen::VectorXd H = Eigen::VectorXd::Zero(kSamples + kObjects);
    const auto add = [&](const std::string& id, double sign) {
      if (id == "base") H(sample) += sign;
      for (int i = 0; i < kObjects; ++i) {
        if (id == object(i)) H(kSamples + i) += sign;
      }
    };
    add(to, 1);
    add(from, -1);
    return H;
  }

  LoopbackNetwork network_;
  std::optional<Node> node_;
  Eigen::MatrixXd P_;  // of the base at each sample, then the objects
  std::vector<int> known_;
  int newest_ = -1;
};

// The samples before the newest that are kept, if each so many-th is seen.
int kept(int every) { return static_cast<int>(kFewestRows) * every; }

}  // namespace

TEST_CASE("earlier instants: what was seen then is tied as by a smoother, also between") {
  const int every = GENERATE(1, 5);
  const int objects = GENERATE(1, 3);
  CAPTURE(every, objects);
  Robot robot;
  robot.drive();
  while (robot.newest() + 1 < kSamples) {
    robot.drive();
    if (robot.newest() % every != 0) continue;
    for (int i = 0; i < objects; ++i) robot.see(i);
    const int oldest = std::max(every, robot.newest() - kept(every));
    for (int sample = robot.newest(); sample >= oldest; --sample) {
      CAPTURE(robot.newest(), sample);
      CHECK(robot.ratio("world", "base", sample) == Approx(1).margin(1e-5));
      CHECK(robot.ratio("base", object(0), sample) == Approx(1).margin(1e-5));
      CHECK(robot.ratio("base", object(objects - 1), sample) == Approx(1).margin(1e-5));
    }
  }
  for (int sample = robot.newest(); sample >= 0; --sample) {
    CAPTURE(sample);
    CHECK(robot.ratio("world", "base", sample) > 1 - 1e-5);
    CHECK(robot.ratio("base", object(0), sample) > 1 - 1e-5);
  }
}

TEST_CASE("earlier instants: only some of several objects are seen each time") {
  Robot robot;
  robot.drive();
  while (robot.newest() + 1 < kSamples) {
    robot.drive();
    robot.see(robot.newest() % kObjects);
    if (robot.newest() < kObjects) continue;
    const int oldest = std::max(1, robot.newest() - kept(1));
    for (int sample = robot.newest(); sample >= oldest; --sample) {
      CAPTURE(robot.newest(), sample);
      for (int i = 0; i < kObjects; ++i) {
        CHECK(robot.ratio("base", object(i), sample) == Approx(1).margin(1e-5));
      }
    }
  }
}

TEST_CASE("earlier instants: the way between two of them is known as well as it is") {
  Robot robot;
  robot.drive();
  while (robot.newest() + 1 < kSamples) {
    robot.drive();
    robot.see(0);
    const int oldest = std::max(1, robot.newest() - kept(1));
    for (int sample = robot.newest() - 1; sample >= oldest; --sample) {
      CAPTURE(robot.newest(), sample);
      CHECK(robot.ratio_of_way(sample, robot.newest()) > 1 - 1e-5);
      CHECK(robot.ratio_of_way(sample, robot.newest()) < 2);
    }
  }
}

}  // namespace tfdude
