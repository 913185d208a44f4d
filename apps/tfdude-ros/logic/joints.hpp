#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "tfdude/types/joint_spec.hpp"

#include "../messages.hpp"
#include "names.hpp"
#include "stamps.hpp"

// The joints of /joint_states and those of tf-dude. No DDS, no threads and no clock.
namespace tfdude::ros {

/// ROS says nothing of the uncertainty of joints.
struct JointImportSettings {
  std::optional<double> stddev{};             ///< of a position [rad or m]; absent: unspecified
  std::map<std::string, double> stddev_of{};  ///< by the name in ROS, for joints with another one
  Choice joints{};                            ///< by the names in ROS
  std::string prefix{};
  std::string partition{};  ///< the only one whose joints are meant; empty: any
};

struct JointCounts {
  std::uint64_t taken = 0;
  std::uint64_t refused = 0;  ///< without a position, or with one that is no number
};

/// As Client::publish_joints() takes them.
struct JointPositions {
  std::optional<Time> stamp;
  std::vector<JointValue> joints;
  std::vector<std::string> reports{};  ///< each once, for the log
};

class JointImport {
 public:
  explicit JointImport(JointImportSettings settings) : settings_(std::move(settings)) {}

  /// Joints without a position are left out; a joint that is named twice has its first position.
  [[nodiscard]] JointPositions take(const JointState& message);

  [[nodiscard]] const JointCounts& counts() const { return counts_; }
  [[nodiscard]] const StampReports& stamps() const { return stamps_; }

 private:
  struct Newest {
    Time stamp;
    double position = 0;
  };

  /// Counts a repeated stamp. The owner decides what holds: it may have cleared its history.
  void note(const JointValue& joint, Time stamp, std::vector<std::string>& reports);

  JointImportSettings settings_;
  JointCounts counts_;
  StampReports stamps_;
  std::unordered_map<std::string, Newest> newest_;  // by the joint's name here
};

struct JointExportSettings {
  Patterns partitions;
  std::string prefix{};
  double rate = 50;  ///< [Hz]
};

/// Joints that nodes of ROS publish are not sent to ROS.
class JointExport {
 public:
  explicit JointExport(JointExportSettings settings) : settings_(std::move(settings)) {}

  [[nodiscard]] const JointExportSettings& settings() const { return settings_; }

  /// A node of ROS publishes these.
  void heard(const JointState& message);

  /// Adds the joints that were measured, and are not published by others.
  void add(const std::vector<JointInfo>& joints, JointState& message) const;

  /// Removes the joints whose names several partitions have: a listener could not tell them apart.
  /// @return their names
  [[nodiscard]] static std::set<std::string> drop_repeated(JointState& message);

 private:
  JointExportSettings settings_;
  std::set<std::string> from_ros_;  // names in ROS
};

}  // namespace tfdude::ros
