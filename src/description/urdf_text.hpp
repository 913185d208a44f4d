#pragma once

#include <string>
#include <vector>

#include "tfdude/base/result.hpp"

namespace tfdude {

/// What of a URDF concerns frames, as it stands in its file.
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
  };

  std::vector<Link> links;
  std::vector<Joint> joints;
  std::string cleaned;  ///< a URDF of these alone: what else a robot has may be broken
};

/// The failing side of any Result, with its place in front: "arm.urdf:12: ...".
/// @param line  zero where it is not known
[[nodiscard]] tl::unexpected<Error> urdf_error(Errc code, const std::string& file, int line,
                                               const std::string& message);

/// @param file  for messages
/// @return kConfig naming file and line: not XML, not a URDF, one for xacro; kInvalidInput: a link or joint without its name
///   or links, an element that is given twice.
[[nodiscard]] Result<UrdfText> read_urdf_text(const std::string& text, const std::string& file);

}  // namespace tfdude
