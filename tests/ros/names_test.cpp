#include "tfdude-ros/logic/names.hpp"

#include <cmath>
#include <limits>
#include <string>

#include "support/catch.hpp"

namespace tfdude::ros {

TEST_CASE("ros names: '*' in a pattern stands for any characters") {
  const Patterns patterns({"camera_*", "*_link", "a*b*c"});
  for (const char* name : {"camera_", "camera_left", "arm_link", "_link", "abc", "axxbxxc"}) {
    CAPTURE(name);
    CHECK(patterns.match(name));
  }
  for (const char* name : {"", "camera", "xcamera_", "linkage", "ab", "abcd"}) {
    CAPTURE(name);
    CHECK(!patterns.match(name));
  }
  CHECK(!Patterns().match("x"));
  CHECK(Patterns({"*"}).match(""));
}

TEST_CASE("ros names: a choice without patterns takes all, and exclusion wins") {
  CHECK(Choice().takes("x"));
  const Choice choice{Patterns({"arm*"}), Patterns({"*_virtual"})};
  CHECK(choice.takes("arm_1"));
  CHECK(!choice.takes("arm_virtual"));
  CHECK(!choice.takes("leg"));
}

TEST_CASE("ros names: leading slashes are taken off, and a prefix is added") {
  CHECK(id_of("/base", "") == "base");
  CHECK(id_of("//base/left", "r1/") == "r1/base/left");
  CHECK(ros_name_of("r1/base", "r1/") == "base");
  CHECK(!ros_name_of("world", "r1/"));
  CHECK(!ros_name_of("r1/", "r1/"));
  CHECK(ros_name_of("world", "") == "world");
}

TEST_CASE("ros names: what cannot be an id is rejected by name") {
  for (const std::string& name : {std::string(), std::string("/"), std::string("a\nb"),
                                  std::string(256, 'x'), std::string("\xff")}) {
    const auto id = id_of(name, "");
    REQUIRE(!id);
    CHECK(id.error().code == Errc::kInvalidInput);
  }
  CHECK(id_of(std::string(255, 'x'), ""));
  CHECK(!id_of(std::string(255, 'x'), "p"));
  // A message of 10 kB does not make a log line of 10 kB.
  CHECK(id_of(std::string(10'000, 'x'), "").error().message.size() < 200);
}

TEST_CASE("ros names: quaternions are normalized as in tf2, or rejected") {
  RosPose pose;
  pose.xyz = {1, 2, 3};
  pose.quat = {0, 0, 0.7071 * 1.001, 0.7071 * 1.001};
  const auto X = pose_of(pose);
  REQUIRE(X);
  CHECK(std::abs(X->rotation().norm() - 1) < 1e-15);
  CHECK(X->translation() == Eigen::Vector3d(1, 2, 3));
  for (const double w : {0.0, 0.99, 1.01, std::nan("")}) {
    CAPTURE(w);
    pose.quat = {0, 0, 0, w};
    CHECK(!pose_of(pose));
  }
  pose.quat = {0, 0, 0, 1};
  pose.xyz[1] = std::numeric_limits<double>::infinity();
  CHECK(!pose_of(pose));
}

TEST_CASE("ros names: a pose survives the way to ROS and back") {
  const Pose X = *Pose::create(from_rpy(0.1, 0.2, 0.3), Eigen::Vector3d(1, 2, 3));
  const Pose back = *pose_of(ros_pose_of(X));
  CHECK((back.translation() - X.translation()).norm() == 0);
  CHECK(back.rotation().angularDistance(X.rotation()) < 1e-15);
}

}  // namespace tfdude::ros
