#pragma once

#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/description/urdf.hpp"
#include "tfdude/types/frame.hpp"

namespace tfdude {

/// What a daemon's YAML file says. docs/configuration.md describes the keys.
struct Config {
  std::string partition;  ///< empty where the file names none
  EdgeTiming history;     ///< of frames that say nothing else
  std::vector<FrameSpec> frames;
  std::vector<std::string> places;  ///< where each of the frames is said, for messages
};

/// Reads a YAML file, and the URDFs that it names.
/// @return kConfig naming the file and line: missing, not YAML, an unknown key, a wrong type, or what load_urdf() says;
///   kInvalidInput naming the file, frame and field: a value that breaks its rule.
[[nodiscard]] TFDUDE_EXPORT Result<Config> load_config(const std::string& path);

/// The same from text; `name` stands for the path in messages, and its folder is that of relative URDFs.
[[nodiscard]] TFDUDE_EXPORT Result<Config> parse_config(const std::string& text,
                                                        const std::string& name);

/// Appends the frames of a URDF. The configuration is as it was where there is an error.
/// @return what load_urdf() says; kInvalidInput naming the places of both: the id of a frame or the name of a joint that is
///   taken; a cycle.
[[nodiscard]] TFDUDE_EXPORT Result<void> add_urdf(Config& config, const UrdfPart& part);

}  // namespace tfdude
