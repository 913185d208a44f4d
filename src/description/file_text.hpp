#pragma once

#include <string>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// Reads a whole file of at most 64 MiB. That is room for half a million frames, and also stops
/// reading /dev/zero.
/// @return kConfig naming the file: missing, a directory, not readable, too long.
[[nodiscard]] Result<std::string> read_text(const std::string& path);

}  // namespace tfdude
