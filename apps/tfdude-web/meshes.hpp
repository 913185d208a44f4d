#pragma once

#include <string>
#include <vector>

#include "tfdude/base/result.hpp"

#include "site.hpp"

namespace tfdude::web {

/// Adds what the links of a robot look like: /robot.json, and the meshes (STL, Collada) that its
/// URDF names, as far as they are below the folders or that of the URDF. Without a URDF, a robot
/// without shapes.
/// @param folders  where its packages are: package://NAME/FILE is FOLDER/NAME/FILE, or FOLDER/FILE
///   in a folder of that name
/// @return what was left out, for the log; errors of load_urdf_text()
[[nodiscard]] Result<std::vector<std::string>> add_meshes(const std::string& urdf,
                                                          const std::vector<std::string>& folders,
                                                          Files& files);

}  // namespace tfdude::web
