#pragma once

#include "tfdude/math/covariance.hpp"
#include "tfdude/math/pose.hpp"

#include "math/kernel.hpp"

namespace tfdude::kernel {

/// Conversions between the library's types and the kernel's.
[[nodiscard]] Columns columns_of(const Pose& X);
[[nodiscard]] Pose pose_of(const Columns& X);
[[nodiscard]] Covariance::Upper upper_of(const Blocks& sigma);

}  // namespace tfdude::kernel
