#include "geodetic.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tfdude/math/earth.hpp"

#include "names.hpp"
#include "stamps.hpp"

namespace tfdude::ros {
namespace {

using Numbers = std::array<double, 36>;

// As PoseWithCovariance has it; zeros where the message has nothing.
Numbers numbers_of(const GeoPose& message) {
  Numbers numbers{};
  for (std::size_t i = 0; message.covariance && i < 9; ++i) {
    numbers[6 * (i / 3) + i % 3] = (*message.covariance)[i];
  }
  return numbers;
}

// The covariance of the pose in the axes east, north and up.
Result<Transform> with_covariance(const GeoPose& message, const Pose& X_NB,
                                  const Variances& variances) {
  Numbers numbers = numbers_of(message);
  const bool told =
      std::any_of(numbers.begin(), numbers.end(), [](double one) { return one != 0; });
  const bool configured = variances.stddev || variances.all_zero_is_exact;
  if (!message.quat && (told || configured)) {
    for (std::size_t axis = 3; axis < 6; ++axis) {
      numbers[7 * axis] = std::numeric_limits<double>::infinity();
    }
  }
  return with_ros_covariance(X_NB, variances, numbers);
}

}  // namespace

bool has_place(const GeoPose& message) {
  return message.fixed && std::all_of(message.place.begin(), message.place.end(),
                                      [](double one) { return !std::isnan(one); });
}

bool is_repeat(const GeoPose& message, const GeoPose& before) {
  return given_stamp(message.stamp) && message.stamp == before.stamp &&
         message.place == before.place && message.quat == before.quat &&
         message.covariance == before.covariance;
}

Result<Measurement> geodetic_message(const GeoPose& message, const std::string& earth,
                                     const std::string& child, const std::string& prefix,
                                     const Variances& variances) {
  auto a = id_of(earth, prefix);
  if (!a) return tl::unexpected(std::move(a.error()));
  auto b = id_of(child, prefix);
  if (!b) return tl::unexpected(std::move(b.error()));
  const auto X_EN = enu_pose({message.place[0], message.place[1], message.place[2]});
  if (!X_EN) return tl::unexpected(X_EN.error());
  const auto X_NB = message.quat ? pose_of(RosPose{{}, *message.quat}) : Result<Pose>(Pose());
  if (!X_NB) return tl::unexpected(X_NB.error());
  const auto seen = with_covariance(message, *X_NB, variances);
  if (!seen) return tl::unexpected(seen.error());
  return Measurement{*std::move(a), *std::move(b), Transform{*X_EN * *X_NB, seen->covariance},
                     given_stamp(message.stamp)};
}

}  // namespace tfdude::ros
