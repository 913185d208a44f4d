#pragma once

#include <optional>
#include <string>

#include <yaml-cpp/yaml.h>

#include "tfdude/base/result.hpp"

// What yaml-cpp leaves to its users.
namespace tfdude {

/// YAML allows no control characters, and yaml-cpp takes some of them for the end of the file.
/// @return kConfig, naming the file and line.
[[nodiscard]] Result<void> check_bytes(const std::string& name, const std::string& text);

[[nodiscard]] bool is_quoted(const YAML::Node& scalar);

/// YAML's own spellings of infinity and NaN in those that from_chars() knows; "+1" without its plus.
[[nodiscard]] std::string plain_number(const std::string& text);

/// Where a second document begins, if there is one.
[[nodiscard]] std::optional<YAML::Mark> second_document(const std::string& text);

}  // namespace tfdude
