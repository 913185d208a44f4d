#include "tfdude-ros/config/config.hpp"

#include <map>
#include <string>

#include "support/catch.hpp"

namespace tfdude::ros {
namespace {

using testing::ContainsSubstring;

std::string error_of(const std::string& text) {
  Settings settings;
  const auto read = parse_config(text, "bridge.yaml", settings);
  return read ? "" : read.error().message;
}

Result<Settings> in_environment(const std::map<std::string, std::string>& variables) {
  Settings settings;
  const auto read = read_environment(
      [&](const char* name) {
        const auto found = variables.find(name);
        return found == variables.end() ? std::string() : found->second;
      },
      settings);
  if (!read) return tl::unexpected(read.error());
  return settings;
}

}  // namespace

TEST_CASE("ros config: every key") {
  Settings settings;
  const auto read = parse_config(R"(
partition: from_ros
ros_domain: 7
clock: ros
prefix: r1/
tf_in: {frames: ["odom", "base*"], except: [base_old], covariance: exact}
tf_out: {partitions: [arm], frames: [tool], rate: 30}
joints_in: {stddev: 0.001, stddev_of: {lift: 0.01}, except: [gripper]}
joints_out: {partitions: ["*"], rate: 20}
description_in: {partition: bot, root: world, xyz: [1, 0, 0], links: [base], strict_limits: true,
                 fixed: exact}
description_out: robot.urdf
poses_in:
  - {topic: /gps, child: base, gate: 0.99, correlated: true}
  - {topic: /odom, type: odometry}
poses_out:
  - {topic: /tool, frame: world, child: tool, rate: 5}
  - {topic: /tool_odometry, type: odometry, frame: world, child: tool}
)",
                                 "/etc/bridge.yaml", settings);
  REQUIRE(read);
  CHECK(settings.partition == "from_ros");
  CHECK(settings.ros_domain == 7);
  CHECK(settings.frames_in->frames.takes("base_link"));
  CHECK(!settings.frames_in->frames.takes("base_old"));
  CHECK(settings.frames_in->covariance.complete());
  CHECK(settings.frames_in->prefix == "r1/");
  CHECK(settings.frames_out->partitions.match("arm"));
  CHECK(settings.frames_out->rate == 30);
  CHECK(settings.joints_in->stddev_of.at("lift") == 0.01);
  CHECK(settings.joints_out->rate == 20);
  CHECK(settings.description_in->partition == "bot");
  CHECK(settings.description_in->part.root == "world");
  CHECK(settings.description_in->part.prefix == "r1/");
  CHECK(settings.description_in->part.strict_limits);
  CHECK(settings.description_in->part.fixed.complete());
  CHECK(settings.description_out->file == "/etc/robot.urdf");
  REQUIRE(settings.poses_in.size() == 2);
  CHECK(settings.poses_in[0].options.gate == 0.99);
  CHECK(!settings.poses_in[0].options.independent);
  CHECK(settings.poses_in[1].odometry);
  REQUIRE(settings.poses_out.size() == 2);
  CHECK(settings.poses_out[0].rate == 5);
  CHECK(!settings.poses_out[0].odometry);
  CHECK(settings.poses_out[1].odometry);
  CHECK(settings.passes_clock);
  CHECK(settings.options.clock == ClockKind::kExternal);
}

TEST_CASE("ros config: the description may be that of a partition") {
  Settings settings;
  REQUIRE(parse_config("description_out: {partition: arm}\n", "f", settings));
  CHECK(settings.description_out->partition == "arm");
  CHECK(settings.description_out->file.empty());
  CHECK_THAT(error_of("description_out: {}\n"), ContainsSubstring("partition is missing"));
  CHECK_THAT(error_of("description_out: {partition: 'a,b'}\n"),
             ContainsSubstring("description_out"));
  CHECK_THAT(error_of("description_out: {file: a}\n"), ContainsSubstring("unknown key"));
}

TEST_CASE("ros config: values, objects, and how to read their covariances") {
  Settings settings;
  const auto read = parse_config(R"(
prefix: r1/
tf_in: {except: [x]}
drifts: {base_link: [0.1, 0.1, 0, 0, 0, 0.2], /wheel: [0, 0, 0, 0, 0, 0.3]}
values_in:
  - {topic: /odom, type: odometry}
  - topic: /amcl_pose
    child: base_link
    edge: odom
    covariance: {all_zero: exact, zero: none, minus_one: none, none_from: 9999,
                 per_metre: [0, 0, 0.1, 0, 0, 0]}
  - {topic: /fix, type: navsat, child: gps, frame: site/earth}
  - {topic: /geopose, type: geopose, child: base_link, edge: map}
poses_in:
  - {topic: /gps, child: base_link, covariance: {stddev: [1, 1, 2, 3, 3, 3]}}
  - {topic: /fix, type: navsat, child: base_link}
detections_in:
  - {topic: /tags, type: isaac_apriltag, ids: ["7"], except: ["70"], under: odom, gate: 0.9,
     drop_after: 5, frame: "t{}"}
  - {topic: /tf, type: tf, ids: ["tag36h11:*"]}
  - {topic: /markers, type: aruco}
)",
                                 "f", settings);
  REQUIRE(read);
  CHECK(import_of(settings).prefix == "r1/");
  CHECK(import_of(settings).drifts.at("base_link").upper() ==
        Covariance::from_stddev({0.1, 0.1, 0, 0, 0, 0.2})->upper());
  CHECK(import_of(settings).drifts.count("wheel") == 1);
  CHECK(!import_of(settings).frames.takes("x"));
  REQUIRE(settings.values_in.size() == 4);
  CHECK(settings.values_in[2].geodetic == MessageType::kNavSatFix);
  CHECK(settings.values_in[2].frame == "site/earth");
  CHECK(settings.values_in[3].geodetic == MessageType::kGeoPoseStamped);
  CHECK(settings.values_in[3].frame == "earth");
  CHECK(settings.values_in[3].edge == "map");
  CHECK_FALSE(settings.values_in[0].geodetic);
  REQUIRE(settings.poses_in.size() == 2);
  CHECK(settings.poses_in[1].geodetic == MessageType::kNavSatFix);
  CHECK(settings.values_in[0].odometry);
  CHECK(settings.values_in[0].prefix == "r1/");
  const ValueIn& amcl = settings.values_in[1];
  CHECK(amcl.edge == "odom");
  CHECK(amcl.variances.all_zero_is_exact);
  CHECK(amcl.variances.zero_is_none);
  CHECK(amcl.variances.minus_one_is_none);
  CHECK(amcl.variances.none_from == 9999);
  REQUIRE(amcl.variances.stddev);
  CHECK(amcl.variances.stddev->per_metre[2] == 0.1);
  CHECK(settings.poses_in[0].variances.stddev->constant[2] == 2);
  REQUIRE(settings.detections_in.size() == 3);
  const DetectionsIn& tags = settings.detections_in[0];
  CHECK(tags.type == MessageType::kAprilTagDetectionArray);
  CHECK(tags.ids.takes("7"));
  CHECK(!tags.ids.takes("70"));
  CHECK(tags.under == "odom");
  CHECK(tags.options.gate == 0.9);
  CHECK(tags.drop_after == 5.0);
  CHECK(tags.frame == "t{}");
  CHECK(tags.prefix == "r1/");
  CHECK(settings.detections_in[1].frame == "{}");
  CHECK(settings.detections_in[2].frame == "tag_{}");

  CHECK_THAT(error_of("values_in: [{topic: /p}]\n"), ContainsSubstring("child is missing"));
  CHECK_THAT(error_of("values_in: [{topic: /p, type: navsat}]\n"),
             ContainsSubstring("child is missing"));
  CHECK_THAT(error_of("values_in: [{topic: /p, type: navsat, child: a, edge: b}]\n"),
             ContainsSubstring("a position only"));
  CHECK_THAT(error_of("values_in: [{topic: /p, child: a, frame: earth}]\n"),
             ContainsSubstring("frame is only for navsat and geopose"));
  CHECK_THAT(error_of("values_in: [{topic: /p, child: a, edge: a}]\n"),
             ContainsSubstring("leave it out"));
  CHECK_THAT(error_of("values_in: [{topic: /p, child: a, covariance: {zero: odd}}]\n"),
             ContainsSubstring("covariance: zero is neither exact nor none"));
  CHECK_THAT(error_of("values_in: [{topic: /p, child: a, covariance: {stddev: [1]}}]\n"),
             ContainsSubstring("not 6 numbers"));
  CHECK_THAT(error_of("drifts: {base: [1, 1, 1, 1, 1, -1]}\n"), ContainsSubstring("drifts"));
  CHECK_THAT(error_of("detections_in: [{topic: /tf, type: tf}]\n"),
             ContainsSubstring("ids is missing"));
  CHECK_THAT(error_of("detections_in: [{topic: /t, type: dots}]\n"),
             ContainsSubstring("type is none of"));
}

TEST_CASE("ros config: what would count twice, or for nothing, is rejected") {
  for (const char* topic : {"a b", "", "/", "//a", "/a/", "/a//b", "/1a", "~/a", "/a-b", "{x}"}) {
    INFO(topic);
    const std::string entry = "[{topic: \"" + std::string(topic) + "\", child: a}]\n";
    for (const char* section : {"values_in: ", "poses_in: "}) {
      CHECK_THAT(error_of(section + entry), ContainsSubstring("is no name of a topic"));
    }
  }
  CHECK(error_of("poses_in: [{topic: a_1/B, child: a}, {topic: /a_1/B, child: b}]\n").empty());
  for (const char* section : {"values_in: ", "poses_in: "}) {
    CHECK_THAT(error_of(std::string(section) + "[{topic: /p, child: a}, {topic: p, child: a}]\n"),
               ContainsSubstring("[1]: an entry before has this topic and child"));
  }
  const std::string tags = "topic: /t, type: aruco";
  CHECK_THAT(error_of("detections_in: [{" + tags + ", frame: dock}]\n"),
             ContainsSubstring("frame needs {}, the object's id, unless ids is one name"));
  CHECK_THAT(error_of("detections_in: [{" + tags + ", frame: dock, ids: ['7*']}]\n"),
             ContainsSubstring("frame needs {}"));
  CHECK(error_of("detections_in: [{" + tags + ", frame: dock, ids: ['7']}]\n").empty());
}

TEST_CASE("ros config: the robot of a description is a partition of its own") {
  Settings settings;
  REQUIRE(parse_config("partition: x\ndescription_in: {partition: x}\n", "f", settings));
  const auto same = check_partitions(settings);
  REQUIRE_FALSE(same);
  CHECK_THAT(same.error().message, ContainsSubstring("description_in needs another one"));
  settings.partition = "y";
  CHECK(check_partitions(settings));
  CHECK(check_partitions(Settings()));
}

TEST_CASE("ros config: what is left out stays as it is") {
  Settings settings;
  REQUIRE(parse_config("partition: x\n", "f", settings));
  CHECK(settings.frames_in);
  CHECK(!settings.frames_in->covariance.complete());
  CHECK(!settings.frames_out);
  CHECK(!settings.joints_in);
  REQUIRE(parse_config("tf_in: false\n", "f", settings));
  CHECK(!settings.frames_in);
}

TEST_CASE("ros config: mistakes are named with their line") {
  CHECK_THAT(error_of("partitio: x\n"), ContainsSubstring("bridge.yaml:1: the file: unknown key"));
  CHECK_THAT(error_of("joints_in: {stddev: -1}\n"), ContainsSubstring("is not within"));
  CHECK_THAT(error_of("ros_domain: 233\n"), ContainsSubstring("ros_domain is not within"));
  CHECK_THAT(error_of("tf_out: {rate: fast}\n"), ContainsSubstring("not a number"));
  CHECK_THAT(error_of("tf_out:\n  frames: tool\n"), ContainsSubstring("bridge.yaml:2"));
  CHECK_THAT(error_of("poses_in: [{topic: /p}]\n"), ContainsSubstring("child is missing"));
  CHECK_THAT(error_of("poses_in: [{topic: /p, type: twist}]\n"), ContainsSubstring("neither"));
  CHECK_THAT(error_of("poses_out: [{topic: /p, frame: a}]\n"),
             ContainsSubstring("child is missing"));
  CHECK_THAT(error_of("description_in: {partition: 'a,b'}\n"), ContainsSubstring("description_in"));
  CHECK_THAT(error_of("tf_in: {covariance: large}\n"), ContainsSubstring("covariance"));
  CHECK_THAT(error_of("a: [\n"), ContainsSubstring("not YAML"));
  CHECK_THAT(error_of("clock_out: {}\n"), ContainsSubstring("clock_out needs clock: external"));
  CHECK_THAT(error_of("clock: ros\nclock_out: {}\n"), ContainsSubstring("needs clock: external"));
  CHECK(error_of("clock: external\nclock_out: {rate: 5}\n").empty());
  CHECK_THAT(error_of("clock: sundial\n"), ContainsSubstring("bridge.yaml:1: clock must be"));
  CHECK_THAT(error_of(""), ContainsSubstring("is empty"));
}

TEST_CASE("ros config: the environment of ROS is heeded") {
  CHECK(in_environment({})->ros_domain == 0);
  CHECK(in_environment({})->range == Range::kNetwork);
  CHECK(in_environment({{"ROS_DOMAIN_ID", "42"}})->ros_domain == 42);
  CHECK(in_environment({{"ROS_LOCALHOST_ONLY", "1"}})->range == Range::kThisComputer);
  CHECK(in_environment({{"ROS_LOCALHOST_ONLY", "0"}})->range == Range::kNetwork);
  const char* const kRange = "ROS_AUTOMATIC_DISCOVERY_RANGE";
  CHECK(in_environment({{kRange, "LOCALHOST"}})->range == Range::kThisComputer);
  CHECK(in_environment({{kRange, "SUBNET"}})->range == Range::kNetwork);
  CHECK(in_environment({{kRange, "SYSTEM_DEFAULT"}})->range == Range::kNetwork);
  CHECK(in_environment({{kRange, "SUBNET"}, {"ROS_LOCALHOST_ONLY", "1"}})->range ==
        Range::kThisComputer);
  for (const char* bad : {"OFF", "EVERYWHERE"}) CHECK(!in_environment({{kRange, bad}}));
  for (const char* bad : {"-1", "233", "1x", "x"}) CHECK(!in_environment({{"ROS_DOMAIN_ID", bad}}));
}

}  // namespace tfdude::ros
