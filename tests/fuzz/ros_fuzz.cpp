// Passes any bytes to the readers of tfdude-ros. The first byte chooses the type.

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fuzz/demand.hpp"
#include "ros/ros_bytes.hpp"
#include "tfdude-ros/fastdds/convert.hpp"
#include "tfdude-ros/fastdds/well_formed.hpp"
#include "tfdude-ros/logic/detections.hpp"
#include "tfdude-ros/logic/geodetic.hpp"
#include "tfdude-ros/logic/joints.hpp"
#include "tfdude-ros/logic/tf_import.hpp"

namespace tfdude::fuzz {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ros::MessageType;

/// The message that a reader passes on; none if it rejects the bytes.
template <class Wire>
auto received(MessageType type, const Bytes& bytes, bool well_formed)
    -> std::optional<decltype(ros::plain(std::declval<Wire&>()))> {
  static Wire reused;
  Wire fresh;
  const bool taken = ros::read(type, bytes, fresh);
  demand(!taken || well_formed, "what is not well formed is rejected");
  demand(ros::read(type, bytes, reused) == taken, "a used sample takes what a fresh one does");
  if (!taken) return std::nullopt;
  const auto message = ros::plain(fresh);
  const Bytes sent = ros::bytes_of(type, ros::generated(message));
  demand(!sent.empty(), "what was read can be sent");
  Wire arrived;
  demand(ros::read(type, sent, arrived), "what was sent can be received");
  demand(ros::bytes_of(type, ros::generated(ros::plain(arrived))) == sent, "and is the same");
  return message;
}

void demand_finite(const Transform& X) {
  demand(X.pose.matrix().allFinite(), "a pose is finite");
  const double norm = X.pose.rotation().norm();
  demand(std::abs(norm - 1) < 1e-9, "a quaternion is a rotation");
}

void demand_changes(const ros::TfImport::Changes& changes) {
  for (const auto& edit : changes.edits) {
    demand(check_id(edit.id, "id").has_value(), "a frame has a valid id");
    demand(edit.parent.empty() || check_id(edit.parent, "id").has_value(), "and so has its parent");
    demand(edit.id != edit.parent, "no frame is its own parent");
    if (edit.X_PC) demand_finite(*edit.X_PC);
  }
  for (const auto& batch : changes.batches) {
    for (const EdgeUpdate& edge : batch.edges) {
      demand(check_id(edge.id, "id").has_value(), "an updated frame has a valid id");
      demand_finite(edge.X_PC);
    }
  }
  for (const std::string& report : changes.reports) {
    demand_printable(Error{Errc::kInvalidInput, report});
  }
}

void import(const ros::TfMessage& message) {
  using Kind = ros::Holding::Kind;
  // The last character of an id says whose it is.
  const auto who_holds = [](const std::string& id) {
    switch (id.empty() ? 0 : id.back() % 4) {
      case 1:
        return ros::Holding{Kind::kOther, "arm"};
      case 2:
        return ros::Holding{Kind::kUnknown, "partition 'arm' is not reachable"};
      default:
        return ros::Holding{};
    }
  };
  ros::TfImport import{{}};
  const ros::TfImport::SteadyTime now{};
  for (const bool is_static : {false, true, false}) {
    demand_changes(import.take(message, "writer", is_static, now, who_holds));
  }
  demand_changes(import.retry(now, [](const std::string&) { return ros::Holding{}; }));
}

void import(const ros::JointState& message) {
  ros::JointImport import{{}};
  for (const JointValue& joint : import.take(message).joints) {
    demand(check_id(joint.name, "name").has_value(), "a joint has a valid name");
    demand(check_value(joint).has_value(), "and a valid position");
  }
}

/// Messages that are only read.
template <class Wire>
void seen(MessageType type, const Bytes& bytes, bool well_formed) {
  Wire fresh;
  const bool taken = ros::read(type, bytes, fresh);
  demand(!taken || well_formed, "what is not well formed is rejected");
  if (!taken) return;
  ros::DetectionsIn settings;
  settings.frame = "tag_{}";
  settings.variances.stddev.emplace();
  for (const auto& one : ros::DetectionImport(settings).take(ros::plain(fresh)).all) {
    demand(check_id(one.measurement.b, "id").has_value(), "an object has a valid id");
    demand_finite(one.measurement.X_AB);
  }
}

template <class Wire>
void placed(MessageType type, const Bytes& bytes, bool well_formed) {
  Wire fresh;
  const bool taken = ros::read(type, bytes, fresh);
  demand(!taken || well_formed, "what is not well formed is rejected");
  if (!taken) return;
  const ros::GeoPose message = ros::plain(fresh);
  if (!ros::has_place(message)) return;
  const auto value = ros::geodetic_message(message, "earth", "gps", {}, {});
  if (value) return demand_finite(value->X_AB);
  demand_printable(value.error());
}

void run(std::uint8_t choice, const Bytes& bytes) {
  const std::uint8_t* data = bytes.data();
  const std::size_t size = bytes.size();
  switch (choice % 11) {
    case 0:
      if (const auto tf =
              received<ros::wire::Tf>(MessageType::kTf, bytes, ros::well_formed_tf(data, size))) {
        import(*tf);
      }
      return;
    case 1:
      if (const auto joints = received<ros::wire::JointState>(
              MessageType::kJointState, bytes, ros::well_formed_joint_state(data, size))) {
        import(*joints);
      }
      return;
    case 2:
      (void)received<ros::wire::String>(MessageType::kString, bytes,
                                        ros::well_formed_string(data, size));
      return;
    case 3:
      (void)received<ros::wire::Pose>(MessageType::kPoseWithCovarianceStamped, bytes,
                                      ros::well_formed_pose(data, size));
      return;
    case 4:
      (void)received<ros::wire::Odometry>(MessageType::kOdometry, bytes,
                                          ros::well_formed_odometry(data, size));
      return;
    case 5:
      return seen<ros::wire::Detections>(MessageType::kDetection3DArray, bytes,
                                         ros::well_formed_detections(data, size));
    case 6:
      return seen<ros::wire::Tags>(MessageType::kAprilTagDetectionArray, bytes,
                                   ros::well_formed_tags(data, size));
    case 7:
      return seen<ros::wire::Markers>(MessageType::kArucoMarkers, bytes,
                                      ros::well_formed_markers(data, size));
    case 9:
      return placed<ros::wire::NavSatFix>(MessageType::kNavSatFix, bytes,
                                          ros::well_formed_nav_sat_fix(data, size));
    case 10:
      return placed<ros::wire::GeoPose>(MessageType::kGeoPoseStamped, bytes,
                                        ros::well_formed_geo_pose(data, size));
    default:
      (void)received<ros::wire::Clock>(MessageType::kClock, bytes,
                                       ros::well_formed_clock(data, size));
  }
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 0) tfdude::fuzz::run(data[0], {data + 1, data + size});
  return 0;
}
