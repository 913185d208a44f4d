#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"

// Observations that come in another order than their instants, beside a dense filter in which each
// sample is a variable of its own. All is on one line, so that it is linear.
namespace tfdude {
namespace {

using testing::along_x;
using testing::Approx;

constexpr int kRounds = 30;
constexpr double kStep = 0.1;       // [s]
constexpr double kGrows = 0.05;     // of the drift [m²/s]
constexpr double kPlace = 1;        // of an object [m]
constexpr double kSighting = 0.01;  // [m]

Covariance on_line(double variance) {
  Covariance::Upper upper{};
  upper[0] = variance;
  return Covariance::trusted(upper);
}

Time at(int step) { return Time(std::chrono::milliseconds(100 * (step + 1))); }

std::string name_of(int object) { return object == 0 ? "near" : "far"; }

// world -> base drifts; world -> near and world -> far stand.
class Line {
 public:
  explicit Line(int steps) : sigma_(Eigen::MatrixXd::Zero(steps + 2, steps + 2)), steps_(steps) {
    FrameSpec base{"base", "world", Transform::exact({})};
    base.timing = EdgeTiming();
    base.timing->drifts = true;
    base.timing->process_noise = on_line(kGrows);
    const Transform somewhere{along_x(1).pose, on_line(kPlace * kPlace)};
    node_.emplace(
        Node::open(
            network_.join(), "robot",
            {{"world", "", {}}, base, {"near", "world", somewhere}, {"far", "world", somewhere}})
            .value());
    for (int i = 0; i < steps; ++i) {
      for (int j = 0; j < steps; ++j) sigma_(i, j) = kGrows * kStep * std::min(i, j);
    }
    sigma_(steps, steps) = sigma_(steps + 1, steps + 1) = kPlace * kPlace;
  }

  void drive(int step) { REQUIRE(node_->update("base", Transform::exact({}), at(step))); }

  // Sees what it expects, so that only covariances change.
  void see(int object, int step, double sigma = kSighting) {
    const std::string id = name_of(object);
    Query query;
    query.at = at(step);
    const auto X = node_->lookup("base", id, query);
    REQUIRE(X);
    const auto found = node_->observe("base", id, {X->pose, on_line(sigma * sigma)}, at(step));
    REQUIRE(found);
    REQUIRE(found->accepted);
    Eigen::VectorXd H = Eigen::VectorXd::Zero(sigma_.rows());
    H(steps_ + object) = 1;
    H(step) = -1;
    const Eigen::VectorXd gain = sigma_ * H / (H.dot(sigma_ * H) + sigma * sigma);
    sigma_ -= (gain * (H.transpose() * sigma_)).eval();
  }

  // The variance that a lookup has, by that of the dense filter.
  double ratio(const std::string& from, int object, int newest) {
    return ratio(from, object, newest, newest);
  }
  double ratio(const std::string& from, int object, int newest, int step) {
    Eigen::VectorXd H = Eigen::VectorXd::Zero(sigma_.rows());
    H(steps_ + object) = 1;
    if (from == "base") H(step) = -1;
    Query query;
    if (step != newest) query.at = at(step);
    const auto X = node_->lookup(from, name_of(object), query).value();
    return X.covariance.of_specified().upper()[0] / H.dot(sigma_ * H);
  }

 private:
  LoopbackNetwork network_;
  std::optional<Node> node_;
  Eigen::MatrixXd sigma_;  // of the base at each step, and of the objects
  int steps_;
};

constexpr double kMount = 0.02;      // of a camera [m]
constexpr double kLocalized = 0.03;  // of each sample [m]

// world -> base is localized anew in each sample, or drifts; two cameras on it, and two objects in
// the world.
class Cameras {
 public:
  explicit Cameras(int steps, bool drifts = false)
      : sigma_(Eigen::MatrixXd::Zero(steps + 4, steps + 4)), steps_(steps) {
    FrameSpec base{"base", "world", {along_x(0).pose, on_line(kLocalized * kLocalized)}};
    base.timing = EdgeTiming();
    base.timing->moving = true;
    base.timing->drifts = drifts;
    if (drifts) base.timing->process_noise = on_line(kGrows);
    const Transform mount{along_x(0).pose, on_line(kMount * kMount)};
    const Transform somewhere{along_x(1).pose, on_line(kMount * kMount)};
    node_.emplace(Node::open(network_.join(), "robot",
                             {{"world", "", {}},
                              base,
                              {"near", "world", somewhere},
                              {"far", "world", somewhere},
                              {"left", "base", mount},
                              {"right", "base", mount}})
                      .value());
    sigma_.diagonal().head(steps).setConstant(kLocalized * kLocalized);
    for (int i = 0; drifts && i < steps * steps; ++i) {
      const int first = std::min(i / steps, i % steps);
      sigma_(i / steps, i % steps) = kLocalized * kLocalized + kGrows * kStep * first;
    }
    sigma_.diagonal().tail(4).setConstant(kMount * kMount);
  }

  void localize(int step) {
    REQUIRE(node_->update("base", {along_x(0).pose, on_line(kLocalized * kLocalized)}, at(step)));
  }

  // An object gets a new value, or goes.
  void replace(const std::string& id) {
    REQUIRE(node_->update(id, {along_x(1).pose, on_line(kMount * kMount)}));
    sigma_.row(index(id)).setZero();
    sigma_.col(index(id)).setZero();
    sigma_(index(id), index(id)) = kMount * kMount;
  }
  void remove(const std::string& id) { REQUIRE(node_->remove(id)); }

  // Sees what it expects. @return by which factor the variance of what was seen is too large
  double see(const std::string& from, const std::string& id, int step) {
    const Query query = when(step);
    const auto X = node_->lookup(from, id, query);
    REQUIRE(X);
    const auto found =
        node_->observe(from, id, {X->pose, on_line(kSighting * kSighting)}, query.at);
    REQUIRE(found);
    const Eigen::VectorXd H = way(from, id, step);
    const Eigen::VectorXd gain = sigma_ * H / (H.dot(sigma_ * H) + kSighting * kSighting);
    sigma_ -= (gain * (H.transpose() * sigma_)).eval();
    return ratio(from, id, step);
  }

  // The variance of a lookup, by that of the dense filter.
  double ratio(const std::string& from, const std::string& id, int step) {
    const Eigen::VectorXd H = way(from, id, step);
    const auto X = node_->lookup(from, id, when(step)).value();
    return X.covariance.of_specified().upper()[0] / H.dot(sigma_ * H);
  }

 private:
  static Query when(int step) {
    Query query;
    query.at = at(step);
    return query;
  }
  int index(const std::string& id) const {
    static const std::vector<std::string> kStatic{"near", "far", "left", "right"};
    return steps_ +
           static_cast<int>(std::find(kStatic.begin(), kStatic.end(), id) - kStatic.begin());
  }
  // Adds the errors on the way from the world.
  void add(const std::string& id, double sign, int step, Eigen::VectorXd& H) const {
    if (id == "world") return;
    if (id != "base") H(index(id)) += sign;
    if (id == "base" || id == "left" || id == "right") H(step) += sign;
  }
  Eigen::VectorXd way(const std::string& from, const std::string& id, int step) const {
    Eigen::VectorXd H = Eigen::VectorXd::Zero(sigma_.rows());
    add(id, 1, step, H);
    add(from, -1, step, H);
    return H;
  }

  LoopbackNetwork network_;
  std::optional<Node> node_;
  Eigen::MatrixXd sigma_;  // of the base at each step, the objects, and the mounts
  int steps_;
};

}  // namespace

TEST_CASE("late observations: a sample that is seen again makes nothing overconfident") {
  const int late = GENERATE(1, 2, 5);
  CAPTURE(late);
  Cameras line(kRounds + 1);
  for (int step = 0; step < late; ++step) line.localize(step);
  for (int step = late; step <= kRounds; ++step) {
    line.localize(step);
    for (const char* object : {"near", "far"}) CHECK(line.see("left", object, step) > 0.999);
    for (const char* object : {"near", "far"}) line.see("right", object, step - late);
    for (const char* object : {"near", "far"}) {
      CAPTURE(step, object, line.ratio("world", object, step));
      CHECK(line.ratio("world", object, step) > 0.999);
    }
    for (const char* camera : {"left", "right"}) {
      CAPTURE(step, camera, line.ratio("base", camera, step));
      CHECK(line.ratio("base", camera, step) > 0.999);
    }
  }
  CHECK(line.ratio("world", "near", kRounds) < 1.3);
  CHECK(line.ratio("base", "left", kRounds) < 1.6);
}

TEST_CASE("late observations: two cameras, of which one is always later, tie nothing too much") {
  const int late = GENERATE(1, 2, 5);
  CAPTURE(late);
  Cameras line(kRounds + 1, true);
  for (int step = 0; step < late; ++step) line.localize(step);
  for (int step = late; step <= kRounds; ++step) {
    line.localize(step);
    for (const char* object : {"near", "far"}) line.see("left", object, step);
    for (const char* object : {"near", "far"}) line.see("right", object, step - late);
    for (const auto& [a, b] :
         {std::pair("world", "near"), std::pair("world", "base"), std::pair("base", "left"),
          std::pair("base", "right"), std::pair("left", "right"), std::pair("near", "far"),
          std::pair("left", "near"), std::pair("right", "far")}) {
      CAPTURE(step, a, b, line.ratio(a, b, step));
      CHECK(line.ratio(a, b, step) > 0.999);
    }
  }
  for (const char* camera : {"left", "base"}) {
    CAPTURE(line.ratio(camera, "right", kRounds));
    CHECK(line.ratio(camera, "right", kRounds) < 1.3);
  }
}

TEST_CASE("late observations: what a standing edge was observed with forgets no sample") {
  Cameras line(4);
  for (int step = 0; step < 4; ++step) line.localize(step);
  line.see("left", "near", 3);
  line.see("right", "near", 1);  // without the newest sample
  line.see("left", "right", 1);  // beside which that sample is
  line.see("left", "far", 3);
  for (const char* id : {"near", "far"}) CHECK(line.ratio("world", id, 2) > 0.999);
  for (const char* id : {"left", "right"}) CHECK(line.ratio("base", id, 2) > 0.999);
}

TEST_CASE("late observations: a sample stays tied to what its partner was seen with") {
  enum class Partner { kStays, kReplaced, kRemoved };
  const auto partner = GENERATE(Partner::kStays, Partner::kReplaced, Partner::kRemoved);
  const bool later_is_seen = GENERATE(false, true);
  CAPTURE(static_cast<int>(partner), later_is_seen);
  Cameras line(2);
  line.localize(0);
  line.see("base", "near", 0);
  line.localize(1);
  if (later_is_seen) line.see("base", "left", 1);
  line.see("near", "far", 1);  // ties the far object to the base's first sample
  if (partner == Partner::kReplaced) line.replace("near");
  if (partner == Partner::kRemoved) line.remove("near");
  line.see("base", "far", 0);
  // Once a later sample was seen, the earlier one is no row any more.
  for (const auto& [from, id] : {std::pair("world", "far"), std::pair("base", "far")}) {
    CAPTURE(from, id, line.ratio(from, id, 1));
    CHECK(line.ratio(from, id, 1) > 1 - 1e-6);
    if (!later_is_seen) CHECK(line.ratio(from, id, 1) < 1 + 1e-6);
  }
}

TEST_CASE("late observations: in the order of their instants they are exact") {
  Line line(kRounds + 1);
  line.drive(0);
  for (int step = 1; step <= kRounds; ++step) {
    line.drive(step);
    line.see(1, step - 1);
    line.see(0, step);
  }
  for (const int object : {0, 1}) {
    CHECK(line.ratio("world", object, kRounds) == Approx(1).margin(1e-6));
    CHECK(line.ratio("base", object, kRounds) == Approx(1).margin(1e-6));
  }
}

TEST_CASE("late observations: out of order they never get overconfident") {
  const int late = GENERATE(1, 2, 5);
  CAPTURE(late);
  Line line(kRounds + 1);
  for (int step = 0; step < late; ++step) line.drive(step);
  for (int step = late; step <= kRounds; ++step) {
    line.drive(step);
    line.see(0, step);
    line.see(1, step - late);
    line.see(0, step - late);
    for (const int object : {0, 1}) {
      CAPTURE(step, object, line.ratio("world", object, step), line.ratio("base", object, step));
      CHECK(line.ratio("world", object, step) > 0.999);
      CHECK(line.ratio("base", object, step) > 0.999);
    }
  }
  // The first late ones, which saw from where the base was known exactly, count for less.
  for (const int object : {0, 1}) CHECK(line.ratio("base", object, kRounds) < 1.1);
}

// From the first late one on, the last instants that were observed stay rows.
TEST_CASE("late observations: of instants that are kept, and between them, they are exact") {
  const int late = GENERATE(1, 2, 5);
  CAPTURE(late);
  Line line(kRounds + 1);
  for (int step = 0; step <= kRounds; ++step) {
    line.drive(step);
    if (step % 3 != 0) line.see(0, step);
    if (step == 5) line.see(0, step - late, 1e3);  // tells nothing
    if (step < 5 + late) continue;
    line.see(1, step - late);
    line.see(0, step - late);
    for (const int object : {0, 1}) {
      CAPTURE(step, object);
      CHECK(line.ratio("world", object, step) == Approx(1).margin(1e-5));
      CHECK(line.ratio("base", object, step) == Approx(1).margin(1e-5));
      CHECK(line.ratio("base", object, step, step - late) == Approx(1).margin(1e-5));
    }
  }
}

TEST_CASE("late observations: before all that is kept they never get overconfident") {
  Line line(kRounds + 1);
  for (int step = 0; step <= kRounds; ++step) line.drive(step);
  line.see(0, kRounds);
  for (int step = kRounds - 1; step > 0; step -= 2) {
    line.see(1, step);
    line.see(0, step);
    for (const int object : {0, 1}) {
      CAPTURE(step, object);
      CHECK(line.ratio("world", object, kRounds) > 0.999);
      CHECK(line.ratio("base", object, kRounds) > 0.999);
    }
  }
}

TEST_CASE("late observations: what a dynamic edge was observed with stays with it") {
  const bool drifts = GENERATE(false, true);
  CAPTURE(drifts);
  const Transform X{along_x(0).pose, on_line(0.01)};
  FrameSpec moves{"moves", "world", X};
  moves.timing = EdgeTiming();
  moves.timing->moving = true;
  moves.timing->drifts = drifts;
  LoopbackNetwork network;
  auto node =
      Node::open(network.join(), "robot",
                 {{"world", "", {}}, moves, {"tip", "moves", {along_x(1).pose, on_line(0.01)}}})
          .value();
  REQUIRE(node.update("moves", X, at(0)));
  REQUIRE(node.observe("world", "tip", {along_x(1).pose, on_line(1e-6)}));
  for (int i = 0; i < 4; ++i) {
    const auto found = node.observe("moves", "tip", {along_x(1.01).pose, on_line(0.0025)}).value();
    CHECK(found.corrected.size() == 2);
    const auto tip = node.lookup("world", "tip", Query{}).value();
    CHECK(tip.pose.translation().x() == Approx(1).margin(1e-5));
    CHECK(tip.covariance.of_specified().upper()[0] == Approx(1e-6).epsilon(1e-3));
  }
}

// The object is where the head was then, so one error of three that are equal. The late sighting
// ties the tool to the object and to the head of before: of them only the object is on the path.
TEST_CASE("late observation: the newest sample stays tied to what a late sighting corrects") {
  LoopbackNetwork network;
  FrameSpec head{"head", "base", {}};
  head.timing = EdgeTiming();
  const Transform certain{Pose(), on_line(1e-6)};
  Node node =
      Node::open(network.join(), "robot",
                 {{"base", "", {}}, head, {"object", "base", certain}, {"tool", "head", certain}})
          .value();
  for (const int step : {0, 1}) REQUIRE(node.update("head", certain, at(step)));
  const Transform seen{Pose(), on_line(1e-14)};
  REQUIRE(node.observe("object", "head", seen, at(1)));
  REQUIRE(node.observe("object", "tool", seen, at(0)));
  const auto X = node.lookup("base", "tool", Query{});
  REQUIRE(X);
  CHECK(X->stamp == at(1));
  CHECK(X->covariance.of_specified().upper()[0] / 1e-6 == Approx(1.4).epsilon(1e-6));
}

// A partner with another owner has got a new value, so the sources of earlier observations stay.
// The earlier sample, which has them too, is not corrected with the later one.
TEST_CASE("late observation: the past of an edge that drifts never counts as known exactly") {
  LoopbackNetwork network;
  FrameSpec head{"head", "base", {}};
  head.timing = EdgeTiming();
  FrameSpec lift{"lift", "base", {}};
  lift.timing = EdgeTiming();
  lift.timing->drifts = true;
  const Transform place{Pose(), on_line(4e-4)};
  const Node object =
      Node::open(network.join(), "object", {{"base", "", {}}, {"b", "lift", place}}).value();
  const Node robot =
      Node::open(network.join(), "robot", {head, lift, {"a", "head", place}}).value();
  Client client = Client::open(network.join()).value();
  const auto drive = [&](int step) {
    REQUIRE(client.update({{"lift", place}, {"head", place}}, at(step)));
  };
  const auto see = [&](const char* a, const char* b, int step, double variance) {
    REQUIRE(client.observe(a, b, {Pose(), on_line(variance)}, at(step)));
  };
  const auto variance = [&] {
    Query query;
    query.at = at(1);
    return client.lookup("base", "b", query).value().covariance.of_specified().upper()[0];
  };
  drive(0);
  see("a", "lift", 0, 1e-6);
  drive(1);
  see("base", "b", 1, 1e-6);
  CHECK(variance() == Approx(1e-6).epsilon(0.01));
  drive(2);
  REQUIRE(client.update("a", place));
  see("base", "lift", 2, 4e-4);
  CHECK(variance() > 0.9e-6);
}

}  // namespace tfdude
