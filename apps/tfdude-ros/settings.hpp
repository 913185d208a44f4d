#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tfdude/types/options.hpp"

#include "logic/tf_export.hpp"
#include "logic/tf_import.hpp"
#include "ros_domain.hpp"

namespace tfdude::ros {

/// All that the command line and the configuration say.
struct Settings {
  std::string partition = "ros";  ///< for the frames of /tf
  Options options;                ///< of tf-dude's domain
  std::uint32_t ros_domain = 0;
  Range range = Range::kNetwork;
  std::optional<ImportSettings> frames_in = ImportSettings();  ///< none: /tf is not read
  std::optional<ExportSettings> frames_out;                    ///< none: /tf is not written
};

/// What ROS's environment says: ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE.
/// @param variable  the value of a variable, empty if it is not set
/// @return kInvalidInput naming the variable.
[[nodiscard]] Result<void> read_environment(
    const std::function<std::string(const char* name)>& variable, Settings& settings);

}  // namespace tfdude::ros
