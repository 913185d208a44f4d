// Two cameras on a base whose odometry drifts. One is always later than the other, so it sees from
// where the base was before the last sighting. Estimates beside the truth of many runs.

#include <chrono>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/consistency.hpp"
#include "support/networks.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Gaussian;
using testing::Random;

constexpr int kRounds = 29;
constexpr double kStep = 0.1;  // [s]

Covariance of_deviations(double translation, double rotation) {
  return *Covariance::from_stddev(
      {translation, translation, translation, rotation, rotation, rotation});
}

Time at(int step) { return Time(std::chrono::milliseconds(100 * (step + 1))); }

// world -> base drifts; two cameras on it, and two objects in the world.
class Robot {
 public:
  explicit Robot(Random& random) : random_(random) {
    FrameSpec base{"base", "world", Transform::exact({})};
    base.timing = EdgeTiming();
    base.timing->drifts = true;
    base.timing->process_noise = kDensity;
    std::vector<FrameSpec> frames{{"world", "", {}}, base};
    for (const auto& [id, parent] : kParents) {
      truth_[id] = random.pose();
      const Covariance& sigma = parent == "base" ? kMount : kPlace;
      const Pose estimate = truth_[id] * exp(Twist(Gaussian(sigma)(random)));
      frames.push_back({id, parent, {estimate, sigma}});
    }
    node_.emplace(Node::open(network_.join(), "robot", frames).value());
  }

  void drive() {
    const Pose forward = exp((Twist() << 0.1, 0, 0, 0, 0, 0.1).finished());
    if (!way_.empty()) {
      odometry_ = odometry_ * forward;
      way_.push_back(way_.back() * forward * exp(Twist(drift_(random_))));
    } else {
      way_.emplace_back();
    }
    REQUIRE(node_->update("base", Transform::exact(odometry_), at(newest())));
  }

  void see(const std::string& camera, const std::string& object, int step) {
    const Pose Z = of(camera, object, step) * exp(Twist(seen_(random_)));
    ObserveOptions all;
    all.gate = 1;
    const auto found = node_->observe(camera, object, {Z, kSighting}, at(step), all);
    if (!found) FAIL(found.error().message);
  }

  [[nodiscard]] int newest() const { return static_cast<int>(way_.size()) - 1; }
  [[nodiscard]] Pose of(const std::string& a, const std::string& b, int step) {
    return in_world(a, step).inverse() * in_world(b, step);
  }
  [[nodiscard]] Transform estimate(const std::string& a, const std::string& b) {
    const auto X = node_->lookup(a, b, Query{});
    if (!X) FAIL(X.error().message);
    return X->transform();
  }

 private:
  static inline const std::map<std::string, std::string> kParents{
      {"left", "base"}, {"right", "base"}, {"near", "world"}, {"far", "world"}};
  static inline const Covariance kDensity = of_deviations(0.06, 0.03);
  static inline const Covariance kMount = of_deviations(0.05, 0.05);
  static inline const Covariance kPlace = of_deviations(0.3, 0.2);
  static inline const Covariance kSighting = of_deviations(0.005, 0.005);

  [[nodiscard]] Pose in_world(const std::string& id, int step) {
    if (id == "world") return {};
    const Pose& base = way_[static_cast<std::size_t>(step)];
    if (id == "base") return base;
    return kParents.at(id) == "base" ? base * truth_.at(id) : truth_.at(id);
  }

  Random& random_;
  const Gaussian drift_{Covariance::trusted(Matrix6d(kStep * kDensity.matrix()))};
  const Gaussian seen_{kSighting};
  LoopbackNetwork network_;
  std::optional<Node> node_;
  std::map<std::string, Pose> truth_;
  std::vector<Pose> way_;  // of the base, by step
  Pose odometry_;
};

}  // namespace

TEST_CASE("late cameras: a camera that is always later makes nothing overconfident") {
  constexpr int late = 2;
  Random random(4302);
  INFO("seed " << random.seed() << ", " << late << " steps late");
  const std::vector<std::pair<std::string, std::string>> pairs{
      {"world", "base"}, {"world", "near"}, {"world", "far"},  {"base", "left"},
      {"base", "right"}, {"left", "right"}, {"near", "far"},   {"base", "near"},
      {"left", "near"},  {"right", "far"},  {"world", "right"}};
  std::map<std::pair<std::string, std::string>, testing::Consistency> errors;
  for (int run = 0; run < 10; ++run) {
    Robot robot(random);
    for (int step = 0; step < late; ++step) robot.drive();
    for (int step = late; step <= kRounds; ++step) {
      robot.drive();
      for (const char* object : {"near", "far"}) robot.see("left", object, step);
      for (const char* object : {"near", "far"}) robot.see("right", object, step - late);
    }
    for (const auto& [a, b] : pairs) {
      errors[{a, b}].add(robot.estimate(a, b), robot.of(a, b, robot.newest()));
    }
  }
  for (const auto& [pair, error] : errors) {
    INFO(pair.first << " to " << pair.second << ": " << error.mean() << ", at most "
                    << error.high());
    CHECK(error.mean() < error.high());
  }
}

}  // namespace tfdude
