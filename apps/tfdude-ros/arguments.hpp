#pragma once

#include <optional>

#include "settings.hpp"

namespace tfdude::ros {

/// Prints help and errors of usage itself.
/// @return the exit status if the program should end: after help or wrong usage
[[nodiscard]] std::optional<int> read_arguments(int argc, char** argv, Settings& settings);

}  // namespace tfdude::ros
