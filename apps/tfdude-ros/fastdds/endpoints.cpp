#include "endpoints.hpp"

#include <type_traits>
#include <utility>

#include "convert.hpp"
#include "identity.hpp"
#include "well_formed.hpp"

namespace tfdude::ros {
namespace {

namespace edds = fastdds::edds;

// One of the types of messages: as it is generated, and as a plain struct.
template <class GeneratedType, class PlainType, class Support,
          bool (*WellFormed)(const std::uint8_t*, std::size_t)>
struct Kind {
  using Generated = GeneratedType;
  using Plain = PlainType;
  using Type = fastdds::CheckedType<Support, WellFormed>;
};

using TfKind = Kind<wire::Tf, TfMessage, tf2_msgs::msg::dds_::TFMessage_PubSubType, well_formed_tf>;
using JointStateKind = Kind<wire::JointState, JointState,
                            sensor_msgs::msg::dds_::JointState_PubSubType, well_formed_joint_state>;
using StringKind =
    Kind<wire::String, Text, std_msgs::msg::dds_::String_PubSubType, well_formed_string>;
using PoseKind =
    Kind<wire::Pose, PoseWithCovariance,
         geometry_msgs::msg::dds_::PoseWithCovarianceStamped_PubSubType, well_formed_pose>;
using OdometryKind =
    Kind<wire::Odometry, Odometry, nav_msgs::msg::dds_::Odometry_PubSubType, well_formed_odometry>;
using ClockKind =
    Kind<wire::Clock, ClockTime, rosgraph_msgs::msg::dds_::Clock_PubSubType, well_formed_clock>;

// Those that are only read.
using NavSatFixKind = Kind<wire::NavSatFix, GeoPose, sensor_msgs::msg::dds_::NavSatFix_PubSubType,
                           well_formed_nav_sat_fix>;
using GeoPoseKind =
    Kind<wire::GeoPose, GeoPose, geographic_msgs::msg::dds_::GeoPoseStamped_PubSubType,
         well_formed_geo_pose>;
using DetectionsKind =
    Kind<wire::Detections, Detections, vision_msgs::msg::dds_::Detection3DArray_PubSubType,
         well_formed_detections>;
using TagsKind = Kind<wire::Tags, Detections,
                      isaac_ros_apriltag_interfaces::msg::dds_::AprilTagDetectionArray_PubSubType,
                      well_formed_tags>;
using MarkersKind =
    Kind<wire::Markers, Detections, ros2_aruco_interfaces::msg::dds_::ArucoMarkers_PubSubType,
         well_formed_markers>;

// Calls a function with a value of the Kind of this type.
template <class Call>
auto with_kind(MessageType type, Call call) {
  switch (type) {
    case MessageType::kTf:
      return call(TfKind{});
    case MessageType::kJointState:
      return call(JointStateKind{});
    case MessageType::kString:
      return call(StringKind{});
    case MessageType::kPoseWithCovarianceStamped:
      return call(PoseKind{});
    case MessageType::kOdometry:
      return call(OdometryKind{});
    case MessageType::kNavSatFix:
      return call(NavSatFixKind{});
    case MessageType::kGeoPoseStamped:
      return call(GeoPoseKind{});
    case MessageType::kDetection3DArray:
      return call(DetectionsKind{});
    case MessageType::kAprilTagDetectionArray:
      return call(TagsKind{});
    case MessageType::kArucoMarkers:
      return call(MarkersKind{});
    default:
      return call(ClockKind{});
  }
}

template <class OneKind>
class Listener final : public edds::DataReaderListener {
 public:
  Listener(Take take, FindBridge find_bridge)
      : take_(std::move(take)), find_bridge_(std::move(find_bridge)) {}

  void on_data_available(edds::DataReader* reader) override {
    typename OneKind::Generated sample;
    edds::SampleInfo info;
    while (fastdds::ok(reader->take_next_sample(&sample, &info))) {
      if (!info.valid_data) continue;
      const auto& guid = info.sample_identity.writer_guid();
      if (guid.guidPrefix == reader->guid().guidPrefix) continue;  // its own message
      take_(plain(sample), Source{text_of(guid), find_bridge_(guid.guidPrefix)});
    }
  }

 private:
  const Take take_;
  const FindBridge find_bridge_;
};

template <class OneKind>
class Writing final : public Publisher {
 public:
  Writing(edds::Publisher& publisher, edds::DataWriter& writer)
      : publisher_(publisher), writer_(writer) {}
  Writing(const Writing&) = delete;
  Writing& operator=(const Writing&) = delete;
  ~Writing() override { (void)publisher_.delete_datawriter(&writer_); }

  bool publish(const Message& message) override {
    const auto* plain = std::get_if<typename OneKind::Plain>(&message);
    if (plain == nullptr) return false;
    auto sample = generated(*plain);
    return fastdds::write(writer_, &sample);
  }

 private:
  edds::Publisher& publisher_;
  edds::DataWriter& writer_;
};

}  // namespace

edds::TypeSupport type_support(MessageType type) {
  return with_kind(type,
                   [](auto kind) { return edds::TypeSupport(new typename decltype(kind)::Type); });
}

std::unique_ptr<edds::DataReaderListener> reading(MessageType type, Take take,
                                                  FindBridge find_bridge) {
  return with_kind(type, [&](auto kind) -> std::unique_ptr<edds::DataReaderListener> {
    return std::make_unique<Listener<decltype(kind)>>(std::move(take), std::move(find_bridge));
  });
}

std::unique_ptr<Publisher> writing(MessageType type, edds::Publisher& publisher,
                                   edds::DataWriter& writer) {
  return with_kind(type, [&](auto kind) -> std::unique_ptr<Publisher> {
    using Plain = typename decltype(kind)::Plain;
    if constexpr (std::is_same_v<Plain, Detections> || std::is_same_v<Plain, GeoPose>) {
      return nullptr;
    } else {
      return std::make_unique<Writing<decltype(kind)>>(publisher, writer);
    }
  });
}

namespace {

template <class Qos>
void set_common(const Topic& topic, int depth, Qos& qos) {
  qos.history().kind = edds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth;
  if (topic.latched) qos.durability().kind = edds::TRANSIENT_LOCAL_DURABILITY_QOS;
  // Messages have no largest size.
  qos.endpoint().history_memory_policy = fastdds::ertps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
  fastdds::use_plain_cdr(qos);
}

}  // namespace

edds::DataReaderQos reader_qos(const Topic& topic) {
  edds::DataReaderQos qos;
  set_common(topic, topic.read_depth, qos);
  qos.reliability().kind =
      topic.reliable_reader ? edds::RELIABLE_RELIABILITY_QOS : edds::BEST_EFFORT_RELIABILITY_QOS;
  if (!topic.reliable_reader) qos.durability().kind = edds::VOLATILE_DURABILITY_QOS;
  return qos;
}

edds::DataWriterQos writer_qos(const Topic& topic) {
  edds::DataWriterQos qos;
  set_common(topic, topic.write_depth, qos);
  qos.reliability().kind = edds::RELIABLE_RELIABILITY_QOS;
  if (!topic.latched) qos.durability().kind = edds::VOLATILE_DURABILITY_QOS;
  qos.publish_mode().kind = edds::SYNCHRONOUS_PUBLISH_MODE;
  // With Fast DDS's 3 s, a late reader of Cyclone DDS waits that long for its first message.
  fastdds::set_heartbeat_period(qos, 100'000'000);
  return qos;
}

}  // namespace tfdude::ros
