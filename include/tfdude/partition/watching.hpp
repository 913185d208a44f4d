#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/partition/messages.hpp"
#include "tfdude/tree/forest.hpp"

namespace tfdude {

/// An owner's side of one group of watchers: which of what they watch they have not been sent yet. Not thread-safe; the
/// forest is.
class WatchedGroup {
 public:
  WatchedGroup(std::uint64_t id, WatchRequest request) : id_(id), request_(std::move(request)) {}

  [[nodiscard]] const WatchRequest& request() const { return request_; }

  /// All that is watched, as it is now. @return kNotOwner (naming the frame).
  [[nodiscard]] Result<State> snapshot(const Forest& forest);

  /// What was written since the last call: all samples, or the newest of each edge where the watchers want them at a
  /// lower rate. Edges that are not held any more are left out.
  [[nodiscard]] State news(const Forest& forest);

 private:
  [[nodiscard]] State composed_news(const Forest& forest);

  std::uint64_t id_;
  WatchRequest request_;
  std::vector<EdgeCursor> cursors_;        // by edge
  std::vector<std::optional<News>> sent_;  // by segment
};

}  // namespace tfdude
