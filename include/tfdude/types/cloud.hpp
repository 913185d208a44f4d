#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "tfdude/math/cloud.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

/// How to bring a cloud of points to another frame.
struct CloudQuery {
  /// Of the lookup. With stamps, `at` must be absent, unless there is a fixed frame.
  Query lookup{};
  /// When each point was measured, as by a rotating lidar: then it is transformed by the pose at
  /// that instant. None: all of them by one pose.
  std::vector<Time> stamps{};
  /// Stamps that fall into one interval of this length are looked up as one, at the middle of those
  /// that occur. Zero: each stamp that occurs is looked up once.
  std::chrono::nanoseconds group{0};
  /// Not empty: frame a is that of the instant `lookup.at` (absent: the last of the stamps), and
  /// this frame is assumed fixed in between, as odom while a lidar turns. So points that a lidar
  /// measured while it drove come to the lidar itself, where it was at one instant.
  std::string fixed{};
  /// Also computes a covariance for each point.
  bool covariances = false;
  /// Of each point's own error, in b [m²].
  Eigen::Matrix3d own = Eigen::Matrix3d::Zero();
};

/// Points in another frame.
/// @tparam Number  double or float
template <class Number>
struct TransformedCloud {
  Eigen::Matrix<Number, 3, Eigen::Dynamic> points;  ///< in the order given
  CloudCovariances<Number> covariances;             ///< no columns, unless asked for
  bool complete = false;  ///< no edge has an unspecified covariance; else those count as exact
  Basis basis{};          ///< of all transforms together
};

}  // namespace tfdude
