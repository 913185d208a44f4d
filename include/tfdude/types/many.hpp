#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

/// The frames of one lookup among many: X_AB is wanted.
struct FramePair {
  std::string a;
  std::string b;
};

/// Consecutive instants for which there is no answer, for one reason.
struct MissingInstants {
  std::size_t first = 0;  ///< index of the instant
  std::size_t count = 0;
  Error error;  ///< of the first of them
};

/// X_AB at many instants.
struct Trajectory {
  std::vector<std::optional<Transform>> X_AB;  ///< one per instant, in the order given
  std::vector<MissingInstants> missing;        ///< of those that are empty
  /// Of all answers together: their sources and unspecified edges, and whether one is a bound.
  Basis basis;
};

}  // namespace tfdude
