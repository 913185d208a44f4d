// Tables that people read in a terminal of 80 columns.

#include <algorithm>
#include <sstream>
#include <string>

#include "tfdude/joint_render.hpp"
#include "tfdude/time_render.hpp"
#include "tfdude/uncertainty_render.hpp"

#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

std::size_t width_of(const std::string& table) {
  std::istringstream lines(table);
  std::size_t width = 0;
  for (std::string line; std::getline(lines, line);) width = std::max(width, line.size());
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

}  // namespace

TEST_CASE("tables: joints have a header, and fit 80 columns") {
  const std::string table = joint_table({shoulder()});
  CHECK(table ==
        "  joint                frame                position     std dev limits\n"
        "  shoulder_pan_joint   shoulder_link    -180.000 deg 208.166 deg -360 to 360 deg\n"
        "    no sample yet  outside 3 times\n");
  CHECK(width_of(table) <= 80);
  CHECK(width_of(outside_table({shoulder()})) <= 80);
  CHECK(joint_table({}).empty());
}

TEST_CASE("tables: rates of edges fit 80 columns") {
  HistoryInfo history;
  history.id = "shoulder_link";
  history.samples = 2000;
  history.newest = Time(std::chrono::seconds(1'000'000));
  history.oldest = *history.newest - std::chrono::seconds(2);
  history.mean_gap = std::chrono::milliseconds(1);
  history.refused_old = 1'000'000;
  const std::string table = monitor_table("arm", {history}, *history.newest);
  CHECK_THAT(table, testing::ContainsSubstring("rate [Hz]"));
  CHECK(width_of(table) <= 80);
}

TEST_CASE("tables: observed edges fit 80 columns") {
  EdgeConsistency edge;
  edge.id = "shoulder_link";
  edge.observations = 1'000'000;
  const std::string table = consistency_table({edge});
  CHECK_THAT(table, testing::ContainsSubstring("observed edge"));
  CHECK(width_of(table) <= 80);
}

}  // namespace tfdude::cli
