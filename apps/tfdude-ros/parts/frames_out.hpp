#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/node.hpp"

#include "../../worker.hpp"
#include "../logic/tf_export.hpp"
#include "../ros_domain.hpp"

namespace tfdude::ros {

/// Sends chosen frames of tf-dude to /tf and /tf_static.
class FramesOut {
 public:
  /// @param node  outlives it
  FramesOut(Node& node, ExportSettings settings);
  ~FramesOut();
  FramesOut(const FramesOut&) = delete;
  FramesOut& operator=(const FramesOut&) = delete;

  /// @param domain  outlives it until stop()
  /// @param from_ros  the partitions with frames from this domain of ROS
  /// @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain,
                                   std::function<std::set<std::string>()> from_ros);
  void stop();

  /// The structure of tf-dude's domain has changed. Thread-safe.
  void on_change();

 private:
  class Group;

  void look();
  void replan();
  /// Also says whether it is incomplete.
  [[nodiscard]] ExportView view();
  void send(std::size_t group, const std::vector<ExportEdge>& edges, const EdgesWatch& watch);
  void forget(std::size_t group);
  /// Call with mutex_.
  void send_static();

  Node& node_;
  const ExportSettings settings_;
  std::function<std::set<std::string>()> from_ros_;
  std::mutex mutex_;  // guards the following members
  SentFrames sent_;
  std::unique_ptr<Publisher> tf_;
  std::unique_ptr<Publisher> tf_static_;  // null once it has stopped
  std::atomic<bool> stale_{true};
  // The following belong to the worker.
  std::set<std::string> last_from_ros_;
  std::map<std::string, cli::Worker::Clock::time_point> known_since_;  // reachable partitions
  bool incomplete_ = true;  // something could not be watched, or is not to be yet
  std::vector<std::unique_ptr<Group>> groups_;
  std::size_t next_group_ = 0;
  std::string logged_;  // the last reason for what is missing
  std::unique_ptr<cli::Worker> worker_;
};

}  // namespace tfdude::ros
