#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// The parts of a URDF that concern frames, as the file has them.
struct UrdfText {
  struct Link {
    std::string name;
    int line = 0;
  };
  struct Joint {
    std::string name;
    int line = 0;
    std::string parent;
    std::string child;
    /// That of the origin, if it is given as a quaternion; of any length.
    std::optional<Eigen::Quaterniond> rotation;
  };

  std::vector<Link> links;
  std::vector<Joint> joints;
  std::string cleaned;  ///< a URDF with only these parts: all other parts may be malformed
};

/// @param file  for messages
/// @return kConfig naming file and line: not XML, not a URDF, or a file for xacro; kInvalidInput: a
/// link or joint without a name, a joint without its links, a duplicate element, a limit or a
/// quaternion that is none.
[[nodiscard]] Result<UrdfText> read_urdf_text(const std::string& text, const std::string& file);

}  // namespace tfdude
