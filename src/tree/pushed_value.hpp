#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/correlation.hpp"
#include "tfdude/types/edge.hpp"

namespace tfdude {

/// What of an edge, while it hangs under this parent, somebody has seen already: to begin with, nothing.
struct EdgeCursor {
  std::string id;
  std::string parent;
  std::uint64_t history = 0;  ///< of the values seen; 0: none
  std::uint64_t commit = 0;   ///< up to which they were seen
  Handle frame{};             ///< found by id where it is not there any more
};

/// A value of one of several edges that somebody follows, by its index among them.
struct PushedValue {
  std::uint32_t index = 0;
  std::optional<Time> stamp;
  Transform X;
  Correlation correlation{};  ///< of the edge, with the last of its values only
  /// Of values that have to do with each other. Where an edge is moved, or added again, or forgets its samples, another one
  /// begins, of a higher number.
  std::uint64_t history = 0;
  /// That of the edge, with the first of its values that is told of a history only.
  std::optional<Covariance> process_noise{};
};

/// Values that were written to edges until a commit.
struct PushedCommit {
  /// Older stamps first, and before them those that hold for all times.
  std::vector<PushedValue> values;
  std::uint64_t commit = 0;
};

/// Which samples of a moving edge are told.
struct PushedQuery {
  bool newest_only = false;
  /// Where nothing was seen yet: those since the last that is not younger than this, instead of the newest.
  std::optional<Time> from{};
  /// Nothing is told as long as one of the edges is not held, or hangs elsewhere: without it, what the others tell may be half
  /// of what was written.
  bool whole = false;
};

}  // namespace tfdude
