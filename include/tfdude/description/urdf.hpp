#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/types/frame.hpp"

namespace tfdude {

/// Settings of a joint that the URDF does not have.
struct UrdfJoint {
  /// Before the first sample [rad or m]; absent: rest_position(). Not for a joint that mimics
  /// another.
  std::optional<double> position{};
  /// Of the position [rad or m]; absent: unspecified until the first sample, as nobody has measured
  /// it.
  std::optional<double> stddev{};
  /// Of the joint's origin. Absent: exact for a joint that moves, as its error is that of its
  /// position; UrdfPart::fixed for one that does not.
  std::optional<StatedCovariance> origin{};
  /// Of samples that come without one [rad or m]; absent: unspecified. Not for a joint that mimics
  /// another.
  std::optional<double> sample_stddev{};
};

/// A URDF file, or a part of it, and its place among the other frames.
struct UrdfPart {
  std::string file;
  std::string root{};    ///< parent frame of the robot's root link; empty: the link is a root
  Transform X_root{};    ///< of the root link in that frame
  std::string prefix{};  ///< prepended to the names of all links and joints
  /// The links to load. Each entry is LINK (the link and all below it) or FROM..TO[..TO] (FROM and
  /// all below it, but nothing below a TO). Empty: all links.
  std::vector<std::string> links{};
  bool strict_limits = false;
  StatedCovariance fixed{};  ///< of joints that do not move, without their own
  /// By the name in the file, without the prefix; for all joints of the robot, since a joint of the
  /// part may mimic one outside it.
  std::map<std::string, UrdfJoint> joints{};
};

/// Reads the frames of a robot's links, each moved by its joint, parents first. Links outside the
/// part are left out. An edge belongs to its child link, so the topmost links of a part have
/// parents outside it. Floating and planar joints become edges without a joint. URDF content other
/// than frames and joints is ignored, even if it is malformed.
/// @return kConfig naming the file and line: a missing file, not a URDF; kInvalidInput naming the
///   file, line and element: unknown parent link, two roots, a zero axis, a lower limit above the
///   upper, a name that is taken, an unknown joint in a mimic...
[[nodiscard]] TFDUDE_EXPORT Result<std::vector<FrameSpec>> load_urdf(const UrdfPart& part);

/// As load_urdf(), from text; part.file stands for the file in messages.
[[nodiscard]] TFDUDE_EXPORT Result<std::vector<FrameSpec>> parse_urdf(const std::string& text,
                                                                      const UrdfPart& part);

/// The part without the links whose frames others own: what is left for a daemon beside them. It is
/// without `root` if the robot's root link is not left.
/// @param taken  ids of frames, so with the prefix
/// @return nothing if no link is left; errors of load_urdf(); kInvalidInput: names of links have
///   "..", so that no entries say it
[[nodiscard]] TFDUDE_EXPORT Result<std::optional<UrdfPart>> urdf_without(
    const UrdfPart& part, const std::set<std::string>& taken);

}  // namespace tfdude
