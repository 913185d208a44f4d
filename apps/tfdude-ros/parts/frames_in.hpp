#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "tfdude/client/node.hpp"

#include "../../worker.hpp"
#include "../logic/tf_import.hpp"
#include "../ros_domain.hpp"
#include "structure.hpp"

namespace tfdude::ros {

/// Makes the frames of /tf and /tf_static those of the partition that the bridge serves.
class FramesIn {
 public:
  /// @param node  serves the partition; outlives it
  /// @param timing  of its edges
  FramesIn(Node& node, const ImportSettings& settings, const EdgeTiming& timing)
      : node_(node), structure_(node), timing_(timing), import_(settings) {}

  /// @param is_own  whether a bridge is in the same domain of tf-dude: its frames are there already
  /// @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain, const IsNeighbour& is_own);
  /// Nothing is taken any more. Logs what was not.
  void stop();

  /// Takes values of another topic than /tf. Thread-safe.
  void take(const TfMessage& values, const std::string& writer) { take(values, writer, false); }
  /// Serves an edge that observations determine (TfImport::hold()). Thread-safe.
  void hold(const TransformStamped& transform);

  /// Serves an edge that observations determine, for all times (TfImport::place()). Thread-safe.
  void place(const TransformStamped& transform);
  /// Removes a frame whose values came from another topic than /tf, unless there are others below
  /// it. Thread-safe. @return whether it is no longer there
  bool drop(const std::string& id);

  /// Serves a frame as a root, until /tf names its parent. Thread-safe.
  void add_root(const std::string& id);
  /// Leaves these frames to another partition of this process, instead of those of the last call.
  /// Thread-safe.
  void give_up(std::set<std::string> frames);

  /// The structure of tf-dude's domain has changed. Thread-safe.
  void on_change(const Change& change);

 private:
  void take(const TfMessage& message, const std::string& writer, bool is_static);
  void apply(const TfImport::Changes& changes);
  void apply(const TfImport::Edit& edit);
  void apply(const TfImport::Batch& batch);
  void rejected(const std::string& id, const Error& error);
  /// Of something that was not applied.
  void log(const std::optional<std::string>& report);
  /// Whether the edge has this sample.
  [[nodiscard]] bool has(const EdgeUpdate& edge, std::optional<Time> stamp);

  Node& node_;
  Structure structure_;
  const EdgeTiming timing_;
  std::mutex mutex_;  // so that what is decided is also applied before the next decision
  TfImport import_;
  std::atomic<bool> retrying_{false};
  cli::Worker worker_;  // last: it uses the other members
};

}  // namespace tfdude::ros
