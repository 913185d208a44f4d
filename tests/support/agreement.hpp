#pragma once

#include <string>

#include "tfdude/client/client.hpp"

#include "support/oracle.hpp"
#include "support/pose_diff.hpp"

namespace tfdude::testing {

/// Empty if the client sees the oracle's frames with their parents, and no other; else the first
/// that differs.
[[nodiscard]] inline std::string structure_diff(Client& client, const Oracle& oracle) {
  const auto frames = client.frames().value();
  const auto ids = oracle.ids();
  for (std::size_t i = 0; i < frames.size() || i < ids.size(); ++i) {
    const std::string seen = i < frames.size() ? frames[i].id : "nothing";
    const std::string expected = i < ids.size() ? ids[i] : "nothing";
    if (seen != expected) return "there is " + seen + " where " + expected + " should be";
    if (frames[i].parent != oracle.parent(seen)) {
      return seen + " hangs under " + frames[i].parent + ", not " + oracle.parent(seen);
    }
  }
  return "";
}

/// Empty if the client looks up what the oracle computes, for every ordered pair of its frames;
/// else the first that differs.
[[nodiscard]] inline std::string lookups_diff(Client& client, const Oracle& oracle) {
  const auto ids = oracle.ids();
  for (const std::string& a : ids) {
    for (const std::string& b : ids) {
      const auto X_AB = client.lookup(a, b);
      const std::string difference = X_AB ? transform_diff(*X_AB, oracle.between(a, b), 1e-9)
                                          : std::string(X_AB.error().message);
      if (!difference.empty()) return "lookup of " + b + " in " + a + ": " + difference;
    }
  }
  return "";
}

}  // namespace tfdude::testing
