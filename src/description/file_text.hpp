#pragma once

#include <string>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// All of a file, of 64 MiB at most: room for half a million frames, and an end to /dev/zero.
/// @return kConfig naming it: missing, a directory, not readable, longer.
[[nodiscard]] Result<std::string> read_text(const std::string& path);

}  // namespace tfdude
