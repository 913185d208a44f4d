#pragma once

#include <string>

#include "tfdude/base/result.hpp"

#include "../settings.hpp"

namespace tfdude::ros {

/// Reads a configuration (docs/ros.md) into settings, which keep what it does not name.
/// @return kConfig naming the file and line: missing file, not YAML, unknown key, wrong type;
///   kInvalidInput naming the file, line and key: an invalid value.
[[nodiscard]] Result<void> load_config(const std::string& path, Settings& settings);

/// As load_config(), from text. `name` stands for the path.
[[nodiscard]] Result<void> parse_config(const std::string& text, const std::string& name,
                                        Settings& settings);

}  // namespace tfdude::ros
