#include "frames_out.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include <spdlog/spdlog.h>

namespace tfdude::ros {
namespace {

using Clock = cli::Worker::Clock;

// How often it is checked whether the plan still holds.
constexpr std::chrono::milliseconds kLookEvery{100};

// Frames of a partition are not sent sooner after it was discovered. By then it is known whether it
// belongs to another bridge.
constexpr std::chrono::milliseconds kSettled{500};

// The history that is kept here: enough that edges of several owners have an instant in common.
EdgeTiming short_history() {
  EdgeTiming timing;
  timing.span = std::chrono::seconds(1);
  timing.count = 64;
  return timing;
}

}  // namespace

/// Edges that are watched together, and the thread that sends their changes.
class FramesOut::Group {
 public:
  Group(FramesOut& out, std::size_t number, ExportGroup group, EdgesWatch watch)
      : out_(out),
        number_(number),
        group_(std::move(group)),
        watch_(std::move(watch)),
        thread_([this] { run(); }) {}
  ~Group() {
    stopping_ = true;
    thread_.join();
    out_.forget(number_);
  }
  Group(const Group&) = delete;
  Group& operator=(const Group&) = delete;

  [[nodiscard]] const ExportGroup& group() const { return group_; }

 private:
  void run() {
    constexpr std::chrono::milliseconds kPatience{100};  // bounds the time to stop
    while (!stopping_) {
      const std::uint64_t messages = watch_.messages();
      out_.send(number_, group_.edges, watch_);
      while (!stopping_ && !watch_.wait_for_more(messages, Clock::now() + kPatience)) {
      }
    }
  }

  FramesOut& out_;
  const std::size_t number_;
  const ExportGroup group_;
  const EdgesWatch watch_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;  // last: it uses the other members
};

FramesOut::FramesOut(Node& node, ExportSettings settings)
    : node_(node), settings_(std::move(settings)) {}

FramesOut::~FramesOut() { stop(); }

Result<void> FramesOut::start(RosDomain& domain, std::function<std::set<std::string>()> from_ros) {
  from_ros_ = std::move(from_ros);
  auto tf = domain.advertise(tf_topic());
  if (!tf) return tl::unexpected(std::move(tf.error()));
  auto tf_static = domain.advertise(tf_static_topic());
  if (!tf_static) return tl::unexpected(std::move(tf_static.error()));
  tf_ = *std::move(tf);
  tf_static_ = *std::move(tf_static);
  worker_ = std::make_unique<cli::Worker>();
  worker_->repeat(kLookEvery, [this] { look(); });
  return {};
}

void FramesOut::stop() {
  if (worker_ == nullptr) return;
  worker_->stop();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    tf_ = nullptr;
    tf_static_ = nullptr;
  }
  groups_.clear();
}

void FramesOut::on_change() { stale_ = true; }

void FramesOut::look() {
  if (stale_ || incomplete_ || from_ros_() != last_from_ros_) replan();
}

ExportView FramesOut::view() {
  ExportView view;
  last_from_ros_ = view.from_ros = from_ros_();
  const auto partitions = node_.partitions();
  incomplete_ = !partitions.has_value();
  std::map<std::string, Clock::time_point> known_since;
  const auto now = Clock::now();
  for (const PartitionInfo& one : partitions ? *partitions : std::vector<PartitionInfo>()) {
    if (!one.reachable) continue;
    const auto before = known_since_.find(one.name);
    const auto since = before == known_since_.end() ? now : before->second;
    known_since.emplace(one.name, since);
    if (now - since >= kSettled) {
      view.reachable.insert(one.name);
    } else {
      incomplete_ = true;
    }
  }
  known_since_ = std::move(known_since);
  for (const std::string& partition : view.reachable) {
    const auto joints = node_.joints(partition);
    if (!joints) incomplete_ = true;
    for (const JointInfo& joint : joints ? *joints : std::vector<JointInfo>()) {
      view.moved_by_joints.insert(joint.frame);
    }
  }
  return view;
}

void FramesOut::replan() {
  stale_ = false;
  const ExportView now = view();
  const auto frames = node_.frames();
  if (!frames) {
    incomplete_ = true;
    return;
  }
  std::vector<std::unique_ptr<Group>> kept;
  for (ExportGroup& wanted : plan_export(settings_, *frames, now)) {
    const auto same = std::find_if(groups_.begin(), groups_.end(), [&](const auto& group) {
      return group != nullptr && group->group() == wanted;
    });
    if (same != groups_.end()) {
      kept.push_back(std::move(*same));
      continue;
    }
    WatchOptions options;
    options.rate = settings_.rate;
    options.timing = short_history();
    auto watch = node_.watch_edges(wanted.watched, options);
    if (!watch) {
      if (std::exchange(logged_, watch.error().message) != logged_) {
        spdlog::info("not sent to ROS for now: {}", logged_);
      }
      incomplete_ = true;
      continue;
    }
    kept.push_back(
        std::make_unique<Group>(*this, next_group_++, std::move(wanted), *std::move(watch)));
  }
  groups_ = std::move(kept);  // ends the others
}

void FramesOut::send(std::size_t group, const std::vector<ExportEdge>& edges,
                     const EdgesWatch& watch) {
  SentFrames::Values values;
  values.reserve(edges.size());
  for (const ExportEdge& edge : edges) {
    auto X = watch.lookup(edge.parent, edge.child);
    values.push_back(X ? std::optional<StampedTransform>(*std::move(X)) : std::nullopt);
  }
  const auto at = [&](const ExportEdge& edge, Time instant) {
    Query query;
    query.at = instant;
    return watch.lookup(edge.parent, edge.child, query);
  };
  const auto stamps = [&](const std::string& id, Time after) { return watch.stamps(id, after); };
  const std::lock_guard<std::mutex> lock(mutex_);
  auto changed = sent_.between(edges, values, stamps, at);
  auto newest = sent_.changed(edges, values);
  std::move(newest.begin(), newest.end(), std::back_inserter(changed));
  if (tf_ != nullptr && !changed.empty()) tf_->publish(std::move(changed));
  if (sent_.set_static(group, edges, values)) send_static();
}

void FramesOut::forget(std::size_t group) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (sent_.erase_static(group)) send_static();
}

void FramesOut::send_static() {
  // Listeners do not need this stamp.
  if (tf_static_ != nullptr) tf_static_->publish(sent_.all_static(node_.now().value_or(Time())));
}

}  // namespace tfdude::ros
