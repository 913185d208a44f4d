#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "tfdude/types/frame.hpp"
#include "tfdude/types/query.hpp"

#include "../messages.hpp"
#include "names.hpp"

// Which frames of tf-dude are sent to ROS, and when. No DDS, no threads and no clock.
namespace tfdude::ros {

/// A frame is exported if its partition or its id is chosen.
struct ExportSettings {
  Patterns partitions;
  Patterns frames;     ///< by their ids in tf-dude
  std::string prefix;  ///< as ImportSettings::prefix: only frames with it have a name in ROS
  double rate = 100;   ///< at most so many messages a second of an edge [Hz]; 0: every sample
};

/// An exported edge: from a frame to the nearest one above it that ROS knows. What lies between is
/// composed.
struct ExportEdge {
  std::string parent;
  std::string child;
  std::string ros_parent;
  std::string ros_child;
  /// The edge leads over a joint. Before its first sample it is not sent: a listener of tf2 takes
  /// an edge that was once on /tf_static for static from then on.
  bool moves = false;
  std::vector<std::string> path{};  ///< the children of the edges in tf-dude that it consists of

  friend bool operator==(const ExportEdge& a, const ExportEdge& b) {
    return a.parent == b.parent && a.child == b.child && a.ros_parent == b.ros_parent &&
           a.ros_child == b.ros_child && a.moves == b.moves && a.path == b.path;
  }
};

/// Edges that are watched together: those of a partition, or of several partitions if an exported
/// edge leads over them.
struct ExportGroup {
  std::vector<std::string> watched;  ///< the children of all edges in tf-dude that it needs
  std::vector<ExportEdge> edges;

  friend bool operator==(const ExportGroup& a, const ExportGroup& b) {
    return a.watched == b.watched && a.edges == b.edges;
  }
};

/// What a plan depends on, besides the frames.
struct ExportView {
  std::set<std::string> reachable{};  ///< partitions
  /// Partitions with frames that a bridge has taken from this domain of ROS: ROS knows them.
  std::set<std::string> from_ros{};
  std::set<std::string> moved_by_joints{};  ///< frames
};

/// Frames whose edge leads over a partition that is not reachable are left out.
[[nodiscard]] std::vector<ExportGroup> plan_export(const ExportSettings& settings,
                                                   const std::vector<Frame>& frames,
                                                   const ExportView& view);

/// What was sent of all groups, and so what is new.
class SentFrames {
 public:
  /// One per edge, the newest; none: not known.
  using Values = std::vector<std::optional<StampedTransform>>;
  /// The stamps of samples of a frame's edge after an instant, in order.
  using Stamps = std::function<std::vector<Time>(const std::string& id, Time after)>;
  using Lookup = std::function<Result<StampedTransform>(const ExportEdge& edge, Time at)>;

  /// @return the values with a stamp, unless it is that of the last message
  [[nodiscard]] TfMessage changed(const std::vector<ExportEdge>& edges, const Values& values);

  /// Samples since the last message that are not the newest of their edge. Call before changed().
  [[nodiscard]] TfMessage between(const std::vector<ExportEdge>& edges, const Values& values,
                                  const Stamps& stamps, const Lookup& lookup) const;

  /// Keeps the values without a stamp, instead of those that the group had before.
  /// @return whether any of them has changed; then all must be sent
  [[nodiscard]] bool set_static(std::size_t group, const std::vector<ExportEdge>& edges,
                                const Values& values);
  /// Forgets a group. @return whether it had values without a stamp
  [[nodiscard]] bool erase_static(std::size_t group) { return static_.erase(group) != 0; }

  /// All static edges: each message on /tf_static has all of them.
  [[nodiscard]] TfMessage all_static(Time now) const;

 private:
  std::unordered_map<std::string, Time> stamps_;  // last sent, by the child's name in ROS
  std::map<std::size_t, TfMessage> static_;       // by group; none is empty
};

}  // namespace tfdude::ros
