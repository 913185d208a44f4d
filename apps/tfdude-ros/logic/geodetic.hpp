#pragma once

#include <string>

#include "tfdude/base/result.hpp"
#include "tfdude/math/ros_variances.hpp"

#include "../messages.hpp"
#include "poses.hpp"

// Places on the Earth, as receivers of satellites publish them. No DDS, no threads and no clock.
namespace tfdude::ros {

/// Whether a message says where it is: a receiver may have no fix, and then has no coordinates.
[[nodiscard]] bool has_place(const GeoPose& message);

/// Whether a message with a stamp is that before it once more.
[[nodiscard]] bool is_repeat(const GeoPose& message, const GeoPose& before);

/// The path from the earth frame to the child. Of a position only, the child has the axes east,
/// north and up, and nothing is known of its rotation; unless the covariance is unspecified.
/// @param earth, child  their names in ROS
/// @return kInvalidInput naming the field: a name, the place, the rotation, a covariance that is
///   not one
[[nodiscard]] Result<Measurement> geodetic_message(const GeoPose& message, const std::string& earth,
                                                   const std::string& child,
                                                   const std::string& prefix,
                                                   const Variances& variances);

}  // namespace tfdude::ros
