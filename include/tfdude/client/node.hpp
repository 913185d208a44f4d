#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/client/client.hpp"
#include "tfdude/types/frame.hpp"

namespace tfdude {

/// A process that owns a partition of the frames and serves it to others, from its own threads; the rest
/// as for Client.
class TFDUDE_EXPORT Node : public Client {
 public:
  /// Joins a domain over DDS, makes sure that nobody serves the partition, takes the frames (in any order;
  /// parents may be missing yet or belong to others) and serves them. With Options::state, what an
  /// earlier process left of the partition is taken first; of the given frames those count that were not given,
  /// or given differently, to the last process that was given any, and what was given then and is not now goes, but nothing
  /// below it: that waits for it. No frames change nothing.
  ///
  /// Takes 0.4 s as a rule; 5 s and Options::discovery at most, where a predecessor still seems to be there.
  ///
  /// A Node learns, after a hang or a broken link, that another process has taken its partition since: it then
  /// yields, reports a conflict without a frame, and answers every call with kPartitionTaken.
  /// @return kPartitionTaken (naming host and process), kState (naming the file), the first bad frame's error,
  ///   as Client::open.
  [[nodiscard]] static Result<Node> open(const std::string& partition,
                                         const std::vector<FrameSpec>& frames = {},
                                         const Options& options = {});

  /// Joins over any transport.
  [[nodiscard]] static Result<Node> open(TransportPtr transport, const std::string& partition,
                                         const std::vector<FrameSpec>& frames = {},
                                         const Options& options = {});

  [[nodiscard]] const std::string& partition() const;
  /// How many frames the partition has.
  [[nodiscard]] std::size_t own_frames() const;

 private:
  using Client::Client;
};

}  // namespace tfdude
