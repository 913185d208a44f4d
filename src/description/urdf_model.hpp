#pragma once

#include <map>
#include <string>

#include <urdf_model/joint.h>

#include "description/urdf_text.hpp"

namespace tfdude {

/// A robot's joints as urdfdom reads them, by name.
using UrdfJoints = std::map<std::string, urdf::JointSharedPtr>;

/// Keeps urdfdom from printing its messages.
/// @return kConfig with urdfdom's reason, naming the file and, if known, the joint and its line.
[[nodiscard]] Result<UrdfJoints> read_urdf_joints(const UrdfText& text, const std::string& file);

}  // namespace tfdude
