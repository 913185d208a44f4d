#pragma once

#include <string>

#include "tfdude/types/joint_spec.hpp"

#include "../../rendering/angles.hpp"

namespace tfdude::cli {

/// "0.5 rad", and if so: ", outside its limits -0.1..0.1 rad".
[[nodiscard]] std::string position_text(const JointInfo& joint, double position,
                                        const AngleUnit& angles);

}  // namespace tfdude::cli
