#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/client/client.hpp"
#include "tfdude/client/subscription.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/joint_spec.hpp"
#include "tfdude/types/refused.hpp"

namespace tfdude {

/// A process that owns a partition and serves it to others, on its own threads. Otherwise as
/// Client.
class TFDUDE_EXPORT Node : public Client {
 public:
  /// Joins a domain over DDS, makes sure that nobody else serves the partition, takes the frames
  /// and serves them. The frames may be in any order, and parents may be missing or belong to
  /// others.
  ///
  /// With NodeOptions::state, the state that an earlier process left is loaded first. The given
  /// frames are compared with those given to the last process that got any. Only new and changed
  /// frames are applied. Frames that are no longer given are removed, but frames below them stay
  /// and wait for them. An empty list changes nothing.
  ///
  /// Usually takes 0.4 s; at most 5 s plus Options::discovery, if a predecessor still seems to be
  /// running.
  ///
  /// After a hang or a broken link, a Node may learn that another process has taken over its
  /// partition. It then yields, reports a conflict without a frame (on_taken()), and answers every
  /// call with kPartitionTaken.
  /// @return kPartitionTaken (naming host and process), kState (naming the file), the error of the
  ///   first invalid frame, errors of Client::open().
  [[nodiscard]] static Result<Node> open(const std::string& partition,
                                         const std::vector<FrameSpec>& frames = {},
                                         const NodeOptions& options = {});

  /// Joins over any transport.
  [[nodiscard]] static Result<Node> open(TransportPtr transport, const std::string& partition,
                                         const std::vector<FrameSpec>& frames = {},
                                         const NodeOptions& options = {});

  [[nodiscard]] const std::string& partition() const;
  /// The number of frames of the partition.
  [[nodiscard]] std::size_t own_frames() const;
  /// Clears the history of a dynamic edge, as after a jump of its source's clock. The edge stays
  /// dynamic, but lookups fail with kNotYet until its next sample, which may have any stamp. Does
  /// nothing if the edge is static.
  /// @return kUnknownFrame, kNotOwner.
  [[nodiscard]] Result<void> clear_history(const std::string& id);
  /// Likewise for all dynamic edges of the partition, as one commit. @return how many
  std::size_t clear_history();

  /// Sets how an edge behaves in time, and clears its history. For frames that were added; those of
  /// open() have it in their FrameSpec. It is not stored.
  /// @return kUnknownFrame, kNotOwner, kInvalidInput (naming what is wrong with the timing).
  [[nodiscard]] Result<void> set_timing(const std::string& id, const EdgeTiming& timing);

  /// For players of recordings: joints() of this partition are these from now on. They move no
  /// frame. An empty list: those of its frames.
  void show_joints(std::vector<JointInfo> joints);

  /// Gives up frames of the partition without removing those below them, for instance to let
  /// another partition have them. The frames below wait until there is a frame of that id again.
  /// Returns when that is stored, if it is, and published.
  /// @return kUnknownFrame, kNotOwner: then it gives up none; kState.
  [[nodiscard]] Result<void> release(const std::vector<std::string>& ids);

  /// Whether the threads that receive messages, and the one that stores and announces changes, are
  /// alive: waits until the latter has done a round, even if that could not store them.
  /// @return false: not within `wait`, because it hangs, or waits for the disk; or a message has
  ///   been handled for longer than that
  [[nodiscard]] bool responds(Milliseconds wait);

  /// Calls a function when another process has taken over the partition. As on_change(), but it
  /// costs nothing while frames come and go, for which on_change() forms a text each.
  [[nodiscard]] Subscription on_taken(std::function<void(const Change&)> listener);

  /// What limits have rejected since the start.
  [[nodiscard]] RefusedCounts refused() const;

 private:
  using Client::Client;
};

}  // namespace tfdude
