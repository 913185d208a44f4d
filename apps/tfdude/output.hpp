#pragma once

#include <string>

#include "tfdude/base/result.hpp"

namespace tfdude::cli {

/// Writes a file under another name and renames it, so that it is complete or does not change.
/// @return kInvalidInput naming the file
[[nodiscard]] Result<void> write_file(const std::string& file, const std::string& bytes);

}  // namespace tfdude::cli
