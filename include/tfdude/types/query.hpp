#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/belief.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// What a lookup asks for: of what time, and how far covariance is to be propagated.
struct Query {
  std::optional<Time>
      at;  ///< absent: the newest instant of which all moving edges of the path have data
  /// How far beyond an edge's newest sample its motion may be taken to go on as between its last two.
  std::chrono::nanoseconds extrapolate{0};
  /// Until when the answer is to hold: the process noise of the moving edges from the instant of the answer until then
  /// is added to its covariance.
  std::optional<Time> age_noise_until;
  Order order = Order::kSecond;
};

/// What the covariance of an answer rests on. Errors that nothing is said of are taken as independent.
struct Basis {
  Order order = Order::kSecond;
  /// Edges of unknown correlation are on the path: the covariance is a bound that holds for any.
  bool bound = false;
  std::vector<std::string> sources;  ///< that edges of the path share; those of observations, too
};

/// A transform and the instant of which it tells; absent: it holds for all times, as of static edges only.
struct StampedTransform : Transform {
  std::optional<Time> stamp;
  Basis basis{};
};

/// What came of a measurement.
struct Observed {
  double distance_squared = 0;  ///< of it from what was believed: squared Mahalanobis distance
  int dimensions = 0;           ///< in which it has one
  double limit = 0;             ///< of the gate
  bool accepted = false;
  std::vector<std::string> corrected;  ///< edges whose values have changed
  std::optional<Time> stamp;           ///< of moving edges
};

}  // namespace tfdude
