#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "partition/directory.hpp"
#include "partition/messages.hpp"
#include "tree/forest.hpp"

// Who must be asked what: an operation as one part for each partition that it concerns, all of which may
// be asked at the same time. Everything is answered from the caller's directory, without sending.
// All errors are those that no request needs to find out; kUnreachable names the partition, kInvalidInput
// what is more than one request holds.
namespace tfdude {

/// One partition's part of an operation.
struct Part {
  Owner owner = kHeldHere;
  std::string partition;  ///< the owner's name
  Request request;        ///< without a sequence number
};

/// A lookup: the parts, and where the answers stand on the path.
struct LookupPlan {
  std::vector<Segment> segments;  ///< in the order of the path; empty where it begins where it ends
  std::vector<Part> parts;        ///< each with its owner's segments in the order of the path
};

/// A request to one owner. @return kUnreachable.
[[nodiscard]] Result<Part> route_to(const Directory& directory, Owner owner, Request request);

/// @param partition  the new frame's owner; empty: that of its parent
/// @return kAlreadyExists, kUnknownParent, kUnknownPartition, kInvalidInput, kUnreachable.
[[nodiscard]] Result<Part> route_add(const Forest& forest, const Directory& directory,
                                     const std::string& id, const AddRequest& request,
                                     const std::string& partition);

/// The frame and all below it, each reachable partition told of those subtrees that it owns. The first part
/// is that of the frame itself, whose owner must be reachable.
/// @return kUnknownFrame, kUnreachable, kInvalidInput.
[[nodiscard]] Result<std::vector<Part>> route_remove(const Forest& forest,
                                                     const Directory& directory,
                                                     const std::string& id);

/// @return kUnknownFrame, kUnreachable, kInvalidInput.
[[nodiscard]] Result<std::vector<Part>> route_update(const Forest& forest,
                                                     const Directory& directory,
                                                     const std::vector<EdgeUpdate>& edges,
                                                     std::optional<Time> stamp = std::nullopt);
[[nodiscard]] Result<std::vector<Part>> route_update(const Forest& forest,
                                                     const Directory& directory,
                                                     const std::vector<PartialUpdate>& edges,
                                                     std::optional<Time> stamp);

/// The same of values that are streamed: whether the owners are reachable or not. @return kUnknownFrame, kInvalidInput.
[[nodiscard]] Result<std::vector<Part>> route_publish(const Forest& forest,
                                                      const Directory& directory,
                                                      const std::vector<EdgeUpdate>& edges,
                                                      std::optional<Time> stamp = std::nullopt);

/// All who have one of the joints, or one that follows it, whether they are reachable or not.
/// @return kUnknownJoint, kInvalidInput.
[[nodiscard]] Result<std::vector<Part>> route_joints(const Directory& directory,
                                                     const JointUpdate& update);

/// @return kUnreachable, naming the first part's partition that is not.
[[nodiscard]] Result<void> check_reachable(const Directory& directory,
                                           const std::vector<Part>& parts);

/// @return kUnknownFrame, kUnknownParent, kCycle, kUnreachable.
[[nodiscard]] Result<Part> route_move(const Forest& forest, const Directory& directory,
                                      const std::string& id, const MoveRequest& request);

/// @param hint  another instant that may be wanted, see LatestHints
/// @return kUnknownStart, kUnknownEnd, kNotConnected, kUnreachable, kInvalidInput.
[[nodiscard]] Result<LookupPlan> route_lookup(const Forest& forest, const Directory& directory,
                                              const std::string& a, const std::string& b,
                                              const Query& query = {},
                                              std::optional<Time> hint = std::nullopt);

/// A watch: the edges that tell where b is in a, in order, and a WatchRequest for each owner of some of them.
struct WatchPlan {
  std::vector<FrameInfo>
      edges;  ///< where it is composed, one a segment, named by the frame where that ends
  std::vector<Part> parts;
};

/// @param composed  whole segments are watched instead of their edges
/// @param period  no more often than this; 0: every sample
/// @return kUnknownStart, kUnknownEnd, kNotConnected, kUnreachable, kInvalidInput.
[[nodiscard]] Result<WatchPlan> route_watch(const Forest& forest, const Directory& directory,
                                            const std::string& a, const std::string& b,
                                            bool composed, std::chrono::nanoseconds period);

/// X_AB of the answers to a plan's parts (same order); identity where the plan has none. The values must be of one
/// instant (one_instant()).
/// @return kNotOwner where an answer has not as many transforms as it was asked for.
[[nodiscard]] Result<StampedTransform> assemble(const LookupPlan& plan,
                                                const std::vector<SegmentValues>& answers);

}  // namespace tfdude
