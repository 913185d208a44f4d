#include "tf_export.hpp"

#include <algorithm>
#include <unordered_map>
#include <utility>

namespace tfdude::ros {
namespace {

/// Climbs from exported frames to the frames above.
class Planner {
 public:
  Planner(const ExportSettings& settings, const std::vector<Frame>& frames, const ExportView& view)
      : settings_(settings), view_(view) {
    for (const Frame& frame : frames) frames_.emplace(frame.id, &frame);
  }

  [[nodiscard]] std::vector<ExportGroup> plan(const std::vector<Frame>& frames) {
    for (const Frame& frame : frames) {
      if (is_chosen(frame)) add_edge(frame);
    }
    std::vector<ExportGroup> groups;
    for (auto& [name, group] : groups_) {
      std::sort(group.watched.begin(), group.watched.end());
      group.watched.erase(std::unique(group.watched.begin(), group.watched.end()),
                          group.watched.end());
      groups.push_back(std::move(group));
    }
    return groups;
  }

 private:
  [[nodiscard]] bool is_chosen(const Frame& frame) const {
    if (view_.from_ros.count(frame.partition) != 0 || !name_of(frame)) return false;
    return settings_.partitions.match(frame.partition) || settings_.frames.match(frame.id);
  }

  [[nodiscard]] bool is_known_to_ros(const Frame& frame) const {
    return is_chosen(frame) || (view_.from_ros.count(frame.partition) != 0 && name_of(frame));
  }

  [[nodiscard]] std::optional<std::string> name_of(const Frame& frame) const {
    return ros_name_of(frame.id, settings_.prefix);
  }

  void add_edge(const Frame& child) {
    std::vector<std::string> path;
    std::set<std::string> partitions;
    const Frame* at = &child;
    bool moves = false;
    do {
      if (view_.reachable.count(at->partition) == 0) return;
      path.push_back(at->id);
      moves = moves || view_.moved_by_joints.count(at->id) != 0;
      partitions.insert(at->partition);
      const auto above = frames_.find(at->parent);
      if (above == frames_.end()) return;
      at = above->second;
    } while (!is_known_to_ros(*at));
    ExportGroup& group = group_of(partitions);
    group.watched.insert(group.watched.end(), path.begin(), path.end());
    group.edges.push_back(
        {at->id, child.id, *name_of(*at), *name_of(child), moves, std::move(path)});
  }

  // The group of these partitions; joins their groups if they have several.
  [[nodiscard]] ExportGroup& group_of(const std::set<std::string>& partitions) {
    const std::string& first = leader_of(*partitions.begin());
    for (const std::string& partition : partitions) {
      const std::string& other = leader_of(partition);
      if (other == first) continue;
      ExportGroup joined = std::move(groups_[other]);
      groups_.erase(other);
      ExportGroup& into = groups_[first];
      into.watched.insert(into.watched.end(), joined.watched.begin(), joined.watched.end());
      into.edges.insert(into.edges.end(), joined.edges.begin(), joined.edges.end());
      leaders_[other] = first;
    }
    return groups_[first];
  }

  [[nodiscard]] const std::string& leader_of(const std::string& partition) {
    auto known = leaders_.emplace(partition, partition).first;
    while (known->second != known->first) known = leaders_.find(known->second);
    return known->first;
  }

  const ExportSettings& settings_;
  const ExportView& view_;
  std::unordered_map<std::string, const Frame*> frames_;
  std::map<std::string, ExportGroup> groups_;   // by the partition that leads it
  std::map<std::string, std::string> leaders_;  // of partitions: itself, or one closer to that
};

TransformStamped message_of(const ExportEdge& edge, const StampedTransform& X) {
  return {X.stamp.value_or(Time()), edge.ros_parent, edge.ros_child, ros_pose_of(X.pose)};
}

bool same(const TransformStamped& a, const TransformStamped& b) {
  return a.parent == b.parent && a.child == b.child && a.pose.xyz == b.pose.xyz &&
         a.pose.quat == b.pose.quat;
}

}  // namespace

std::vector<ExportGroup> plan_export(const ExportSettings& settings,
                                     const std::vector<Frame>& frames, const ExportView& view) {
  return Planner(settings, frames, view).plan(frames);
}

TfMessage SentFrames::changed(const std::vector<ExportEdge>& edges, const Values& values) {
  TfMessage message;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!values[i] || !values[i]->stamp) continue;
    Time& last = stamps_[edges[i].ros_child];
    if (std::exchange(last, *values[i]->stamp) == *values[i]->stamp) continue;
    message.push_back(message_of(edges[i], *values[i]));
  }
  return message;
}

TfMessage SentFrames::between(const std::vector<ExportEdge>& edges, const Values& values,
                              const Stamps& stamps, const Lookup& lookup) const {
  TfMessage message;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto last = stamps_.find(edges[i].ros_child);
    if (!values[i] || !values[i]->stamp || last == stamps_.end()) continue;
    std::set<Time> instants;
    for (const std::string& id : edges[i].path) {
      for (const Time stamp : stamps(id, last->second)) {
        if (stamp < *values[i]->stamp) instants.insert(stamp);
      }
    }
    for (const Time instant : instants) {
      const auto X = lookup(edges[i], instant);
      if (X) message.push_back(message_of(edges[i], *X));
    }
  }
  return message;
}

bool SentFrames::set_static(std::size_t group, const std::vector<ExportEdge>& edges,
                            const Values& values) {
  TfMessage fixed;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    if (!values[i] || values[i]->stamp || edges[i].moves) continue;
    fixed.push_back(message_of(edges[i], *values[i]));
  }
  if (fixed.empty()) return erase_static(group);
  TfMessage& known = static_[group];
  const bool unchanged = std::equal(known.begin(), known.end(), fixed.begin(), fixed.end(), same);
  known = std::move(fixed);
  return !unchanged;
}

TfMessage SentFrames::all_static(Time now) const {
  TfMessage message;
  for (const auto& [group, edges] : static_) {
    message.insert(message.end(), edges.begin(), edges.end());
  }
  for (TransformStamped& one : message) one.stamp = now;
  return message;
}

}  // namespace tfdude::ros
