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
  FramesIn(Node& node, const ImportSettings& settings)
      : node_(node), structure_(node), import_(settings) {}

  /// @param is_own  whether a bridge is in the same domain of tf-dude: its frames are there already
  /// @return kTransport.
  [[nodiscard]] Result<void> start(RosDomain& domain, const IsNeighbour& is_own);
  /// Nothing is taken any more. Logs what was not.
  void stop();

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
  std::mutex mutex_;  // so that what is decided is also applied before the next decision
  TfImport import_;
  std::atomic<bool> retrying_{false};
  cli::Worker worker_;  // last: it uses the other members
};

}  // namespace tfdude::ros
