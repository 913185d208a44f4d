#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/description/urdf.hpp"
#include "tfdude/types/options.hpp"

#include "logic/detections.hpp"
#include "logic/joints.hpp"
#include "logic/poses.hpp"
#include "logic/tf_export.hpp"
#include "logic/tf_import.hpp"
#include "logic/values.hpp"
#include "ros_domain.hpp"

namespace tfdude::ros {

/// A robot of /robot_description, and the partition that serves it.
struct DescriptionSettings {
  std::string partition = "robot";
  UrdfPart part{"/robot_description"};
};

/// What is published on /robot_description: the URDF of a file, or of a partition.
struct DescriptionOutSettings {
  std::string file{};
  std::string partition{};  ///< if there is no file
};

/// All that the command line and the configuration say. What is absent is not passed on.
struct Settings {
  std::string partition = "ros";  ///< for the frames of /tf
  Options options;                ///< of tf-dude's domain
  std::uint32_t ros_domain = 0;
  Range range = Range::kNetwork;
  std::optional<ImportSettings> frames_in = ImportSettings();
  std::optional<ExportSettings> frames_out{};
  std::optional<JointImportSettings> joints_in{};
  std::optional<JointExportSettings> joints_out{};
  std::optional<DescriptionSettings> description_in{};
  std::optional<DescriptionOutSettings> description_out{};
  /// The time of /clock is passed on to all who have an external clock.
  bool passes_clock = false;
  /// How often the time of the external clock is sent to /clock [Hz].
  std::optional<double> clock_out{};
  std::string prefix{};  ///< of all of them
  /// As ImportSettings::drifts, for edges of /tf and of other topics.
  std::map<std::string, Covariance> drifts{};
  std::vector<ValueIn> values_in{};
  std::vector<DetectionsIn> detections_in{};
  std::vector<PoseIn> poses_in{};
  std::vector<PoseOut> poses_out{};
};

/// How the frames of ROS are taken: as for /tf, if that is taken.
[[nodiscard]] ImportSettings import_of(const Settings& settings);

/// @return kInvalidInput: the frames of /tf and a description would be one partition, which nobody
///   can serve twice
[[nodiscard]] Result<void> check_partitions(const Settings& settings);

/// Prepends a prefix to all names of ROS.
void set_prefix(const std::string& prefix, Settings& settings);

/// What ROS's environment says: ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE.
/// @param variable  the value of a variable, empty if it is not set
/// @return kInvalidInput naming the variable.
[[nodiscard]] Result<void> read_environment(
    const std::function<std::string(const char* name)>& variable, Settings& settings);

}  // namespace tfdude::ros
