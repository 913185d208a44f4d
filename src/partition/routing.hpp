#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "partition/directory.hpp"
#include "partition/messages.hpp"
#include "tree/forest.hpp"

// Splits an operation into one request for each partition concerned; all may be sent at the same
// time. Everything is computed from the caller's directory, without sending. Errors are those that
// need no request to be detected; kUnreachable names the partition, kInvalidInput the part that
// exceeds a request.
namespace tfdude {

/// One partition's part of an operation.
struct Part {
  Owner owner = kHeldHere;
  std::string partition;  ///< the owner's name
  Request request;        ///< without a sequence number
};

/// A lookup: the requests, and the places of the answers on the path.
struct LookupPlan {
  std::vector<Segment> segments;  ///< in the order of the path; empty if it starts where it ends
  std::vector<Part> parts;        ///< each with its owner's segments in the order of the path
  /// The instant is negative. No sample is so early, and no message can name it, so the parts ask
  /// for zero instead.
  bool before_all = false;
};

/// A request to one owner. @return kUnreachable.
[[nodiscard]] Result<Part> route_to(const Directory& directory, Owner owner, Request request);

/// kUnknownPartition.
[[nodiscard]] tl::unexpected<Error> fail_without_partition(const std::string& name);

/// A request to the partition whose name is its id. @return kUnknownPartition, kUnreachable.
[[nodiscard]] Result<Part> route_to_partition(const Directory& directory, Request request);

/// @param partition  the new frame's owner; empty: that of its parent
/// @return kAlreadyExists, kUnknownParent, kUnknownPartition, kInvalidInput, kUnreachable.
[[nodiscard]] Result<Part> route_add(const Forest& forest, const Directory& directory,
                                     const std::string& id, const AddRequest& request,
                                     const std::string& partition);

/// Removes the frame and all below it: each reachable partition gets the subtrees that it owns. The
/// first part is that of the frame itself, whose owner must be reachable.
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

/// As route_update(), for streamed values, whether the owners are reachable or not.
/// @return kUnknownFrame, kInvalidInput.
[[nodiscard]] Result<std::vector<Part>> route_publish(const Forest& forest,
                                                      const Directory& directory,
                                                      const std::vector<EdgeUpdate>& edges,
                                                      std::optional<Time> stamp = std::nullopt);

/// The owners of the joints (Directory::route_joint()), whether they are reachable or not. Each
/// gets the names that it knows.
/// @return kUnknownJoint, kAmbiguousJoint, kInvalidInput.
[[nodiscard]] Result<std::vector<Part>> route_joints(const Directory& directory,
                                                     const JointUpdate& update);

/// @return kUnreachable, naming the first unreachable partition.
[[nodiscard]] Result<void> check_reachable(const Directory& directory,
                                           const std::vector<Part>& parts);

/// @return kUnknownFrame, kUnknownParent, kCycle, kUnreachable.
[[nodiscard]] Result<Part> route_move(const Forest& forest, const Directory& directory,
                                      const std::string& id, const MoveRequest& request);

/// @param hint  another instant that may be useful, see LatestHints
/// @return kUnknownStart, kUnknownEnd, kNotConnected, kUnreachable, kInvalidInput.
[[nodiscard]] Result<LookupPlan> route_lookup(const Forest& forest, const Directory& directory,
                                              const std::string& a, const std::string& b,
                                              const Query& query = {},
                                              std::optional<Time> hint = std::nullopt);

/// A watch: the edges between a and b, in order, and a WatchRequest for each owner of some of them.
struct WatchPlan {
  std::vector<FrameInfo> edges;  ///< if composed, one per segment, named by the frame at its end
  std::vector<Part> parts;
};

/// @param composed  whole segments are watched instead of their edges
/// @param period  minimum interval; 0: every sample
/// @return kUnknownStart, kUnknownEnd, kNotConnected, kUnreachable, kInvalidInput.
[[nodiscard]] Result<WatchPlan> route_watch(const Forest& forest, const Directory& directory,
                                            const std::string& a, const std::string& b,
                                            bool composed, std::chrono::nanoseconds period);

/// As route_watch(), for the edges of these frames, in their order.
/// @return kUnknownFrame, kUnreachable, kInvalidInput (a root; too many edges).
[[nodiscard]] Result<WatchPlan> route_watch_edges(const Forest& forest, const Directory& directory,
                                                  const std::vector<std::string>& ids,
                                                  std::chrono::nanoseconds period);

}  // namespace tfdude
