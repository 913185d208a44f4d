#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tfdude/types/clock_difference.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/partition_info.hpp"

#include "runtime/context.hpp"
#include "runtime/member_runner.hpp"
#include "runtime/requests.hpp"

namespace tfdude {

/// Information about frames and partitions besides their values. Client describes the return
/// values.
/// @par Thread safety  All functions are thread-safe.
class Queries {
 public:
  explicit Queries(const Context& context)
      : structure_(context.structure),
        discovery_(context.discovery),
        requests_(context.requests),
        member_(context.member),
        transport_(context.transport) {}

  [[nodiscard]] Result<std::vector<PathSegment>> path(std::string_view a, std::string_view b,
                                                      const Deadline& deadline);
  [[nodiscard]] Result<std::vector<PathSegment>> path(std::string_view a, std::string_view b) {
    return path(a, b, discovery_.call_deadline());
  }
  [[nodiscard]] Result<Handle> find(std::string_view id);
  [[nodiscard]] Result<FrameInfo> info(const std::string& id, const Deadline& deadline);
  [[nodiscard]] Result<FrameInfo> info(const std::string& id) {
    return info(id, discovery_.call_deadline());
  }
  [[nodiscard]] Result<std::vector<Frame>> frames() { return frames(discovery_.call_deadline()); }
  [[nodiscard]] Result<std::vector<std::string>> children(std::string_view id);
  [[nodiscard]] Result<std::vector<std::string>> roots();
  [[nodiscard]] Result<std::vector<PartitionInfo>> partitions();
  [[nodiscard]] std::size_t own_frames();
  /// The history of a frame's edge, and those of all edges of a partition.
  [[nodiscard]] Result<std::vector<HistoryInfo>> history(const std::string& id);
  [[nodiscard]] Result<std::vector<HistoryInfo>> histories(const std::string& partition);
  [[nodiscard]] Result<ClockDifference> clock_difference(const std::string& partition,
                                                         const Deadline& deadline, int round_trips);

 private:
  [[nodiscard]] Result<std::vector<Frame>> frames(const Deadline& deadline);
  [[nodiscard]] Result<std::vector<Frame>> followed(const Deadline& deadline);
  /// Whether no partition was lost before all of its frames were known here.
  [[nodiscard]] bool knows_all();
  /// Whether others have told frames of a partition that was lost before. @param all  frames()
  [[nodiscard]] bool others_know_missed(const std::vector<Frame>& all);
  /// Of the wanted frames those that owners know, if a partition was lost before this process
  /// started.
  [[nodiscard]] std::vector<KnownFrame> frames_before(const FramesRequest& wanted,
                                                      const Deadline& deadline);

  Structure& structure_;
  Discovery& discovery_;
  Requests& requests_;
  MemberRunner& member_;
  const Transport& transport_;
};

}  // namespace tfdude
