#pragma once

#include <string>

#include "tfdude/base/result.hpp"

namespace tfdude::cli {

/// Whether this file is where standard output goes, as /dev/stdout.
[[nodiscard]] bool is_standard_output(const std::string& file);

/// Writes a file under another name and renames it, so that it is complete or does not change. A
/// file that is there keeps its mode, and is found through links. What is no regular file (a pipe,
/// a device), and the file of standard output or error, is written to as it is: a pipe waits for
/// its reader.
/// @return kInvalidInput naming the file
[[nodiscard]] Result<void> write_file(const std::string& file, const std::string& bytes);

}  // namespace tfdude::cli
