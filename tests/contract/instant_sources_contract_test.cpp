// Sources of errors that dynamic edges name, over observations: one error an instant.

#include <chrono>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

// All is on one line, so that errors are linear in what disturbs: each is found from one run an
// independent disturbance, without any model of the filter.
namespace tfdude {
namespace {

using testing::along_x;
using testing::Approx;
using testing::following;
using testing::revolute_named;

constexpr double kSupply = 0.03;    // of each sample [m]
constexpr double kSighting = 0.01;  // [m]

Covariance on_line(double variance) {
  Covariance::Upper upper{};
  upper[0] = variance;
  return Covariance::trusted(upper);
}

Time at(int step) { return Time(std::chrono::milliseconds(100 * (step + 1))); }

Loading loading(double by) {
  Loading F = Loading::Zero(6, 1);
  F(0, 0) = by;
  return F;
}

struct Seen {
  std::string from;
  int step;
  std::optional<std::string> declared{};  // a static edge that names the source from now on
};

struct Asked {
  std::string from;
  std::string to;
  int step;
};

constexpr int kSteps = 6;

// Of two owners: world -> left and world -> right are told at each step with the same error,
// right's the other way round. world -> post -> object stand.
class Line {
 public:
  // @param disturbed  which of the errors is one standard deviation; the others are zero
  Line(int disturbed, bool lasting) : disturbed_(disturbed), lasting_(lasting) {
    const auto moving = [](const std::string& id) {
      FrameSpec frame{id, "world", Transform::exact({})};
      frame.timing = EdgeTiming();
      frame.timing->moving = true;
      return frame;
    };
    robot_.emplace(Node::open(network_.join(), "robot",
                              {{"world", "", {}},
                               moving("left"),
                               {"object", "post", {}},
                               {"post", "world", Transform::exact(along_x(1).pose)}})
                       .value());
    other_.emplace(Node::open(network_.join(), "other", {moving("right")}).value());
    REQUIRE(robot_->correlate("left", {false, {{"supply", false, loading(kSupply)}}, {}}));
    REQUIRE(other_->correlate("right", {false, {{"supply", false, loading(-kSupply)}}, {}}));
  }

  void tell(int step) {
    const double error = supply(step);
    REQUIRE(robot_->update("left", Transform::exact(along_x(error).pose), at(step)));
    REQUIRE(other_->update("right", Transform::exact(along_x(-error).pose), at(step)));
  }

  void see(const Seen& seen, int number) {
    if (seen.declared) {
      const Correlation said{false, {{"supply", false, loading(kSupply)}}, {}};
      REQUIRE(robot_->correlate(*seen.declared, said));
      REQUIRE(robot_->update(*seen.declared, Transform::exact(along_x(1 + supply(0)).pose)));
    }
    const double there = seen.from == "post" ? 0 : 1;
    const Transform Z{along_x(there + kSighting * drawn(kSteps + number)).pose,
                      on_line(kSighting * kSighting)};
    const auto found = other_->observe(seen.from, "object", Z, at(seen.step), {1.0, true});
    INFO("from " << seen.from << " at " << seen.step);
    REQUIRE(found);
    REQUIRE(found->accepted);
  }

  [[nodiscard]] StampedTransform asked(const Asked& ask) {
    Query query;
    query.at = at(ask.step);
    const auto X = other_->lookup(ask.from, ask.to, query);
    REQUIRE(X);
    return *X;
  }

 private:
  [[nodiscard]] double drawn(int number) const { return number == disturbed_ ? 1 : 0; }
  [[nodiscard]] double supply(int step) const { return kSupply * drawn(lasting_ ? 0 : step); }

  LoopbackNetwork network_;
  std::optional<Node> robot_;
  std::optional<Node> other_;
  const int disturbed_;
  const bool lasting_;  // the error of all steps is one
};

// What each answer claims, by the variance that it truly has.
std::vector<double> ratios(const std::vector<Seen>& plan, const std::vector<Asked>& asked,
                           bool lasting = false) {
  std::vector<double> squares(asked.size());
  std::vector<double> claimed(asked.size());
  for (int disturbed = 0; disturbed < kSteps + static_cast<int>(plan.size()); ++disturbed) {
    Line line(disturbed, lasting);
    std::size_t next = 0;
    for (int step = 0; step < kSteps; ++step) {
      line.tell(step);
      for (; next < plan.size() && plan[next].step <= step; ++next) {
        line.see(plan[next], static_cast<int>(next));
      }
    }
    for (std::size_t i = 0; i < asked.size(); ++i) {
      const StampedTransform X = line.asked(asked[i]);
      const double truth = asked[i].to == "object" ? (asked[i].from == "post" ? 0 : 1) : 0;
      const double error = X.pose.translation().x() - truth;
      squares[i] += error * error;
      claimed[i] = X.covariance.if_complete()->upper()[0];
    }
  }
  std::vector<double> found;
  for (std::size_t i = 0; i < asked.size(); ++i) found.push_back(claimed[i] / squares[i]);
  return found;
}

const std::vector<Asked> kAll = {{"left", "object", 5},  {"right", "object", 5},
                                 {"world", "object", 5}, {"left", "object", 3},
                                 {"right", "object", 3}, {"left", "right", 5}};

void check_honest(const std::vector<double>& found, double most) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    INFO("from " << kAll[i].from << " to " << kAll[i].to << " at " << kAll[i].step << ": "
                 << found[i]);
    CHECK(found[i] > 1 - 1e-6);
    CHECK(found[i] < most);
  }
}

TEST_CASE("instants: a sample has another error of its source than the one that was observed") {
  const auto found = ratios({{"left", 3}}, kAll);
  check_honest(found, 2 + 1e-6);
  INFO("just seen");
  CHECK(found[3] == Approx(1).epsilon(1e-6));
  CHECK(found[5] == Approx(1).epsilon(1e-6));
}

TEST_CASE("instants: sightings of many samples are as good as independent ones") {
  const auto found =
      ratios({{"left", 0}, {"left", 1}, {"left", 2}, {"left", 3}, {"left", 4}, {"left", 5}}, kAll);
  INFO("in the world: " << found[2]);
  CHECK(found[0] == Approx(1).epsilon(1e-6));
  CHECK(found[2] == Approx(1).epsilon(1e-6));
}

TEST_CASE("instants: edges of several owners with one source share its error at an instant") {
  check_honest(ratios({{"left", 3}, {"right", 3}}, kAll), 8);
  check_honest(ratios({{"left", 5}, {"right", 5}, {"left", 5}}, kAll), 8);
  // Those that come late, too.
  check_honest(ratios({{"left", 5}, {"left", 3}, {"right", 3}}, kAll), 30);
  // The newest instant is observed again after one that came late.
  check_honest(ratios({{"left", 5}, {"left", 3}, {"right", 5}}, kAll), 30);
  check_honest(ratios({{"left", 5}, {"left", 3}, {"left", 5}, {"right", 5}}, kAll), 30);
}

TEST_CASE("instants: an observation of static edges keeps an error that of its instant") {
  for (const char* then : {"left", "right", "world", "post"}) {
    INFO("then from " << then);
    check_honest(ratios({{"left", 5}, {"post", 5}, {then, 5}}, kAll), 8);
    check_honest(ratios({{"left", 3}, {"left", 5}, {"post", 5}, {then, 5}}, kAll), 8);
  }
}

TEST_CASE("instants: a source that also a static edge names is one error for all time") {
  const std::vector<Asked> asked = {
      {"left", "object", 5}, {"world", "object", 5}, {"post", "object", 5}, {"left", "object", 4}};
  const std::vector<std::vector<Seen>> plans = {
      {{"left", 1, "post"}, {"left", 3}, {"left", 5}},
      {{"left", 1}, {"left", 3, "post"}, {"left", 5}},  // it was observed before that was declared
      {{"left", 1}, {"left", 3, "post"}, {"post", 4}, {"left", 5}}};
  for (const auto& plan : plans) {
    const auto found = ratios(plan, asked, true);
    INFO("plan " << &plan - plans.data());
    for (std::size_t i = 0; i < found.size(); ++i) {
      INFO(asked[i].from << ": " << found[i]);
      CHECK(found[i] > 1 - 1e-6);
      CHECK(found[i] < 6);
    }
  }
}

// base -> finger and base -> thumb, which mimics it; base -> object.
TEST_CASE("instants: a joint that others mimic has another error in its next sample") {
  JointSpec leader = revolute_named("j");
  leader.coupled = true;
  for (const bool stamped : {true, false}) {
    INFO((stamped ? "stamped" : "unstamped"));
    LoopbackNetwork network;
    Node node = Node::open(network.join(), "robot",
                           {{"base", "", {}},
                            testing::moved_by("finger", "base", leader),
                            testing::moved_by("thumb", "base", following("k", "j", 1, 0)),
                            {"object", "base", {along_x(2).pose, StatedCovariance::unspecified()}}})
                    .value();
    const auto turn = [&](int step) {
      const std::optional<Time> stamp = stamped ? std::optional<Time>(at(step)) : std::nullopt;
      REQUIRE(node.update_joints({"j"}, {0.3}, {1e-4}, stamp));
    };
    const auto sigma = [&](const std::string& from) {
      const auto X = node.lookup(from, "object", Query{});
      REQUIRE(X);
      return X->covariance.if_complete()->stddev()[5];
    };
    turn(0);
    const auto Z = node.lookup("finger", "object");
    REQUIRE(Z);
    const Transform seen{Z->pose, *Covariance::from_stddev({1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4})};
    REQUIRE(node.observe("finger", "object", seen).value().accepted);
    CHECK(sigma("finger") == Approx(1e-4).epsilon(1e-6));
    // Of the same instant, it is the same error.
    if (stamped) CHECK(sigma("thumb") == Approx(1e-4).epsilon(1e-6));
    turn(1);
    INFO(sigma("finger"));
    CHECK(sigma("finger") >= std::sqrt(2e-4) * (1 - 1e-6));
    CHECK(sigma("finger") < 2.1e-2);
    CHECK(sigma("thumb") >= std::sqrt(2e-4) * (1 - 1e-6));
  }
}

constexpr int kSupplies = 4;  // at the steps 0 to 3

// world -> first (samples at 1 and 3) -> second (at 0, 2 and 3), whose errors of one source cancel
// where they are the same. What is seen at 1 says how long the path is.
class Opposed {
 public:
  // @param disturbed  as of Line; beyond the supplies: the sightings
  explicit Opposed(int disturbed) : disturbed_(disturbed) {
    const auto moving = [](const std::string& id, const std::string& parent) {
      FrameSpec frame{id, parent, Transform::exact({})};
      frame.timing = EdgeTiming();
      frame.timing->moving = true;
      return frame;
    };
    node_.emplace(
        Node::open(network_.join(), "robot",
                   {{"world", "", {}}, moving("first", "world"), moving("second", "first")})
            .value());
    REQUIRE(node_->correlate("first", {false, {{"supply", false, loading(kSupply)}}, {}}));
    REQUIRE(node_->correlate("second", {false, {{"supply", false, loading(-kSupply)}}, {}}));
    for (const int step : {1, 3}) tell("first", step, kSupply);
    for (const int step : {0, 2, 3}) tell("second", step, -kSupply);
  }

  void see(const std::string& from, const std::string& to, double sigma, int number) {
    const Transform Z{along_x(sigma * drawn(kSupplies + number)).pose, on_line(sigma * sigma)};
    const auto found = node_->observe(from, to, Z, at(1), {1.0, true});
    REQUIRE(found);
    REQUIRE(found->accepted);
  }
  [[nodiscard]] StampedTransform asked(const std::string& from, const std::string& to, Time when) {
    Query query;
    query.at = when;
    const auto X = node_->lookup(from, to, query);
    REQUIRE(X);
    return *X;
  }

 private:
  void tell(const std::string& id, int step, double by) {
    const double own = kOwn;
    REQUIRE(node_->update(id, {along_x(by * drawn(step)).pose, on_line(own * own)}, at(step)));
  }
  [[nodiscard]] double drawn(int number) const { return number == disturbed_ ? 1 : 0; }

  static constexpr double kOwn = 1e-6;
  LoopbackNetwork network_;
  std::optional<Node> node_;
  const int disturbed_;
};

TEST_CASE("instants: a measurement that says nothing does not make errors of two samples one") {
  Opposed line(-1);
  const double before = line.asked("world", "second", at(1)).covariance.if_complete()->upper()[0];
  CHECK(std::sqrt(before) == Approx(2 * kSupply).epsilon(1e-6));
  for (int number = 0; number < 3; ++number) {
    line.see("world", "second", 1000, number);
    const StampedTransform X = line.asked("world", "second", at(1));
    INFO("after " << number + 1);
    CHECK(X.covariance.if_complete()->upper()[0] == Approx(before).epsilon(1e-6));
    CHECK(X.basis.bound);
  }
}

TEST_CASE("instants: an observation between samples is honest for any relation of their errors") {
  struct Sighting {
    const char* from;
    const char* to;
    double sigma;
  };
  const std::vector<std::vector<Sighting>> plans = {
      {{"world", "second", 0.02}},
      {{"world", "second", 0.02}, {"first", "second", 0.03}},
      {{"first", "second", 0.01}, {"world", "second", 0.02}, {"world", "second", 0.02}}};
  const std::vector<std::pair<const char*, const char*>> paths = {
      {"world", "first"}, {"first", "second"}, {"world", "second"}};
  testing::Random random(7153);
  INFO("seed " << random.seed());
  for (const auto& plan : plans) {
    const int errors = kSupplies + static_cast<int>(plan.size());
    // What an answer has of each error, and what it claims.
    std::map<std::pair<std::size_t, int>, std::vector<double>> shares;
    std::map<std::pair<std::size_t, int>, double> claimed;
    for (int disturbed = 0; disturbed < errors; ++disturbed) {
      Opposed line(disturbed);
      for (std::size_t i = 0; i < plan.size(); ++i) {
        line.see(plan[i].from, plan[i].to, plan[i].sigma, static_cast<int>(i));
      }
      for (std::size_t i = 0; i < paths.size(); ++i) {
        for (const int tenths : {10, 15, 20, 25}) {
          const Time when = at(0) + std::chrono::milliseconds(10 * tenths);
          const StampedTransform X = line.asked(paths[i].first, paths[i].second, when);
          shares[{i, tenths}].push_back(X.pose.translation().x());
          claimed[{i, tenths}] = X.covariance.if_complete()->upper()[0];
        }
      }
    }
    for (const auto& [answer, all] : shares) {
      INFO("plan " << &plan - plans.data() << ", path " << answer.first << " at step "
                   << 0.1 * answer.second);
      for (int i = 0; i < 100; ++i) {
        Eigen::Vector3d of_supply = Eigen::Vector3d::Zero();
        double variance = 0;
        for (int k = 0; k < errors; ++k) {
          const double share = all[static_cast<std::size_t>(k)];
          if (k < kSupplies) {
            of_supply += share * random.direction();
          } else {
            variance += share * share;
          }
        }
        variance += of_supply.squaredNorm();
        CHECK(claimed[answer] >= variance * (1 - 1e-6));
      }
    }
  }
}

// Of two edges, only one has a sample at the step between.
TEST_CASE("instants: a source of two owners does not cancel between samples of one of them") {
  const int transport = GENERATE(from_range(testing::networks()));
  const auto join = testing::joined_by(transport);
  INFO("transport " << transport);
  const auto open = [&](const std::string& id) {
    FrameSpec frame{id, "world", Transform::exact({})};
    frame.timing = EdgeTiming();
    std::vector<FrameSpec> frames = {frame};
    if (id == "left") frames.insert(frames.begin(), {"world", "", {}});
    Node node = Node::open(join(id), id, frames).value();
    REQUIRE(node.correlate(id, {false, {{"supply", false, loading(kSupply)}}, {}}));
    return node;
  };
  Node left = open("left");
  Node right = open("right");
  Client client = Client::open(join("")).value();
  for (const int step : {0, 2}) REQUIRE(left.update("left", Transform::exact({}), at(step)));
  for (const int step : {0, 1}) REQUIRE(right.update("right", Transform::exact({}), at(step)));
  const auto watched = client.watch("left", "right");
  REQUIRE(watched);
  const auto check = [](const Result<StampedTransform>& X, bool same) {
    REQUIRE(X);
    const double sigma = std::sqrt(X->covariance.if_complete()->upper()[0]);
    CHECK(sigma == Approx(same ? 0 : 2 * kSupply).margin(1e-9));
    CHECK(X->basis.bound == !same);
    CHECK(X->basis.sources == std::vector<std::string>{"supply"});
  };
  Query between;
  between.at = at(1);
  REQUIRE(testing::eventually([&] { return client.lookup("left", "right", between).has_value(); }));
  REQUIRE(testing::eventually([&] { return watched->lookup(between).has_value(); }));
  check(client.lookup("left", "right", between), false);
  REQUIRE(testing::eventually([&] { return left.lookup("left", "right", between).has_value(); }));
  check(left.lookup("left", "right", between), false);
  check(watched->lookup(between), false);
  check(client.lookup("left", "right", Query{}), false);
  REQUIRE(right.update("right", Transform::exact({}), at(2)));
  const auto newest = [&](const auto& X) { return X && X->stamp == at(2); };
  REQUIRE(testing::eventually([&] { return newest(client.lookup("left", "right", Query{})); }));
  REQUIRE(testing::eventually([&] { return newest(watched->latest()); }));
  check(client.lookup("left", "right", Query{}), true);
  check(watched->latest(), true);
  // A static edge makes the source last, and so on all of the path.
  Node post = Node::open(join("post"), "post", {{"post", "world", Transform::exact({})}}).value();
  REQUIRE(post.correlate("post", {false, {{"supply", false, loading(kSupply)}}, {}}));
  REQUIRE(testing::eventually([&] { return client.lookup("left", "post", between).has_value(); }));
  check(client.lookup("left", "post", between), true);
}

}  // namespace
}  // namespace tfdude
