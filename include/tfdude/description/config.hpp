#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/description/urdf.hpp"
#include "tfdude/types/frame.hpp"

namespace tfdude {

/// The content of a daemon's YAML file. docs/configuration.md describes the keys.
struct Config {
  std::string partition;           ///< empty if the file names none
  std::optional<ClockKind> clock;  ///< absent if the file names none
  EdgeTiming history;              ///< default for frames without their own
  bool has_history = false;        ///< the file says it
  /// Of edges for which the file gives none: unspecified, or exact.
  StatedCovariance covariance{};
  std::vector<FrameSpec> frames;
  std::vector<std::string> places;  ///< where each of the frames is described, for messages
  std::vector<std::string> robots;  ///< the text of each URDF
  std::vector<UrdfPart> urdfs;      ///< that were read, as many
};

/// Reads a YAML file and the URDF files that it names.
/// @return kConfig naming the file and line: missing file, not YAML, unknown key, wrong type, or an
///   error of load_urdf(); kInvalidInput naming the file, frame and field: an invalid value.
[[nodiscard]] TFDUDE_EXPORT Result<Config> load_config(const std::string& path);

/// As load_config(), from text. `name` stands for the path in messages; relative URDF paths are
/// relative to its folder.
[[nodiscard]] TFDUDE_EXPORT Result<Config> parse_config(const std::string& text,
                                                        const std::string& name);

/// Appends the frames of a URDF. On an error the configuration stays unchanged.
/// @return errors of load_urdf(); kInvalidInput naming both places: a frame id or joint name that
///   is taken; a cycle.
[[nodiscard]] TFDUDE_EXPORT Result<void> add_urdf(Config& config, const UrdfPart& part);

}  // namespace tfdude
