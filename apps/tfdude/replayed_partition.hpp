#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/types/partition_news.hpp"

namespace tfdude::cli {

/// A recorded partition that is served again, by a Node of its own.
/// @par Thread safety  One thread at a time.
class ReplayedPartition {
 public:
  /// Serves the partition with these frames and values. @return as Node::open()
  [[nodiscard]] static Result<ReplayedPartition> open(const std::string& name,
                                                      const FramesNews& frames,
                                                      const ValuesNews& values,
                                                      const NodeOptions& options);

  /// New frames and parents are served together with the values that follow, or after settle().
  void apply(const FramesNews& frames);
  /// @return kPartitionTaken: another process serves the partition now
  [[nodiscard]] Result<void> apply(const ValuesNews& values);
  /// Serves the frames that were applied last. Those that cannot be served yet, because their
  /// parent is missing, are tried again by the next call.
  void settle() { settle({}); }
  [[nodiscard]] bool settled() const { return settled_; }
  /// The joints as they are now in the recording.
  void show(std::vector<JointInfo> joints) { node_.show_joints(std::move(joints)); }
  /// The time of the recording is set back.
  [[nodiscard]] Result<void> set_time(Time now) { return node_.set_time(external_time(now)); }
  /// Values that the rules rejected, such as late samples.
  [[nodiscard]] std::size_t rejected() const { return rejected_; }

 private:
  struct Edge {
    std::string parent;
    bool dynamic = false;
    std::optional<Correlation> correlation{};  // absent: not known
    std::optional<Time> untied{};              // its last sample whose correlation is not said
  };

  explicit ReplayedPartition(Node node) : node_(std::move(node)) {}
  void settle(const ValuesNews& values);
  [[nodiscard]] bool place(const WatchedFrame& frame, const WatchedValue* value);
  void begin(const WatchedFrame& frame, const WatchedValue& value, Edge& edge);
  /// What is said of the edge with this value. An edge that drifts has it with each sample, which
  /// names itself. What observations have left of a sample is said of no other one: its correlation
  /// is unknown, as long as the sample is kept.
  [[nodiscard]] static Correlation correlation_of(const WatchedValue& value, const std::string& id,
                                                  Edge& edge);
  /// Says how the edge is correlated, if that is another way than before.
  void say(const std::string& id, Correlation correlation, Edge& edge);
  /// With all of its covariance: only that of a sample says how that sample is correlated.
  [[nodiscard]] static Transform served_as(const WatchedValue& value, const Edge& edge);
  void rewrite(const std::string& id, const ValuesNews& values, std::size_t first, Edge& edge);
  void clear(const std::string& id, const WatchedValue& value, Edge& edge);
  [[nodiscard]] Result<void> flush();
  /// Replaces the sample at the stamp, unless it is the same.
  [[nodiscard]] Result<void> correct(const EdgeUpdate& edge);

  Node node_;
  std::vector<WatchedFrame> frames_;  // as they were applied last
  std::unordered_map<std::string, Edge> served_;
  bool settled_ = true;
  std::size_t rejected_ = 0;
  // Values of one stamp, which become visible together.
  std::vector<EdgeUpdate> batch_;
  std::optional<Time> stamp_;
};

}  // namespace tfdude::cli
