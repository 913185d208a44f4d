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

// A base that drifts sees more objects than may stay correlated, beside a dense filter of all of
// them. All is on one line, so that it is linear.
namespace tfdude {
namespace {

using testing::along_x;
using testing::Approx;

constexpr int kObjects = 114;
constexpr double kStart = 0.2;      // of the base [m]
constexpr double kGrows = 1e-4;     // of the drift, with each step [m²]
constexpr double kPlace = 10;       // of an object [m]
constexpr double kSighting = 0.01;  // [m]

Covariance on_line(double variance) {
  Covariance::Upper upper{};
  upper[0] = variance;
  return Covariance::trusted(upper);
}

Time at(int step) { return Time(std::chrono::milliseconds(100 * (step + 1))); }

std::string name_of(int object) { return "object " + std::to_string(object); }

// The base, then the objects.
class Filter {
 public:
  Filter() : P_(Eigen::MatrixXd::Identity(kObjects + 1, kObjects + 1) * kPlace * kPlace) {
    P_(0, 0) = kStart * kStart;
  }
  void drive() { P_(0, 0) += kGrows; }
  void see(int object) {
    const Eigen::VectorXd seen = P_.col(object + 1) - P_.col(0);
    P_ -= seen * seen.transpose() / (seen[object + 1] - seen[0] + kSighting * kSighting);
  }
  [[nodiscard]] double base() const { return P_(0, 0); }
  [[nodiscard]] double seen(int object) const {
    return P_(0, 0) - 2 * P_(0, object + 1) + P_(object + 1, object + 1);
  }

 private:
  Eigen::MatrixXd P_;
};

class Robot {
 public:
  Robot() {
    FrameSpec base{"base", "world", Transform{{}, on_line(kStart * kStart)}};
    base.timing = EdgeTiming();
    base.timing->drifts = true;
    base.timing->process_noise = on_line(10 * kGrows);
    std::vector<FrameSpec> frames{{"world", "", {}}, base};
    const Transform somewhere{along_x(1).pose, on_line(kPlace * kPlace)};
    for (int i = 0; i < kObjects; ++i) frames.push_back({name_of(i), "world", somewhere});
    node_.emplace(Node::open(network_.join(), "robot", frames).value());
    REQUIRE(node_->update("base", Transform{{}, on_line(kStart * kStart)}, at(0)));
  }

  // Sees what it expects. @return the objects that are forgotten
  std::vector<int> see(int object) {
    ++step_;
    filter_.drive();
    filter_.see(object);
    REQUIRE(node_->update("base", Transform::exact({}), at(step_)));
    const Pose expected = lookup("base", name_of(object)).pose;
    const auto found = node_->observe("base", name_of(object),
                                      {expected, on_line(kSighting * kSighting)}, at(step_));
    REQUIRE(found);
    REQUIRE(found->accepted);
    std::vector<int> forgotten;
    for (int i = 0; i < kObjects; ++i) {
      const auto& all = found->forgotten;
      if (std::count(all.begin(), all.end(), name_of(i)) > 0) forgotten.push_back(i);
    }
    return forgotten;
  }

  [[nodiscard]] double variance(const std::string& a, const std::string& b) {
    return lookup(a, b).covariance.of_specified().matrix()(0, 0);
  }
  [[nodiscard]] const Filter& filter() const { return filter_; }

 private:
  [[nodiscard]] Transform lookup(const std::string& a, const std::string& b) {
    Query query;
    query.at = at(step_);
    const auto X = node_->lookup(a, b, query);
    REQUIRE(X);
    return X->transform();
  }

  LoopbackNetwork network_;
  std::optional<Node> node_;
  Filter filter_;
  int step_ = 0;
};

TEST_CASE(
    "many objects: one that was forgotten is named, and never known too well when seen again") {
  Robot robot;
  std::vector<int> forgotten;
  for (int i = 0; i < kObjects; ++i) {
    for (const int one : robot.see(i)) forgotten.push_back(one);
  }
  CHECK(forgotten.size() == 3);  // of 115 edges
  constexpr double kLess = 1 - 1e-6;
  for (int i = 0; i < kObjects; ++i) {
    INFO("object " << i);
    CHECK(robot.variance("base", name_of(i)) > kLess * robot.filter().seen(i));
  }
  CHECK(robot.variance("world", "base") > kLess * robot.filter().base());
  for (const int one : forgotten) {
    INFO("again object " << one);
    (void)robot.see(one);
    // The sighting says where the object is, and not where the base is.
    CHECK(robot.variance("base", name_of(one)) == Approx(kSighting * kSighting).epsilon(1e-3));
    CHECK(robot.variance("world", "base") > kLess * robot.filter().base());
  }
}

}  // namespace
}  // namespace tfdude
