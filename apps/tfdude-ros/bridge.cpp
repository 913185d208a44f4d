#include "bridge.hpp"

#include <algorithm>
#include <array>
#include <unistd.h>
#include <utility>

#include <spdlog/spdlog.h>

namespace tfdude::ros {
namespace {

// How long frames of /tf wait for a description.
constexpr std::chrono::seconds kDescriptionFirst{2};

// As tf-dude announces it.
std::string host_name() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

// Stamps may be those of a simulation. The import notices itself when time jumps back.
EdgeTiming timing_of_frames() {
  EdgeTiming timing;
  timing.max_ahead = std::chrono::nanoseconds::max();
  return timing;
}

bool is_marked(const PartitionInfo& partition, const BridgeMark& mark) {
  return partition.name == mark.partition && partition.host == mark.host &&
         partition.pid == mark.pid;
}

}  // namespace

Result<std::unique_ptr<Bridge>> Bridge::open(const Settings& settings) {
  NodeOptions options = settings.options;
  options.history = timing_of_frames();
  auto node = Node::open(settings.partition, {}, options);
  if (!node) return tl::unexpected(std::move(node.error()));
  std::unique_ptr<Bridge> bridge(new Bridge(*std::move(node)));
  if (auto started = bridge->start(settings); !started) return tl::unexpected(started.error());
  return bridge;
}

// First those who write to ROS, then ROS itself, which calls those who read from it.
Bridge::~Bridge() {
  changes_ = {};
  if (frames_out_) frames_out_->stop();
  if (joints_out_) joints_out_->stop();
  if (clock_out_) clock_out_->stop();
  poses_out_.clear();
  if (description_out_) description_out_->stop();
  if (ros_ != nullptr && ros_->malformed() > 0) {
    spdlog::warn("malformed messages of ROS: {}", ros_->malformed());
  }
  ros_ = nullptr;
  for (const auto& taker : values_in_) taker->stop();
  for (const auto& taker : objects_in_) taker->stop();
  if (frames_in_) frames_in_->stop();
  if (joints_in_) joints_in_->stop();
  for (const auto& observer : poses_in_) observer->stop();
  if (description_in_) description_in_->stop();
  if (clock_in_) clock_in_->stop();
}

Result<void> Bridge::start(const Settings& settings) {
  const BridgeMark self{settings.partition, host_name(), static_cast<std::uint32_t>(getpid())};
  auto ros = join_ros_domain({settings.ros_domain, settings.range, self});
  if (!ros) return tl::unexpected(std::move(ros.error()));
  ros_ = *std::move(ros);
  const bool takes_others = !settings.values_in.empty() || !settings.detections_in.empty();
  if (settings.frames_in || takes_others) {
    frames_in_.emplace(node_, import_of(settings), timing_of_frames());
  }
  if (settings.frames_out) frames_out_.emplace(node_, *settings.frames_out);
  if (settings.description_out) {
    description_out_.emplace(node_, *settings.description_out);
    if (auto started = description_out_->start(*ros_); !started) return started;
  }
  changes_ = node_.on_change([this](const Change& change) {
    if (frames_in_) frames_in_->on_change(change);
    if (frames_out_) frames_out_->on_change();
    if (description_out_) description_out_->on_change(change);
  });
  if (auto started = start_in(settings); !started) return started;
  return start_out(settings);
}

Result<void> Bridge::start_in(const Settings& settings) {
  const auto is_own = [this](const BridgeMark& mark) { return is_neighbour(mark); };
  if (settings.passes_clock) {
    clock_in_.emplace(node_);
    if (auto started = clock_in_->start(*ros_, is_own); !started) return started;
  }
  if (settings.description_in) {
    description_in_.emplace(*settings.description_in, settings.options,
                            frames_in_ ? &*frames_in_ : nullptr);
    if (auto started = description_in_->start(*ros_, is_own); !started) return started;
    // A node that publishes the same frames on /tf would otherwise be first.
    if (frames_in_) (void)description_in_->wait_until_served(kDescriptionFirst);
  }
  if (settings.frames_in) {
    if (auto started = frames_in_->start(*ros_, is_own); !started) return started;
  }
  if (settings.joints_in) {
    joints_in_.emplace(node_, *settings.joints_in);
    if (auto started = joints_in_->start(*ros_, is_own); !started) return started;
  }
  for (const ValueIn& one : settings.values_in) {
    values_in_.push_back(std::make_unique<ValueTaker>(node_, *frames_in_, one));
    if (auto started = values_in_.back()->start(*ros_, is_own); !started) return started;
  }
  for (const DetectionsIn& one : settings.detections_in) {
    objects_in_.push_back(std::make_unique<ObjectTaker>(node_, *frames_in_, one));
    if (auto started = objects_in_.back()->start(*ros_, is_own); !started) return started;
  }
  for (const PoseIn& one : settings.poses_in) {
    poses_in_.push_back(std::make_unique<PoseObserver>(node_, one));
    if (auto started = poses_in_.back()->start(*ros_, is_own); !started) return started;
  }
  return {};
}

Result<void> Bridge::start_out(const Settings& settings) {
  if (settings.clock_out) {
    clock_out_.emplace(node_, *settings.clock_out);
    if (auto started = clock_out_->start(*ros_); !started) return started;
  }
  if (frames_out_) {
    const auto from_ros = [this] { return partitions_from_ros(); };
    if (auto started = frames_out_->start(*ros_, from_ros); !started) return started;
  }
  if (settings.joints_out) {
    joints_out_.emplace(node_, *settings.joints_out);
    const auto is_own = [this](const BridgeMark& mark) { return is_neighbour(mark); };
    if (auto started = joints_out_->start(*ros_, is_own); !started) return started;
  }
  if (description_out_) description_out_->look();
  for (const PoseOut& one : settings.poses_out) {
    auto sender = PoseSender::start(node_, *ros_, one);
    if (!sender) return tl::unexpected(std::move(sender.error()));
    poses_out_.push_back(*std::move(sender));
  }
  return {};
}

// While that is not known, it is assumed: what is not passed on now can be later.
bool Bridge::is_neighbour(const BridgeMark& bridge) {
  const auto partitions = node_.partitions();
  return !partitions || std::any_of(partitions->begin(), partitions->end(),
                                    [&](const auto& one) { return is_marked(one, bridge); });
}

std::set<std::string> Bridge::partitions_from_ros() {
  std::set<std::string> names{node_.partition()};
  for (const BridgeMark& bridge : ros_->bridges()) {
    if (is_neighbour(bridge)) names.insert(bridge.partition);
  }
  return names;
}

}  // namespace tfdude::ros
