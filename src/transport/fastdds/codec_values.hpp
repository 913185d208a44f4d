#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

// Transforms and positions of joints as sequences of numbers (idl/tfdude.idl): the last of them,
// the covariance or variance, are absent if it is unspecified.
namespace tfdude::fastdds {

using Numbers = std::vector<double>;

inline constexpr std::size_t kPoseNumbers = 7;

/// All 28 numbers, or seven if the covariance is not complete. Does not allocate where the vector
/// has held as many before.
void write_transform(const Transform& X, Numbers& out);
/// All 28 numbers. That the covariance is not complete must be said elsewhere.
void write_numbers(const Transform& X, Numbers& out);
/// The first seven, without the covariance.
void write_pose(const Pose& pose, Numbers& out);

/// Whether the covariance is absent.
[[nodiscard]] bool is_pose_only(const Numbers& in);

/// A transform that a user has given.
/// @return kInvalidInput naming the frame and what is wrong
[[nodiscard]] Result<Transform> read_transform(const Numbers& in, std::string_view frame);

/// A transform that was computed (computed_from()).
/// @return kInvalidInput
[[nodiscard]] Result<Transform> read_computed(const Numbers& in);

/// The covariance of which these are the numbers from `first` on.
[[nodiscard]] Result<Covariance> read_covariance(const Numbers& in, std::size_t first);

}  // namespace tfdude::fastdds
