#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/types/frame.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

/// A lookup of a program that asks once and then ends.
struct OneShotQuestion {
  std::string a;
  std::string b;
  std::optional<Time> at{};  ///< as of Query
};

/// X_AB, and the owners of its path.
struct OneShotAnswer {
  StampedTransform X_AB;
  std::vector<PathSegment> path;
};

}  // namespace tfdude
