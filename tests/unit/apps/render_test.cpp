#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "tfdude/commands/echo.hpp"
#include "tfdude/commands/tree.hpp"
#include "tfdude/commands/velocity.hpp"

#include "rendering/json.hpp"
#include "rendering/text.hpp"
#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

using nlohmann::json;
using testing::Approx;
using testing::ContainsSubstring;

// Turned by (10, -20, 90) degrees, at (1, -2, 3); standard deviations of 1 to 3 cm and 1 to 3
// degrees.
Transform example() {
  constexpr double kTurn = 0.017453292519943295;  // a degree
  return {*Pose::create(from_rpy(10 * kTurn, -20 * kTurn, 90 * kTurn), {1, -2, 3}),
          *Covariance::from_stddev({0.01, 0.02, 0.03, kTurn, 2 * kTurn, 3 * kTurn})};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

// ---- draw_tree

TEST_CASE("an empty forest is rendered as an empty text") { CHECK(draw_tree({}, {}).empty()); }

TEST_CASE("a tree is rendered with its branches and owners") {
  const std::vector<Frame> frames{{"arm", "base", "arms", true},   {"base", "world", "robot", true},
                                  {"hand", "arm", "arms", true},   {"lamp", "world", "robot", true},
                                  {"mast", "base", "robot", true}, {"top", "mast", "robot", true},
                                  {"world", "", "robot", false}};
  CHECK(draw_tree(frames, {}) ==
        "world  [robot]\n"
        "├─ base  [robot]\n"
        "│  ├─ arm  [arms]\n"
        "│  │  └─ hand  [arms]\n"
        "│  └─ mast  [robot]\n"
        "│     └─ top  [robot]\n"
        "└─ lamp  [robot]\n");
}

TEST_CASE("unreachable partitions and frames that wait for a parent are marked") {
  const std::vector<Frame> frames{{"hand", "arm", "arms", false},
                                  {"ring", "hand", "legs", true},
                                  {"world", "", "robot", false}};
  CHECK(draw_tree(frames, {"legs", "wings"}) ==
        "hand  [arms]  (waits for 'arm')\n"
        "└─ ring  [legs, unreachable]\n"
        "world  [robot]\n");
}

// ---- describe

Shown in_degrees(bool covariance = false) { return {kDegree, covariance, false}; }

TEST_CASE("a transform is printed in metres and radians unless degrees are asked for") {
  CHECK(lines_of(describe(example(), {})) ==
        std::vector<std::string>{
            "translation  1.000000  -2.000000  3.000000  m",
            "quaternion   0.183013  -0.061628  0.704416  0.683013  (x y z w)",
            "rpy          0.174533  -0.349066  1.570796  rad",
            "std dev      0.020373  0.013850  0.028162  m   0.017453  0.034907  0.052360  rad",
            "             along the axes of A, about the axes of B"});
}

TEST_CASE("deviations stand beside the coordinates that they are of") {
  // Turned by 90 degrees about z: B's x is A's y.
  const Transform X{*Pose::create({std::sqrt(0.5), 0, 0, std::sqrt(0.5)}, {1, 2, 0}),
                    *Covariance::from_stddev({0.001, 0.1, 0.002, 0.01, 0.02, 0})};
  CHECK_THAT(describe(X, {kRadian, true, false}),
             ContainsSubstring(
                 "std dev      0.100000  0.001000  0.002000  m   0.010000  0.020000  0.000000  "
                 "rad\n"
                 "             along the axes of A, about the axes of B\n"
                 "covariance   ") &&
                 ContainsSubstring(" in B's axes\n"));
  CHECK_THAT(
      echo_lines("map", "hand", {X, {}, {}}, {}, kRadian),
      ContainsSubstring("    0.100000     0.001000     0.002000 m   along the axes of A\n") &&
          ContainsSubstring("    0.010000     0.020000     0.000000 rad about the axes of B\n"));
  const json answer = lookup_json("map", "hand", X, {});
  CHECK(answer["covariance_axes"] == "hand");
  CHECK(answer["covariance"][1][1].get<double>() == Approx(0.01));
}

TEST_CASE("joints that have had no sample are named") {
  CHECK(assumed_line({}).empty());
  CHECK(assumed_line({"pan"}) == "assumed      1 joint has had no sample: pan\n");
  CHECK(assumed_line({"lift", "pan"}) == "assumed      2 joints have had no sample: lift, pan\n");
}

TEST_CASE("the covariance of angles has the unit of the angles") {
  const Transform X = example();
  const auto rows = lines_of(matrix_table(X.covariance.of_specified().matrix(), kDegree));
  REQUIRE(rows.size() == 7);
  std::istringstream last(rows[6]);
  double value = 0;
  for (int column = 0; column < 6; ++column) last >> value;
  CHECK(value == Approx(9.0));  // 3° squared
  CHECK_THAT(describe(X, in_degrees(true)), ContainsSubstring("m, deg)"));
  CHECK_THAT(describe(X, {kRadian, true, false}), ContainsSubstring("m, rad)"));
}

TEST_CASE("a pose is printed as a matrix if asked for") {
  const Transform X = example();
  const auto lines = lines_of(describe(X, {kRadian, false, true}));
  REQUIRE(lines.size() == 6);
  const Eigen::Matrix4d matrix = X.pose.matrix();
  for (int row = 0; row < 4; ++row) {
    std::istringstream in(lines[static_cast<std::size_t>(row)].substr(row == 0 ? 6 : 0));
    for (int column = 0; column < 4; ++column) {
      double value = 0;
      REQUIRE(in >> value);
      CHECK(value == Approx(matrix(row, column)).margin(1e-9));
    }
  }
}

TEST_CASE("what is typed in degrees is converted where it is an angle") {
  TransformSpec spec;
  spec.rpy = {0, 90, -180};
  spec.stddev = {1, 2, 3, 180, 90, 0};
  spec.cov = Covariance::trusted(Matrix6d(Matrix6d::Ones())).upper();
  spec = in_radians(spec, kDegree);
  const double pi = std::acos(-1.0);
  CHECK((*spec.rpy)[1] == Approx(pi / 2));
  CHECK((*spec.stddev)[2] == 3);
  CHECK((*spec.stddev)[3] == Approx(pi));
  CHECK((*spec.cov)[upper_index(0, 2)] == 1);
  CHECK((*spec.cov)[upper_index(2, 3)] == Approx(pi / 180));
  CHECK((*spec.cov)[upper_index(3, 5)] == Approx(pi * pi / 180 / 180));
  TransformSpec radians;
  radians.rpy = {1, 2, 3};
  radians = in_radians(radians, kRadian);
  CHECK((*radians.rpy)[2] == 3);
}

TEST_CASE("a transform is printed in degrees") {
  CHECK(lines_of(describe(example(), in_degrees())) ==
        std::vector<std::string>{
            "translation  1.000000  -2.000000  3.000000  m",
            "quaternion   0.183013  -0.061628  0.704416  0.683013  (x y z w)",
            "rpy          10.0000  -20.0000  90.0000  deg",
            "std dev      0.020373  0.013850  0.028162  m   1.0000  2.0000  3.0000  deg",
            "             along the axes of A, about the axes of B"});
}

TEST_CASE("a covariance is printed as a matrix if asked for") {
  Transform X = example();
  Covariance::Upper upper = X.covariance.of_specified().upper();
  upper[upper_index(0, 1)] = -1e-5;
  X.covariance = *Covariance::from_upper(upper);
  const auto lines = lines_of(describe(X, {kRadian, true, false}));
  REQUIRE(lines.size() == 13);
  CHECK(lines[5].find("translation first") != std::string::npos);
  for (std::size_t row = 0; row < 6; ++row) {
    std::istringstream in(lines[7 + row]);
    for (int column = 0; column < 6; ++column) {
      double value = -1;
      REQUIRE(in >> value);
      const double expected = X.covariance.of_specified().matrix()(static_cast<int>(row), column);
      CHECK(std::abs(value - expected) <= 1e-5 * std::abs(expected));
    }
  }
  CHECK(lines[7].find("-1.00000e-05") != std::string::npos);
}

TEST_CASE("a covariance that is not complete is printed as that of the other edges") {
  Transform X = example();
  X.covariance.set_complete(false);
  CHECK(lines_of(describe(X, in_degrees(), {"odom", "a\nb"})) ==
        std::vector<std::string>{
            "translation  1.000000  -2.000000  3.000000  m",
            "quaternion   0.183013  -0.061628  0.704416  0.683013  (x y z w)",
            "rpy          10.0000  -20.0000  90.0000  deg",
            "std dev      unspecified for odom, a\\x0ab",
            "  of others  0.020373  0.013850  0.028162  m   1.0000  2.0000  3.0000  deg",
            "             along the axes of A, about the axes of B"});
  const std::string text = describe(X, in_degrees(true), {"odom"});
  CHECK(text.find("covariance   of the others") != std::string::npos);
}

TEST_CASE("extreme values are printed in full") {
  const Transform X{*Pose::create(Eigen::Quaterniond::Identity(), {-1e9, 1e9, 1e-9}),
                    *Covariance::from_stddev({1e9, 0, 0, 1e9, 0, 0})};
  const std::string text = describe(X, in_degrees(true));
  CHECK(text.find("translation  -1000000000.000000  1000000000.000000  0.000000  m\n") == 0);
  CHECK(text.find("1.00000e+18") != std::string::npos);
  CHECK(lines_of(text).size() == 13);
}

// ---- JSON

TEST_CASE("a lookup as JSON has all digits") {
  const Transform X = example();
  const json answer = json::parse(dump(lookup_json("world", "hand", X, {"robot", "arms"})));
  CHECK(answer["from"] == "world");
  CHECK(answer["to"] == "hand");
  CHECK(answer["partitions"] == json({"robot", "arms"}));
  CHECK(answer["translation"] == json({1.0, -2.0, 3.0}));
  const Eigen::Quaterniond q = X.pose.rotation();
  CHECK(answer["rotation"] == json({q.x(), q.y(), q.z(), q.w()}));
  REQUIRE(answer["covariance"].size() == 6);
  for (std::size_t i = 0; i < 36; ++i) {
    CHECK(answer["covariance"][i / 6][i % 6] ==
          X.covariance.of_specified()
              .upper()[upper_index(std::min(i / 6, i % 6), std::max(i / 6, i % 6))]);
  }
  CHECK(lookup_json("a", "a", Transform::exact({}), {})["partitions"] == json::array());
}

TEST_CASE("JSON has no covariance if it is not complete") {
  Transform X = example();
  CHECK_FALSE(lookup_json("a", "b", X, {}).contains("covariance_of_specified"));
  X.covariance.set_complete(false);
  const json answer = lookup_json("a", "b", X, {});
  CHECK(answer["covariance"].is_null());
  REQUIRE(answer["covariance_of_specified"].size() == 6);
  CHECK(answer["covariance_of_specified"][0][0] ==
        X.covariance.of_specified().upper()[upper_index(0, 0)]);
  Basis basis;
  basis.unspecified = {"odom"};
  CHECK(basis_json(basis)["unspecified"] == json({"odom"}));
}

TEST_CASE("a velocity is printed in metres and degrees per second") {
  Velocity velocity;
  velocity.linear = {1, -2, 0.5};
  velocity.angular = {0, 0, std::acos(-1) / 2};
  velocity.covariance = *Covariance::from_stddev({0.1, 0.1, 0.1, 0, 0, std::acos(-1) / 180});
  velocity.begin = time_of(0);
  velocity.end = time_of(100'000'000);
  velocity.basis.bound = true;
  CHECK(describe(velocity, in_degrees()) ==
        "linear       1.000000  -2.000000  0.500000  m/s\n"
        "angular      0.0000  0.0000  90.0000  deg/s\n"
        "std dev      0.100000  0.100000  0.100000  m/s\n"
        "             0.0000  0.0000  1.0000  deg/s\n"
        "from         0.000000000\n"
        "to           0.100000000\n"
        "correlation  of some edges is not known: the std dev is an upper bound\n");
  const json all = velocity_json("world", "hand", velocity);
  CHECK(all["linear"] == json({1.0, -2.0, 0.5}));
  CHECK(all["begin_ns"] == 0);
  CHECK(all["covariance"].size() == 6);
  velocity.covariance.set_complete(false);
  velocity.basis.unspecified = {"odom"};
  CHECK(describe(velocity, in_degrees()).find("std dev      unspecified for odom\n  of others  ") !=
        std::string::npos);
  CHECK(velocity_json("world", "hand", velocity)["covariance"].is_null());
  CHECK(describe(Velocity{}, in_degrees()).find("interval     none: all edges are static") !=
        std::string::npos);
}

TEST_CASE("a frame as JSON has null for no parent") {
  CHECK(frame_json({"world", "", "robot", false}) ==
        json({{"id", "world"}, {"parent", nullptr}, {"partition", "robot"}, {"attached", false}}));
  CHECK(frame_json({"hand", "arm", "arms", true})["parent"] == "arm");
}

TEST_CASE("a partition as JSON has its process and state") {
  PartitionInfo info;
  info.name = "arms";
  info.host = "tower";
  info.pid = 7;
  info.frames = 3;
  info.reachable = true;
  info.program = "0.1.0";
  info.clock = ClockKind::kSystem;
  json said{{"name", "arms"},    {"host", "tower"},    {"pid", 7},          {"frames", 3},
            {"reachable", true}, {"program", "0.1.0"}, {"protocol", "1.1"}, {"clock", "system"}};
  CHECK(partition_json(info) == said);
  info.reachable = false;
  said["reachable"] = false;
  said["reason"] = "lost";
  CHECK(partition_json(info) == said);
  info.stopped = true;
  said["reason"] = "stopped";
  CHECK(partition_json(info) == said);
  info.clock = ClockKind::kExternal;
  said["clock"] = "external";
  CHECK(partition_json(info) == said);
  info.protocol = {2, 0};
  info.clock.reset();
  said.erase("clock");
  said["protocol"] = "2.0";
  said["reason"] = "incompatible";
  CHECK(partition_json(info) == said);
}

TEST_CASE("JSON is one line whatever the texts contain") {
  const std::string text = dump({{"message", "a\nb \xff \"c\" \xc3\xa4"}});
  CHECK(text == "{\"message\":\"a\\nb \xef\xbf\xbd \\\"c\\\" \xc3\xa4\"}");
}

}  // namespace
}  // namespace tfdude::cli
