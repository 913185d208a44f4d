#pragma once

#include <string>

#include <yaml-cpp/yaml.h>

#include "tfdude/base/result.hpp"

// Checks that yaml-cpp leaves to its users.
namespace tfdude {

/// Rejects control characters: YAML forbids them, except for tabs and line ends, and yaml-cpp takes
/// some of them for the end of the file.
/// @return kConfig naming the file and line.
[[nodiscard]] Result<void> check_bytes(const std::string& name, const std::string& text);

[[nodiscard]] bool is_quoted(const YAML::Node& scalar);

/// Converts YAML's spellings of infinity and NaN to those of from_chars(), and removes the plus of
/// "+1".
[[nodiscard]] std::string plain_number(const std::string& text);

/// Rejects a second document, and aliases that would make a reader work without end: one that
/// stands for what it is in, and those that repeat, or nest, more than a file of people does.
/// Afterwards, a reader may follow aliases as if they were written out. Linear in the text.
/// @return kConfig naming the file and line; throws YAML::Exception if it is not YAML
[[nodiscard]] Result<void> check_documents(const std::string& name, const std::string& text);

}  // namespace tfdude
