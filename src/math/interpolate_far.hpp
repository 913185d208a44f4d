#pragma once

#include "tfdude/math/transform.hpp"

namespace tfdude {

/// As interpolate(), by closed forms: for samples too far apart for the kernel's series,
/// and both complete or both not.
void interpolate_far(const Transform& X0, const Transform& X1, double s, Transform& X);
void interpolate_far(const Pose& X0, const Pose& X1, double s, Pose& X);

}  // namespace tfdude
