// Tables that people read in a terminal of 80 columns.

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>

#include "tfdude/commands/echo.hpp"
#include "tfdude/commands/history.hpp"
#include "tfdude/commands/joint.hpp"
#include "tfdude/commands/joints.hpp"
#include "tfdude/commands/monitor.hpp"
#include "tfdude/commands/partitions.hpp"

#include "rendering/format.hpp"
#include "rendering/json.hpp"
#include "rendering/table.hpp"
#include "rendering/text.hpp"
#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

using testing::ContainsSubstring;

const std::string kLong = "left_arm_of_the_second_robot_shoulder_pan_joint";

std::size_t width_of(const std::string& table) {
  std::istringstream lines(table);
  std::size_t width = 0;
  for (std::string line; std::getline(lines, line);) width = std::max(width, length_of(line));
  return width;
}

JointInfo shoulder() {
  JointInfo joint;
  joint.name = "shoulder_pan_joint";
  joint.frame = "shoulder_link";
  joint.type = JointType::kRevolute;
  joint.position = -3.14159;
  joint.variance = 13.2;
  joint.limits = JointLimits{-6.28318, 6.28318};
  joint.outside = 3;
  return joint;
}

// Everything in it is as long as it can be.
JointInfo longest() {
  JointInfo joint = shoulder();
  joint.name = joint.frame = kLong;
  joint.type = JointType::kPrismatic;
  joint.position = -1e9;
  joint.variance = 1e18;
  joint.limits = JointLimits{-1e9, 1e9};
  joint.mimic = Mimic{kLong + kLong, -1.23456e-300, -1.23456e-300};
  joint.outside = joint.refused = UINT64_MAX / 1'000'000'000;
  return joint;
}

HistoryInfo history_of(const std::string& id) {
  HistoryInfo history;
  history.id = id;
  history.samples = 2000;
  history.newest = Time(std::chrono::seconds(1'000'000));
  history.oldest = *history.newest - std::chrono::seconds(2);
  history.mean_gap = std::chrono::milliseconds(1);
  history.refused_old = 1'000'000;
  return history;
}

}  // namespace

TEST_CASE("tables: joints have a header and fit 80 columns") {
  const std::string table = joint_table({shoulder()}, kDegree);
  CHECK(table ==
        "  joint              frame             position   std dev unit limits\n"
        "  shoulder_pan_joint shoulder_link     -180.000   208.166 deg  -360..360\n"
        "    no sample yet\n"
        "    outside 3 times\n");
  CHECK(width_of(outside_table({shoulder()}, kDegree)) <= 80);
  CHECK(joint_table({}, kDegree).empty());
}

TEST_CASE("tables: joints are in radians unless degrees are asked for") {
  CHECK_THAT(joint_table({shoulder()}, kRadian),
             ContainsSubstring(" -3.14159   3.63318 rad  -6.283..6.283\n"));
  CHECK(width_of(joint_table({shoulder(), longest()}, kRadian)) <= 80);
  CHECK(position_text(shoulder(), 0.5, kRadian) == "0.5 rad");
  CHECK(position_text(shoulder(), -7, kRadian) == "-7 rad, outside its limits -6.283..6.283 rad");
  CHECK(position_text(shoulder(), -7, kDegree) == "-401.07 deg, outside its limits -360..360 deg");
}

TEST_CASE("tables: long names and numbers of joints fit 80 columns") {
  JointInfo head = shoulder();
  head.limits = JointLimits{-2.7995, 2.7995};
  CHECK_THAT(joint_table({head}, kDegree), ContainsSubstring("-160.4..160.4"));
  CHECK(width_of(joint_table({head, longest()}, kDegree)) <= 80);
  CHECK(width_of(outside_table({head, longest()}, kDegree)) <= 80);
  CHECK_THAT(joint_table({longest()}, kDegree), ContainsSubstring("  left_arm…pan_joint "));
}

TEST_CASE("tables: joints of one name in several partitions are named") {
  JointInfo mimic = shoulder();
  mimic.mimic = Mimic{"elbow", 1, 0};
  SameNames same;
  same.add("left", {shoulder()});
  same.add("right", {shoulder()});
  same.add("tool", {mimic});
  CHECK(same.others("left", shoulder()) == std::vector<std::string>{"right"});
  CHECK(same.others("tool", mimic).empty());
  CHECK(same.warnings("left", {shoulder()}) ==
        "    conflict: shoulder_pan_joint is also a joint of right; publish it as "
        "left/shoulder_pan_joint\n");
  CHECK(same.warnings("tool", {mimic}).empty());
}

TEST_CASE("tables: rates of edges fit 80 columns") {
  const HistoryInfo history = history_of("shoulder_link");
  const std::string table = monitor_table("arm", {history}, *history.newest);
  CHECK_THAT(table, ContainsSubstring("rate [Hz]"));
  CHECK(width_of(table) <= 80);
}

TEST_CASE("tables: long names and numbers of edges fit 80 columns") {
  HistoryInfo history = history_of(kLong);
  history.refused_old = UINT64_MAX / 2;
  history.mean_gap = std::chrono::nanoseconds(1);
  history.max_gap = history.jitter = std::chrono::hours(100'000);
  history.bytes = 100'000'000;
  const Time later = *history.newest + std::chrono::hours(500'000);
  CHECK(width_of(monitor_table(kLong, {history, history_of("a")}, later)) <= 80);
  history.refused_old = history.refused_equal = history.refused_ahead = 1'000'000;
  CHECK(width_of(describe(history, later)) <= 80);
  CHECK(width_of(echo_lines(kLong, kLong, {}, later, kRadian)) <= 80);
}

TEST_CASE("tables: observed edges fit 80 columns") {
  EdgeConsistency edge;
  edge.id = "shoulder_link";
  edge.observations = 1'000'000;
  const std::string table = consistency_table({edge});
  CHECK_THAT(table, ContainsSubstring("observed edge"));
  CHECK(width_of(table) <= 80);
  edge.id = kLong;
  edge.observations = edge.refused = UINT64_MAX;
  edge.sum = {1e300, 1e-8, 1e-300};
  CHECK(width_of(consistency_table({edge})) <= 80);
}

TEST_CASE("tables: partitions have a header and fit 80 columns") {
  PartitionInfo base;
  base.name = "base";
  base.host = "robot";
  base.pid = 4711;
  base.frames = 12;
  base.reachable = true;
  PartitionInfo lost = base;
  lost.name = lost.host = kLong;
  lost.pid = 4'194'304;
  lost.frames = 100'000;
  lost.reachable = false;
  PartitionInfo unknown;
  unknown.name = "arm";
  const std::string table =
      partition_table({{base, HistorySum{100, 204'800, 67'108'864}}, {lost, {}}, {unknown, {}}});
  CHECK(table ==
        "partition            frames host                  pid    samples      history\n"
        "base                     12 robot                4711     204800  65536.0 KiB\n"
        "left_arm…pan_joint   100000 left_ar…an_joint  4194304          -            -\n"
        "  lost since 1970-01-01 00:00:00.000 UTC\n"
        "arm                       - -                       -          -            -\n"
        "  lost since 1970-01-01 00:00:00.000 UTC\n");
  CHECK(width_of(table) <= 80);
}

TEST_CASE("tables: a transform with its covariance fits 80 columns") {
  const Transform X{*Pose::create(Eigen::Quaterniond::Identity(), {-1234.5, 1234.5, 0}),
                    *Covariance::from_stddev({123, 123, 123, 3, 3, 3})};
  const std::string text = describe(X, {kRadian, true, false});
  CHECK_THAT(text, ContainsSubstring("            x            y            z           rx"));
  CHECK(width_of(text) <= 80);
}

TEST_CASE("tables: the middle of a long name is left out") {
  CHECK(shortened("shoulder", 8) == "shoulder");
  CHECK(shortened("shoulders", 8) == "sho…ders");
  CHECK(shortened("äöüäöüäöü", 4) == "ä…öü");
  CHECK(cell("é", 3) == "é  ");
  CHECK(number(1234.5, 1, 6) == "1234.5");
  CHECK(number(-123456789.0, 1, 10) == "-1.23e+08");
}

TEST_CASE("a number that is printed as zero has no sign") {
  CHECK(format("%.3f", -0.0) == "0.000");
  CHECK(format("%.3f %.3f|%7.2f", -4e-4, -6e-4, -1e-3) == "0.000 -0.001|   0.00");
  CHECK(format("%s %.*f %d%% %.1f", "-0.0", 2, -1e-3, -0, -0.01) == "-0.0 0.00 0% 0.0");
  CHECK(format("%*.1f %-8.1f|", 6, -0.01, -0.01) == "   0.0 0.0     |");
  CHECK(format("% .2e %g %+.1f %f", -0.0, -0.0, -0.0, -1e-7) == " 0.00e+00 0 +0.0 0.000000");
  CHECK(format("%.0f %.0f", -0.5, -0.6) == "0 -1");
  CHECK(format("%g %.2e", -1e-300, -1e-300) == "-1e-300 -1.00e-300");
  CHECK(format("%.1f", -std::numeric_limits<double>::infinity()) == "-inf");
  CHECK(dump({{"a", -0.0}, {"b", {{"c", {-0.0, -1.5, 0}}}}, {"d", "-0.0"}}) ==
        R"({"a":0.0,"b":{"c":[0.0,-1.5,0]},"d":"-0.0"})");
}

}  // namespace tfdude::cli
