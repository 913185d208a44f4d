#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "tfdude/base/id.hpp"
#include "tfdude/description/config.hpp"

#include "support/catch.hpp"

TEST_CASE("a joint's origin may have its former name mount") {
  for (const std::string key : {"origin", "mount"}) {
    INFO(key);
    const auto config =
        tfdude::parse_config("urdf:\n  - file: robots/ur5e.urdf\n    joints: {elbow_joint: {" +
                                 key + ": {stddev: [0, 0, 0.2, 0, 0, 0]}}}\n",
                             TFDUDE_EXAMPLES "/robot.yaml");
    REQUIRE(config.has_value());
    const auto& elbow = *config->frames.at(3).joint;
    CHECK(elbow.name == "elbow_joint");
    CHECK(elbow.joint.X_PJ.covariance.of_specified().stddev()[2] == tfdude::testing::Approx(0.2));
  }
}

TEST_CASE("a configuration may include URDFs") {
  const auto config = tfdude::parse_config(
      "frames: [{id: world}]\n"
      "urdf:\n"
      "  - file: robots/ur5e.urdf\n"
      "    root: world\n"
      "    xyz: [1, 2, 3]\n"
      "    stddev: [0.1, 0, 0, 0, 0, 0]\n"
      "    prefix: a_\n"
      "    strict_limits: true\n"
      "    joints:\n"
      "      elbow_joint: {position: 0.5, stddev: 0.01, origin: {stddev: [0, 0, 0.2, 0, 0, 0]}}\n"
      "      shoulder_pan_joint: {sample_stddev: 0.002}\n"
      "  - {file: robots/ur5e.urdf, prefix: b_, links: [base_link..forearm_link, tool0]}\n",
      TFDUDE_EXAMPLES "/robot.yaml");
  INFO((config ? "" : config.error().message));
  REQUIRE(config.has_value());
  REQUIRE(config->frames.size() == 1 + 8 + 5);
  CHECK(config->places.size() == config->frames.size());
  const auto& base = config->frames[1];
  CHECK(base.id == "a_base_link");
  CHECK(base.parent == "world");
  CHECK(base.X_PC.pose.translation() == Eigen::Vector3d(1, 2, 3));
  CHECK(base.X_PC.covariance.of_specified().stddev()[0] == tfdude::testing::Approx(0.1));
  const auto& elbow = *config->frames[4].joint;
  CHECK(elbow.name == "a_elbow_joint");
  CHECK(elbow.position == 0.5);
  CHECK(*elbow.variance == tfdude::testing::Approx(1e-4));
  CHECK(elbow.strict);
  CHECK(elbow.joint.X_PJ.covariance.of_specified().stddev()[2] == tfdude::testing::Approx(0.2));
  CHECK_FALSE(elbow.sample_variance);
  CHECK(*config->frames[2].joint->sample_variance == tfdude::testing::Approx(4e-6));
  CHECK(config->robots.size() == 2);
  CHECK(config->frames[9].id == "b_base_link");
  CHECK(config->frames[9].parent.empty());
  CHECK(config->frames[13].id == "b_tool0");
  CHECK(config->frames[13].parent == "b_wrist_3_link");
  CHECK_FALSE(config->frames[10].joint->strict);
}

TEST_CASE("control characters of a configuration do not reach the error message") {
  for (const char* text : {"urdf:\n  - file: x\n    joints:\n      a\x96: {}\n      a\x96: {}\n",
                           "urdf: [{file: \"a\\e[2J\"}]\n"}) {
    const auto config = tfdude::parse_config(text, "f.yaml");
    REQUIRE_FALSE(config.has_value());
    const std::string& message = config.error().message;
    CHECK(message == tfdude::printable(message));
  }
}

TEST_CASE("a robot of a URDF stands at a latitude and longitude") {
  const std::string head = "urdf:\n  - {file: ur5e.urdf, root: earth, ";
  const std::string folder = TFDUDE_EXAMPLES "/robots/f.yaml";
  const auto config =
      tfdude::parse_config(head + "geodetic: [48.137154, 11.576124, 519]}\n", folder);
  REQUIRE(config.has_value());
  const auto frame = tfdude::parse_config(
      "frames:\n  - {id: a, parent: earth, geodetic: [48.137154, 11.576124, 519]}\n", folder);
  REQUIRE(frame.has_value());
  const tfdude::FrameSpec& root = config->frames.front();
  CHECK(root.parent == "earth");
  CHECK(log(root.X_PC.pose.inverse() * frame->frames.front().X_PC.pose).norm() < 1e-9);
}

TEST_CASE("an invalid entry for a URDF is rejected by name and line") {
  const std::string folder = TFDUDE_EXAMPLES "/robots/";
  const auto refused = [&](const std::string& text, const std::string& message) {
    CAPTURE(text);
    const auto config = tfdude::parse_config(text, folder + "f.yaml");
    REQUIRE_FALSE(config.has_value());
    CHECK(config.error().message == folder + "f.yaml:" + message);
  };
  const auto entry = [&](const std::string& keys, const std::string& message) {
    refused("urdf:\n  - {file: ur5e.urdf, " + keys + "}\n", "2: urdf[0]" + message);
  };
  refused("urdf: ur5e.urdf\n", "1: urdf is not a list");
  refused("urdf: [{root: a}]\n", "1: urdf[0]: file is missing");
  refused("urdf: [{file: x.urdf}]\n",
          "1: urdf[0]: " + folder + "x.urdf: cannot be opened: No such file or directory");
  entry("spam: 1",
        ": unknown key 'spam'; known are file, root, xyz, rpy, quat, matrix, geodetic, "
        "stddev, cov, covariance, prefix, links, strict_limits, joints");
  entry("rpy: [0, 0, 0]", ": rpy needs root: it places the root link in that frame");
  entry("geodetic: [48, 11, 0]", ": geodetic needs root: it places the root link in that frame");
  entry("root: w, geodetic: [48, 11, 0], xyz: [0, 0, 0]",
        ": geodetic is given beside xyz or matrix, one is enough");
  entry("root: ''", ": root is empty");
  entry("root: w, xyz: [1, 2]", ": xyz has 2, not 3 numbers");
  entry("prefix: [a]", ": prefix is not text");
  entry("strict_limits: 1", ": strict_limits is neither true nor false");
  entry("links: tool0", ": links is not a list of links");
  entry("links: []", ": links is not a list of links");
  entry("links: [[tool0]]", ": links[0] is not text");
  entry("links: [x]", ": " + folder + "ur5e.urdf: links 'x': link 'x' does not exist");
  entry("joints: [a]", ": joints is not a mapping");
  entry("joints: {x: {}}", ": " + folder + "ur5e.urdf: joint 'x' does not exist");
  entry("joints: {elbow_joint: {at: 1}}",
        ": joint 'elbow_joint': unknown key 'at'; known are position, stddev, "
        "sample_stddev, origin");
  entry("joints: {elbow_joint: {origin: {}, mount: {}}}",
        ": joint 'elbow_joint': unknown key 'origin'; known are position, stddev, "
        "sample_stddev, mount");
  entry("joints: {elbow_joint: {position: up}}",
        ": joint 'elbow_joint': position is 'up', which is not a number");
  entry("joints: {elbow_joint: {sample_stddev: [1]}}",
        ": joint 'elbow_joint': sample_stddev is not a number");
  entry("joints: {elbow_joint: {origin: {xyz: [0, 0, 0]}}}",
        ": joint 'elbow_joint': origin: unknown key 'xyz'; known are stddev, cov, covariance");
  entry("joints: {elbow_joint: {origin: {stddev: [-1, 0, 0, 0, 0, 0]}}}",
        ": joint 'elbow_joint': origin: stddev[0] is negative");
  const std::string arm = folder + "ur5e.urdf";
  refused(
      "frames:\n  - id: tool0\nurdf:\n  - file: ur5e.urdf\n",
      "4: urdf[0]: " + arm + ": frame 'tool0': id is taken by the frame in " + folder + "f.yaml:2");
  refused("urdf:\n  - file: ur5e.urdf\n  - file: mobile_arm.urdf\n    links: [tool0]\n",
          "3: urdf[1]: " + folder + "mobile_arm.urdf: frame 'tool0': id is taken by the frame in " +
              arm);
  refused("frames: [{id: w, parent: tool0}]\nurdf: [{file: ur5e.urdf, root: w}]\n",
          "2: urdf[0]: " + folder +
              "ur5e.urdf: frame 'base_link': parent 'w' is the frame itself or lies below it");
}

TEST_CASE("two joints of the same name are rejected") {
  const std::string text =
      "<robot><link name='X'/><link name='Y'/><joint name='elbow_joint' type='continuous'>"
      "<parent link='X'/><child link='Y'/></joint></robot>";
  const std::string other = (std::filesystem::temp_directory_path() /
                             ("tfdude_config_" + std::to_string(std::random_device()()) + ".urdf"))
                                .string();
  std::ofstream(other) << text;
  tfdude::Config config;
  REQUIRE(tfdude::add_urdf(config, {TFDUDE_EXAMPLES "/robots/ur5e.urdf"}).has_value());
  const auto again = tfdude::add_urdf(config, {other});
  std::filesystem::remove(other);
  REQUIRE_FALSE(again.has_value());
  CHECK(again.error().message == other + ": joint 'elbow_joint': name is taken by the joint in " +
                                     TFDUDE_EXAMPLES "/robots/ur5e.urdf");
  CHECK(config.frames.size() == 8);
  CHECK(config.places.size() == 8);
}
