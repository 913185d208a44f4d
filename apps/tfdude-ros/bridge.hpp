#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tfdude/client/node.hpp"

#include "parts/clock.hpp"
#include "parts/description.hpp"
#include "parts/detections.hpp"
#include "parts/frames_in.hpp"
#include "parts/frames_out.hpp"
#include "parts/joints.hpp"
#include "parts/poses.hpp"
#include "parts/values.hpp"
#include "ros_domain.hpp"
#include "settings.hpp"

namespace tfdude::ros {

/// A node of tf-dude and a participant of ROS, and what passes data between them.
class Bridge {
 public:
  /// @return errors of Node::open(), kTransport.
  [[nodiscard]] static Result<std::unique_ptr<Bridge>> open(const Settings& settings);
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  [[nodiscard]] Node& node() { return node_; }

 private:
  explicit Bridge(Node node) : node_(std::move(node)) {}

  [[nodiscard]] Result<void> start(const Settings& settings);
  [[nodiscard]] Result<void> start_in(const Settings& settings);
  [[nodiscard]] Result<void> start_out(const Settings& settings);
  /// Whether another bridge is in the same domain of tf-dude.
  [[nodiscard]] bool is_neighbour(const BridgeMark& bridge);
  /// The partitions with frames that a bridge of tf-dude's domain has taken from this ROS domain.
  [[nodiscard]] std::set<std::string> partitions_from_ros();

  Node node_;
  std::optional<ClockIn> clock_in_;
  std::optional<ClockOut> clock_out_;
  std::optional<DescriptionIn> description_in_;
  std::optional<FramesIn> frames_in_;
  std::optional<FramesOut> frames_out_;
  std::optional<JointsIn> joints_in_;
  std::optional<JointsOut> joints_out_;
  std::vector<std::unique_ptr<ValueTaker>> values_in_;
  std::vector<std::unique_ptr<ObjectTaker>> objects_in_;
  std::vector<std::unique_ptr<PoseObserver>> poses_in_;
  std::vector<std::unique_ptr<PoseSender>> poses_out_;
  std::optional<DescriptionOut> description_out_;
  std::unique_ptr<RosDomain> ros_;
  Subscription changes_;
};

}  // namespace tfdude::ros
