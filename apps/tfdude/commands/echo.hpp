#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

#include "../../rendering/angles.hpp"

namespace tfdude::cli {

/// A transform in a fixed, small number of lines: position, angles, standard deviations, age.
/// @param now  absent: the age is not known
[[nodiscard]] std::string echo_lines(const std::string& a, const std::string& b,
                                     const StampedTransform& X_AB, std::optional<Time> now,
                                     const AngleUnit& angles,
                                     const std::vector<std::string>& assumed = {});

}  // namespace tfdude::cli
