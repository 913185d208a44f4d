#include "joints.hpp"

#include <chrono>
#include <utility>

#include <spdlog/spdlog.h>

#include "tfdude/base/id.hpp"

namespace tfdude::ros {

Result<void> JointsIn::start(RosDomain& domain, const IsNeighbour& is_own) {
  return domain.subscribe(
      joint_states_topic(), [this, is_own](Message&& message, const Source& source) {
        if (source.bridge && is_own(*source.bridge)) return;
        worker_.post([this, state = std::get<JointState>(std::move(message))] { take(state); });
      });
}

void JointsIn::stop() {
  worker_.stop();
  spdlog::info(
      "joints of ROS: taken={} refused={}; of their stamps: {}; messages dropped={} not sent={}",
      import_.counts().taken, import_.counts().refused, import_.stamps().summary(),
      worker_.dropped(), not_sent_);
}

void JointsIn::take(const JointState& message) {
  JointPositions positions = import_.take(message);
  for (const std::string& report : positions.reports) spdlog::warn("{}", report);
  if (positions.joints.empty()) return;
  const auto sent = node_.publish_joints(std::move(positions.joints), positions.stamp);
  // What comes between may be of another publisher, with joints that are known.
  if (sent) return;
  ++not_sent_;
  if (errors_.is_new(sent.error())) {
    spdlog::warn("joints of ROS: {}", sent.error().message);
  }
}

Result<void> JointsOut::start(RosDomain& domain, const IsNeighbour& is_own) {
  auto publisher = domain.advertise(joint_states_topic());
  if (!publisher) return tl::unexpected(std::move(publisher.error()));
  publisher_ = *std::move(publisher);
  auto subscribed = domain.subscribe(
      joint_states_topic(), [this, is_own](Message&& message, const Source& source) {
        if (source.bridge && is_own(*source.bridge)) return;
        worker_.post(
            [this, state = std::get<JointState>(std::move(message))] { export_.heard(state); });
      });
  if (!subscribed) return subscribed;
  const std::chrono::duration<double> period(1 / export_.settings().rate);
  worker_.repeat(std::chrono::duration_cast<std::chrono::nanoseconds>(period), [this] { send(); });
  return {};
}

void JointsOut::stop() {
  worker_.stop();
  publisher_ = nullptr;
}

void JointsOut::send() {
  const auto partitions = node_.partitions();
  if (!partitions) return;
  JointState message;
  for (const PartitionInfo& one : *partitions) {
    if (!one.reachable || !export_.settings().partitions.match(one.name)) continue;
    if (const auto joints = node_.joints(one.name)) export_.add(*joints, message);
  }
  for (const std::string& name : JointExport::drop_repeated(message)) {
    if (!told_.insert(name).second) continue;
    spdlog::warn("joints to ROS: joint {} is not sent: several of the chosen partitions have it",
                 quote(name));
  }
  if (message.names.empty()) return;
  const auto now = node_.now();
  if (!now) return;
  message.stamp = *now;
  publisher_->publish(std::move(message));
}

}  // namespace tfdude::ros
