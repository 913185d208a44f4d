#pragma once

#include <map>
#include <string>

#include <urdf_model/joint.h>

#include "description/urdf_text.hpp"

namespace tfdude {

/// A robot's joints as urdfdom reads them, by name.
using UrdfJoints = std::map<std::string, urdf::JointSharedPtr>;

/// @return kConfig naming file, line and joint with urdfdom's reason; it prints nothing.
[[nodiscard]] Result<UrdfJoints> read_urdf_joints(const UrdfText& text, const std::string& file);

}  // namespace tfdude
