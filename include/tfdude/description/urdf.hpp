#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"
#include "tfdude/types/frame.hpp"

namespace tfdude {

/// What is said of a joint beside its URDF.
struct UrdfJoint {
  /// Before the first sample [rad or m]; absent: rest_position(). A joint that mimics another has none of its own.
  std::optional<double> position{};
  std::optional<double> stddev{};  ///< of that; absent: unmeasured_variance()
  Covariance origin{};             ///< of its origin; of a fixed joint, too
};

/// A URDF file, or a part of it, and how it stands among the other frames.
struct UrdfPart {
  std::string file;
  std::string
      root{};  ///< the frame that the robot's root link hangs under; empty: that link is a root
  Transform X_root{};    ///< of the root link in that frame
  std::string prefix{};  ///< before the names of all links and joints
  /// Which links: each entry LINK (it and all below it) or FROM..TO[..TO]: FROM and all below it, but nothing below a TO.
  /// None: all.
  std::vector<std::string> links{};
  bool strict_limits = false;
  /// By the name in the file, without the prefix; of all joints of the robot, as one may be mimicked from within the part.
  std::map<std::string, UrdfJoint> joints{};
};

/// The frames of a robot's links, each moved by its joint, those above first. Links outside the part are not there; the edge
/// to a link belongs to it, so that a part's topmost links hang under frames of others. Floating and planar joints are edges
/// without a joint. What a URDF says beside frames may be broken.
/// @return kConfig naming the file and line: not there, not a URDF; kInvalidInput naming the file, line and element: unknown
///   parent link, two roots, a zero axis, limits upside down, a name that is taken, what a joint mimics is not there...
[[nodiscard]] TFDUDE_EXPORT Result<std::vector<FrameSpec>> load_urdf(const UrdfPart& part);

/// The same from text; part.file stands for it in messages.
[[nodiscard]] TFDUDE_EXPORT Result<std::vector<FrameSpec>> parse_urdf(const std::string& text,
                                                                      const UrdfPart& part);

}  // namespace tfdude
