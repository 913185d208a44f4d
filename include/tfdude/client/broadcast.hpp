#pragma once

#include <optional>
#include <string>

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

}  // namespace tfdude
