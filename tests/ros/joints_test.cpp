#include "tfdude-ros/logic/joints.hpp"

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::ros {
namespace {

using Names = std::vector<std::string>;

JointInfo joint(const std::string& name, double position, bool measured = true) {
  JointInfo info;
  info.name = name;
  info.position = position;
  info.measured = measured;
  return info;
}

}  // namespace

TEST_CASE("ros joints: positions get the variances of the settings, and the prefix") {
  JointImport import({0.1, {{"lift", 0.5}}, {Patterns(), Patterns({"gripper_*"})}, "r1/"});
  const auto taken = import.take({time_of(7), {"elbow", "lift", "gripper_left"}, {1.0, 2.0, 3.0}});
  CHECK(taken.stamp == time_of(7));
  REQUIRE(taken.joints.size() == 2);
  CHECK(taken.joints[0].name == "r1/elbow");
  CHECK(taken.joints[0].position == 1);
  CHECK(taken.joints[0].variance == 0.1 * 0.1);
  CHECK(taken.joints[1].name == "r1/lift");
  CHECK(taken.joints[1].position == 2);
  CHECK(taken.joints[1].variance == 0.25);
  CHECK(import.counts().taken == 2);
  CHECK(import.counts().refused == 0);
}

TEST_CASE("ros joints: joints without a usable position or name are counted") {
  JointImport import({});
  const auto taken = import.take(
      {Time(), {"a", "", std::string(256, 'x'), "a", "b", "c"}, {1, 2, 3, 4, std::nan("")}});
  REQUIRE(taken.joints.size() == 1);
  CHECK(taken.joints[0].name == "a");
  CHECK(taken.joints[0].position == 1);
  CHECK_FALSE(taken.joints[0].variance);  // nobody has given one
  CHECK(!taken.stamp);
  CHECK(import.counts().refused == 5);
}

TEST_CASE("ros joints: positions go to the joints of the given partition") {
  JointImportSettings settings;
  settings.prefix = "r1_";
  settings.partition = "left";
  JointImport import(settings);
  const auto taken = import.take({Time(), {"elbow"}, {1}});
  REQUIRE(taken.joints.size() == 1);
  CHECK(taken.joints[0].name == "left/r1_elbow");
}

TEST_CASE("ros joints: joints that several partitions have are not sent") {
  JointExport out({});
  JointState message;
  out.add({joint("elbow", 1), joint("wrist", 2)}, message);
  out.add({joint("elbow", 3)}, message);
  CHECK(JointExport::drop_repeated(message) == std::set<std::string>{"elbow"});
  CHECK(message.names == Names{"wrist"});
  CHECK(message.positions == std::vector<double>{2});
  CHECK(JointExport::drop_repeated(message).empty());
}

TEST_CASE("ros joints: unusual stamps are counted, and each is reported once") {
  JointImport import({});
  const auto reports = [&](std::int64_t stamp, double position) {
    const auto taken = import.take({time_of(stamp), {"elbow"}, {position}});
    CHECK(taken.joints.size() == 1);
    CHECK(taken.stamp == (stamp == 0 ? std::nullopt : std::optional<Time>(time_of(stamp))));
    return taken.reports.size();
  };
  CHECK(reports(7, 1) == 0);
  CHECK(reports(7, 1) == 0);
  CHECK(import.stamps().counts().same == 1);
  CHECK(reports(7, 2) == 1);
  CHECK(reports(7, 3) == 0);
  CHECK(import.stamps().counts().repeated == 2);
  CHECK(reports(0, 1) == 1);
  CHECK(reports(0, 2) == 0);
  CHECK(import.stamps().counts().unstamped == 2);
  CHECK(reports(5, 1) == 0);
  CHECK(import.stamps().counts().repeated == 2);
}

TEST_CASE("ros joints: measured joints are sent, unless a node of ROS publishes them") {
  JointExportSettings settings;
  settings.prefix = "r1/";
  JointExport out(settings);
  for (int i = 0; i < 10'000; ++i) {
    out.heard({Time(), {std::string(256, 'x') + std::to_string(i)}, {0}});  // names of no joint
  }
  out.heard({Time(), {"wrist"}, {0}});
  JointState message;
  out.add(
      {joint("r1/elbow", 1), joint("r1/wrist", 2), joint("r1/lift", 3, false), joint("other", 4)},
      message);
  CHECK(message.names == Names{"elbow"});
  CHECK(message.positions == std::vector<double>{1});
}

}  // namespace tfdude::ros
