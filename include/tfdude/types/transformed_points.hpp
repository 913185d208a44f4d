#pragma once

#include <vector>

#include "tfdude/math/point.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

/// Points in another frame, and the transform by which they came there.
struct TransformedPoints {
  std::vector<TransformedPoint> points;  ///< in the order given
  StampedTransform X_AB;
};

}  // namespace tfdude
