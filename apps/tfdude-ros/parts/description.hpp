#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/node.hpp"

#include "../../worker.hpp"
#include "../ros_domain.hpp"
#include "../settings.hpp"
#include "frames_in.hpp"

namespace tfdude::ros {

/// Serves the robot of /robot_description as a partition, as a daemon serves that of a file. A new
/// description replaces it.
class DescriptionIn {
 public:
  /// @param options  as for a daemon
  /// @param frames_in  gives up frames of the robot; null: /tf is not read
  DescriptionIn(DescriptionSettings settings, Options options, FramesIn* frames_in)
      : settings_(std::move(settings)), options_(std::move(options)), frames_in_(frames_in) {}

  /// @param is_own  as for FramesIn. @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain, const IsNeighbour& is_own);
  void stop();

  /// Waits until a robot is served. @return false at the end of the patience
  bool wait_until_served(std::chrono::milliseconds patience);

 private:
  void take(const std::string& text);
  void leave_root_to_tf(std::vector<FrameSpec>& frames);

  const DescriptionSettings settings_;
  const Options options_;
  FramesIn* const frames_in_;
  std::string text_;          // of the robot that is served
  std::optional<Node> node_;  // serves it
  std::mutex mutex_;
  std::condition_variable changed_;
  bool served_ = false;
  cli::Worker worker_{4};  // last: it uses the other members
};

/// Publishes the URDF of a file, or of a partition, on /robot_description, also for late nodes.
class DescriptionOut {
 public:
  DescriptionOut(Client& client, DescriptionOutSettings settings)
      : client_(client), settings_(std::move(settings)) {}

  /// @return kConfig naming the file, kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain);
  /// Asks the partition's daemon, which may serve another description. Thread-safe; does not wait.
  void look();
  void on_change(const Change& change);
  /// Before the domain ends.
  void stop();

 private:
  [[nodiscard]] Result<void> publish(const std::string& text);
  void ask();

  Client& client_;
  const DescriptionOutSettings settings_;
  std::unique_ptr<Publisher> publisher_;
  std::string text_;
  cli::Worker worker_{4};  // last: it uses the other members
};

}  // namespace tfdude::ros
