#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "partition/messages.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Whether that can be watched. @return kInvalidInput (the period).
[[nodiscard]] Result<void> check_watch(const WatchRequest& request);

/// An owner's side of one group of watchers: which of what they watch they have not been sent yet. Not thread-safe; the
/// forest is.
class WatchedGroup {
 public:
  WatchedGroup(std::uint64_t id, WatchRequest request);

  [[nodiscard]] const WatchRequest& request() const { return request_; }

  /// All that is watched, as it is now; does not change what next_push() tells.
  /// @param from  as WatchRequest::from; of more samples than a message holds only the newest are told
  /// @return kNotOwner (naming the frame) where an edge is not held, or hangs elsewhere.
  [[nodiscard]] Result<PushedValues> snapshot(const Forest& forest, std::optional<Time> from) const;

  /// What was written since the last call: all samples, or the newest of each edge where the watchers want them at a
  /// lower rate. Nothing while an edge is not held, or hangs elsewhere: the watchers go another way then.
  [[nodiscard]] PushedValues next_push(const Forest& forest);

 private:
  [[nodiscard]] std::vector<EdgeCursor> fresh_cursors() const;
  [[nodiscard]] Result<PushedValues> composed(const Forest& forest, std::optional<Time> from) const;
  [[nodiscard]] PushedValues next_composed_push(const Forest& forest);

  std::uint64_t id_;
  WatchRequest request_;
  std::uint64_t told_ = 0;                        // the commit of the last push
  std::vector<EdgeCursor> cursors_;               // by edge
  std::vector<std::optional<PushedValue>> sent_;  // by composed segment
};

/// The values in pieces that each fit into a message.
[[nodiscard]] std::vector<PushedValues> pieces_of(PushedValues&& pushed);

/// Puts pieces together again, that come in order or not at all.
class PushedPieces {
 public:
  /// @return all values, once the last piece has come
  [[nodiscard]] std::optional<PushedValues> add(const PushedValues& piece);

 private:
  PushedValues whole_;
  std::uint32_t next_ = 0;
};

}  // namespace tfdude
