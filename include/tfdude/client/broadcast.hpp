#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"

namespace tfdude {

/// Sees to it that a frame exists, has this parent, and its edge this value: as a broadcaster of
/// tf2 does, whose first message creates the frame. Adds the frame if it does not exist, moves it
/// if it has another parent, and otherwise updates its edge; each is acknowledged by the owner. If
/// others add or remove the frame at the same time, it is tried again, twice.
/// @param stamp  as of Client::update(): with a stamp the value is a sample
/// @param partition  the owner of a frame that is added; empty: the parent's owner
/// @return as Client::add(), move() and update()
[[nodiscard]] inline Result<void> ensure(Client& client, const std::string& id,
                                         const std::string& parent, const Transform& X_PC,
                                         const std::optional<Time>& stamp = std::nullopt,
                                         const std::string& partition = {}) {
  Result<void> done;
  for (int attempt = 0; attempt < 3; ++attempt) {
    const auto known = client.parent(id);
    if (!known && known.error().code != Errc::kUnknownFrame) {
      return tl::unexpected(known.error());
    }
    const bool there = known && *known == parent;
    if (!known) {
      done = client.add(id, parent, X_PC, partition);
    } else if (!there) {
      done = client.move(id, parent, X_PC);
    }
    // A frame that was added or moved has the value already, for all times.
    if (done && (there || stamp)) done = client.update(id, X_PC, stamp);
    if (done) return done;
    const Errc code = done.error().code;
    if (code != Errc::kAlreadyExists && code != Errc::kUnknownFrame) return done;
    if (attempt < 2) done = {};
  }
  return done;
}

/// Streams values of which each has its own stamp, as a list of transforms that a broadcaster of
/// tf2 sends. Those of one stamp are one commit of each owner; the earliest are sent first.
/// @param stamps  one for each edge
/// @return as Client::publish(): the first error, all others are sent; kInvalidInput, and nothing
///   is sent: there are not as many stamps as edges
[[nodiscard]] inline Result<void> publish(Client& client, const std::vector<EdgeUpdate>& edges,
                                          const std::vector<Time>& stamps) {
  if (stamps.size() != edges.size()) {
    return tl::unexpected(Error{
        Errc::kInvalidInput,
        std::to_string(stamps.size()) + " stamps for " + std::to_string(edges.size()) + " edges"});
  }
  std::map<Time, std::vector<EdgeUpdate>> by_stamp;
  for (std::size_t i = 0; i < edges.size(); ++i) by_stamp[stamps[i]].push_back(edges[i]);
  Result<void> outcome;
  for (const auto& [stamp, share] : by_stamp) {
    if (auto sent = client.publish(share, stamp); !sent && outcome) outcome = std::move(sent);
  }
  return outcome;
}

}  // namespace tfdude
