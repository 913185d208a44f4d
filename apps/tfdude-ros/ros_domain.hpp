#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/result.hpp"

#include "messages.hpp"

// The bridge's access to the topics of ROS 2, without any type of DDS.
namespace tfdude::ros {

/// How a bridge appears in the domain of tf-dude. So other bridges can tell whether it is in
/// theirs.
struct BridgeMark {
  std::string partition;  ///< that its process serves
  std::string host;
  std::uint32_t pid = 0;

  friend bool operator==(const BridgeMark& a, const BridgeMark& b) {
    return a.partition == b.partition && a.host == b.host && a.pid == b.pid;
  }
};

/// Whether another bridge is in the same domain of tf-dude. What it sends to ROS is there already.
using IsNeighbour = std::function<bool(const BridgeMark&)>;

/// Which participants are discovered.
enum class Range : std::uint8_t { kThisComputer, kNetwork };

struct RosSettings {
  std::uint32_t domain = 0;  ///< 0 to 232
  Range range = Range::kNetwork;
  BridgeMark self;
};

enum class MessageType : std::uint8_t {
  kTf,
  kJointState,
  kString,
  kPoseWithCovarianceStamped,
  kOdometry,
  kDetection3DArray,
  kAprilTagDetectionArray,
  kArucoMarkers,
  kClock,
  kNavSatFix,
  kGeoPoseStamped,
};

/// A topic, with the quality of service that ROS 2 gives it.
struct Topic {
  std::string name;  ///< as in ROS: "/tf"
  MessageType type = MessageType::kTf;
  bool reliable_reader = true;  ///< one that is not matches all writers; own writers are reliable
  bool latched = false;         ///< late readers get the last messages (transient local)
  int read_depth = 10;
  int write_depth = 10;
};

[[nodiscard]] Topic tf_topic();
[[nodiscard]] Topic tf_static_topic();
[[nodiscard]] Topic joint_states_topic();
[[nodiscard]] Topic description_topic();
[[nodiscard]] Topic clock_topic();
[[nodiscard]] Topic pose_topic(const std::string& name);
[[nodiscard]] Topic odometry_topic(const std::string& name);
/// @param type  kNavSatFix or kGeoPoseStamped
[[nodiscard]] Topic geodetic_topic(const std::string& name, MessageType type);
/// @param type  one of those of detections
[[nodiscard]] Topic detections_topic(const std::string& name, MessageType type);

/// The writer of a message.
struct Source {
  std::string guid;                  ///< of the writer, as `ros2 topic info --verbose` prints it
  std::optional<BridgeMark> bridge;  ///< if it is one
};

/// Called by a thread of DDS, one call per topic at a time. Must return soon and must not throw.
using Take = std::function<void(Message&&, const Source&)>;

class Publisher {
 public:
  Publisher() = default;
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;
  virtual ~Publisher() = default;

  /// The message must be of the topic's type. Thread-safe. @return false if DDS did not take it
  virtual bool publish(const Message& message) = 0;
};

/// A participant of a ROS domain. All functions are thread-safe.
class RosDomain {
 public:
  RosDomain() = default;
  RosDomain(const RosDomain&) = delete;
  RosDomain& operator=(const RosDomain&) = delete;
  /// After it has returned, no Take is running or will run. Publishers must be gone before.
  virtual ~RosDomain() = default;

  /// Own messages and malformed ones are left out. @return kTransport.
  [[nodiscard]] virtual Result<void> subscribe(const Topic& topic, Take take) = 0;
  /// Not of detections and places on the Earth. @return kTransport.
  [[nodiscard]] virtual Result<std::unique_ptr<Publisher>> advertise(const Topic& topic) = 0;

  /// The other bridges in this ROS domain.
  [[nodiscard]] virtual std::vector<BridgeMark> bridges() const = 0;
  /// How many messages were left out because they were malformed.
  [[nodiscard]] virtual std::uint64_t malformed() const = 0;
};

/// By Fast DDS. @return kTransport.
[[nodiscard]] Result<std::unique_ptr<RosDomain>> join_ros_domain(const RosSettings& settings);

}  // namespace tfdude::ros
