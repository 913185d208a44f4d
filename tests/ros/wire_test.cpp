// The bytes of ROS's messages: every type on its way and back, and bytes that are not well formed.

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "ros/ros_bytes.hpp"
#include "support/catch.hpp"
#include "tfdude-ros/fastdds/convert.hpp"
#include "tfdude-ros/fastdds/identity.hpp"
#include "tfdude-ros/fastdds/well_formed.hpp"

namespace tfdude::ros {
namespace {

TfMessage tf_example() {
  return {{time_of(1'234'567'890'123'456'789), "odom", "base", {{1, 2, 3}, {0.1, 0.2, 0.3, 0.4}}},
          {time_of(-1), "", std::string(300, 'x'), {}}};
}

// What a reader of bytes does with all that is not what was written.
template <class Generated>
void check_robust(MessageType type, const Generated& message) {
  const auto bytes = bytes_of(type, message);
  REQUIRE(!bytes.empty());
  Generated out;
  REQUIRE(read(type, bytes, out));
  // The last bytes may be padding.
  for (std::size_t length = 0; length + 8 < bytes.size(); ++length) {
    CHECK(!read(type, {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length)}, out));
  }
  std::mt19937 random(20);  // NOLINT(cert-msc51-cpp): the same each time
  for (int i = 0; i < 3000; ++i) {
    auto odd = bytes;
    for (int k = 0; k < 1 + i % 4; ++k) {
      odd[random() % odd.size()] = i % 3 == 0 ? 0xff : static_cast<std::uint8_t>(random());
    }
    (void)read(type, odd, out);  // neither throws nor takes gigabytes
  }
}

}  // namespace

TEST_CASE("ros wire: transforms survive the way, and damaged ones are rejected") {
  auto message = generated(tf_example());
  wire::Tf back;
  REQUIRE(read(MessageType::kTf, bytes_of(MessageType::kTf, message), back));
  const auto out = plain(back);
  REQUIRE(out.size() == 2);
  CHECK(out[0].stamp == tf_example()[0].stamp);
  CHECK(out[1].stamp == time_of(-1));
  CHECK(out[0].parent == "odom");
  CHECK(out[1].child == std::string(300, 'x'));
  CHECK(out[0].pose.xyz == tf_example()[0].pose.xyz);
  CHECK(out[0].pose.quat == tf_example()[0].pose.quat);
  check_robust(MessageType::kTf, message);
}

TEST_CASE("ros wire: joints survive the way, and damaged ones are rejected") {
  auto message = generated(JointState{time_of(5), {"a", "b"}, {1, 2}});
  wire::JointState back;
  REQUIRE(read(MessageType::kJointState, bytes_of(MessageType::kJointState, message), back));
  const auto out = plain(back);
  CHECK(out.stamp == time_of(5));
  CHECK(out.names == std::vector<std::string>{"a", "b"});
  CHECK(out.positions == std::vector<double>{1, 2});
  check_robust(MessageType::kJointState, message);
}

TEST_CASE("ros wire: the other messages survive the way, and damaged ones are rejected") {
  Odometry odometry{{time_of(7), "odom", {{1, 2, 3}, {0, 0, 0, 1}}, {}}, "base"};
  odometry.pose.covariance[35] = 4;
  odometry.linear = {1, 2, 3};
  odometry.angular = {4, 5, 6};
  odometry.twist_covariance[1] = 8;
  auto message = generated(odometry);
  wire::Odometry back;
  REQUIRE(read(MessageType::kOdometry, bytes_of(MessageType::kOdometry, message), back));
  const auto out = plain(back);
  CHECK(out.child == "base");
  CHECK(out.pose.covariance == odometry.pose.covariance);
  CHECK(out.linear == odometry.linear);
  CHECK(out.angular == odometry.angular);
  CHECK(out.twist_covariance == odometry.twist_covariance);
  check_robust(MessageType::kOdometry, message);
  check_robust(MessageType::kPoseWithCovarianceStamped, generated(odometry.pose));
  check_robust(MessageType::kString, generated(Text{std::string(1000, 'y')}));
  check_robust(MessageType::kClock, generated(ClockTime{time_of(9)}));
}

TEST_CASE("ros wire: places on the Earth are read as receivers send them") {
  // Plain CDR, as a node of ROS sends it: header, status and service, coordinates, covariance.
  const auto hex = [](std::string_view digits) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i + 1 < digits.size(); i += 2) {
      bytes.push_back(
          static_cast<std::uint8_t>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16)));
    }
    return bytes;
  };
  const auto bytes =
      hex("00010000"  // little-endian
          "07000000"
          "f4010000"
          "04000000"
          "67707300"  // 7 s, 500 ns, "gps"
          "ff000900"
          "00000000"  // status -1, service 9
          "0000000000004840"
          "0000000000002740"
          "0000000000388040"  // 48, 11.5, 519
          "000000000000f03f"
          "0000000000000000"
          "0000000000000000"
          "0000000000000000"
          "0000000000000040"
          "0000000000000000"
          "0000000000000000"
          "0000000000000000"
          "0000000000001040"
          "02");
  wire::NavSatFix fix;
  REQUIRE(read(MessageType::kNavSatFix, bytes, fix));
  auto out = plain(fix);
  CHECK(out.stamp == time_of(7'000'000'500));
  CHECK(out.frame == "gps");
  CHECK(out.place == std::array<double, 3>{48, 11.5, 519});
  CHECK_FALSE(out.fixed);
  CHECK_FALSE(out.quat);
  REQUIRE(out.covariance);
  CHECK((*out.covariance)[4] == 2);
  CHECK((*out.covariance)[8] == 4);
  fix.status_().status_(2);
  fix.position_covariance_type_(0);
  out = plain(fix);
  CHECK(out.fixed);
  CHECK_FALSE(out.covariance);
  check_robust(MessageType::kNavSatFix, fix);

  wire::GeoPose pose;
  pose.header_().frame_id_("map");
  pose.pose_().position_().longitude_(151);
  pose.pose_().orientation_().z_(1);
  wire::GeoPose back;
  REQUIRE(read(MessageType::kGeoPoseStamped, bytes_of(MessageType::kGeoPoseStamped, pose), back));
  const auto place = plain(back);
  CHECK(place.place[1] == 151);
  CHECK((*place.quat)[2] == 1);
  CHECK(place.fixed);
  check_robust(MessageType::kGeoPoseStamped, pose);
}

TEST_CASE("ros wire: an object of Detection3DArray is its track, or its most probable class") {
  wire::Detections message;
  message.header_().frame_id_("camera");
  message.header_().stamp_().sec_(7);
  message.detections_().resize(3);
  auto& first = message.detections_()[0];
  first.results_().resize(2);
  first.results_()[0].hypothesis_().class_id_("bowl");
  first.results_()[0].hypothesis_().score_(0.25);
  first.results_()[1].hypothesis_().class_id_("cup");
  first.results_()[1].hypothesis_().score_(0.75);
  first.results_()[1].pose_().pose_().position_().z_(3);
  first.results_()[1].pose_().covariance_()[35] = 4;
  message.detections_()[1] = first;
  message.detections_()[1].id_("track 5");
  wire::Detections back;
  REQUIRE(read(MessageType::kDetection3DArray, bytes_of(MessageType::kDetection3DArray, message),
               back));
  const auto out = plain(back);
  CHECK(out.frame == "camera");
  CHECK(out.stamp == time_of(7'000'000'000));
  REQUIRE(out.objects.size() == 2);  // one says nothing
  CHECK(out.objects[0].id == "cup");
  CHECK(out.objects[0].pose.xyz[2] == 3);
  CHECK(out.objects[0].covariance[35] == 4);
  CHECK(out.objects[1].id == "track 5");
  check_robust(MessageType::kDetection3DArray, message);
}

TEST_CASE("ros wire: tags and markers are objects by their numbers") {
  wire::Tags tags;
  tags.header_().frame_id_("camera");
  tags.detections_().resize(2);
  tags.detections_()[1].family_("36h11");
  tags.detections_()[1].id_(7);
  tags.detections_()[1].pose_().pose_().pose_().position_().x_(2);
  tags.detections_()[1].pose_().pose_().covariance_()[0] = 0.5;
  wire::Tags tags_back;
  const MessageType type = MessageType::kAprilTagDetectionArray;
  REQUIRE(read(type, bytes_of(type, tags), tags_back));
  const auto out = plain(tags_back);
  REQUIRE(out.objects.size() == 2);
  CHECK(out.objects[1].id == "7");
  CHECK(out.objects[1].pose.xyz[0] == 2);
  CHECK(out.objects[1].covariance[0] == 0.5);
  check_robust(type, tags);

  wire::Markers markers;
  markers.marker_ids_({5, -1});
  markers.poses_().resize(1);
  markers.poses_()[0].position_().y_(4);
  wire::Markers markers_back;
  REQUIRE(read(MessageType::kArucoMarkers, bytes_of(MessageType::kArucoMarkers, markers),
               markers_back));
  const auto seen = plain(markers_back);
  REQUIRE(seen.objects.size() == 1);
  CHECK(seen.objects[0].id == "5");
  CHECK(seen.objects[0].pose.xyz[1] == 4);
  check_robust(MessageType::kArucoMarkers, markers);
}

TEST_CASE("ros wire: types have the names that ROS 2 gives them") {
  const auto name = [](MessageType type) { return type_support(type).get_type_name(); };
  CHECK(name(MessageType::kTf) == "tf2_msgs::msg::dds_::TFMessage_");
  CHECK(name(MessageType::kJointState) == "sensor_msgs::msg::dds_::JointState_");
  CHECK(name(MessageType::kString) == "std_msgs::msg::dds_::String_");
  CHECK(name(MessageType::kPoseWithCovarianceStamped) ==
        "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_");
  CHECK(name(MessageType::kOdometry) == "nav_msgs::msg::dds_::Odometry_");
  CHECK(name(MessageType::kNavSatFix) == "sensor_msgs::msg::dds_::NavSatFix_");
  CHECK(name(MessageType::kGeoPoseStamped) == "geographic_msgs::msg::dds_::GeoPoseStamped_");
  CHECK(name(MessageType::kDetection3DArray) == "vision_msgs::msg::dds_::Detection3DArray_");
  CHECK(name(MessageType::kAprilTagDetectionArray) ==
        "isaac_ros_apriltag_interfaces::msg::dds_::AprilTagDetectionArray_");
  CHECK(name(MessageType::kArucoMarkers) == "ros2_aruco_interfaces::msg::dds_::ArucoMarkers_");
  CHECK(name(MessageType::kClock) == "rosgraph_msgs::msg::dds_::Clock_");
}

TEST_CASE("ros wire: a bridge is recognized by the user data of its participant") {
  const BridgeMark mark{"ros;2", "host-1", 4711};
  CHECK(mark_of(user_data_of(mark)) == mark);
  for (const std::string& text :
       {std::string(), std::string("enclave=/;"), std::string("enclave=/;tfdude-bridge=;"),
        std::string("enclave=/;tfdude-bridge=x,h,p;"), std::string("enclave=/;tfdude-bridge=1,h;"),
        std::string("enclave=/;tfdude-bridge=1,h,p")}) {
    CAPTURE(text);
    CHECK(!mark_of({text.begin(), text.end()}));
  }
}

}  // namespace tfdude::ros
