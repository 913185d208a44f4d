#pragma once

#include <array>
#include <optional>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/math/pose.hpp"
#include "tfdude/math/transform.hpp"

// What the numbers of ROS's covariances mean: some of them are none.
namespace tfdude::ros {

/// Standard deviations that are said where the messages have zeros: three [m], three [rad], along
/// and about the axes of the message's frame. The three parts are added.
struct StddevModel {
  std::array<double, 6> constant{};
  std::array<double, 6> per_metre{};   ///< of distance between both frames
  std::array<double, 6> per_radian{};  ///< between the line of sight and the child's z axis
};

/// Of the child in the frame that sees it. A surface that is seen from the front has angle 0.
[[nodiscard]] TFDUDE_EXPORT std::array<double, 6> stddev_at(const StddevModel& model,
                                                            const Pose& X);

/// How to read the covariances of a topic.
struct Variances {
  bool all_zero_is_exact = false;   ///< a covariance of zeros; otherwise it is unspecified
  bool zero_is_none = false;        ///< one zero beside others tells nothing; otherwise it is exact
  bool minus_one_is_none = false;   ///< -1 as the first number likewise; otherwise the covariance
                                    ///< is unspecified. On another axis it always tells nothing
  std::optional<double> none_from;  ///< variances of at least this tell nothing [m², rad²]
  std::optional<StddevModel> stddev{};  ///< instead of zeros
};

/// An axis of which a message tells nothing has these variances: more than any robot's, and small
/// enough that double precision keeps those of other axes beside them. Larger ones are taken for
/// them. There are no covariances with such an axis.
inline constexpr double kNoPosition = 1e6;  ///< [m²]
inline constexpr double kNoAngle = 1e2;     ///< [rad²]

/// The covariance of a message, in our convention: that of the right perturbation, in the child.
/// Matrices that are singular, or rounded to float32, are taken.
/// @param numbers  6x6, row by row, about axes parallel to the message's frame
/// @return kInvalidInput naming the element: no covariance.
[[nodiscard]] TFDUDE_EXPORT Result<Transform> with_ros_covariance(
    const Pose& X, const Variances& variances, const std::array<double, 36>& numbers);

}  // namespace tfdude::ros
