#pragma once

#include <string>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/partition/partition.hpp"

namespace tfdude {

/// What a daemon's YAML file says. docs/configuration.md describes the keys.
struct Config {
  std::string partition;  ///< empty where the file names none
  EdgeTiming history;     ///< of frames that say nothing else
  std::vector<FrameSpec> frames;
};

/// Reads a YAML file.
/// @return kConfig naming the file and line: missing, not YAML, an unknown key, a wrong type;
///   kInvalidInput naming the file, frame and field: a value that breaks its rule.
[[nodiscard]] Result<Config> load_config(const std::string& path);

/// The same from text; `name` stands for the path in messages.
[[nodiscard]] Result<Config> parse_config(const std::string& text, const std::string& name);

}  // namespace tfdude
