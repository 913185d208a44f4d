#pragma once

#include <optional>
#include <vector>

#include "tfdude/description/urdf.hpp"

#include "description/urdf_model.hpp"
#include "description/urdf_tree.hpp"

namespace tfdude {

/// The edge from a URDF joint's parent link to its child link.
struct UrdfEdge {
  Transform X_PJ;  ///< its origin
  std::optional<JointSpec> joint;
};

/// The edges of all joints, in the order of tree.joints. Joints outside the part are read as well,
/// because a joint of the part may mimic one of them. A broken mimic outside the part is no error.
/// @param links  the links of the part
/// @return kInvalidInput naming file, line and joint: an invalid origin, axis, limit or mimic, or
/// invalid values of the part for a joint.
[[nodiscard]] Result<std::vector<UrdfEdge>> read_urdf_edges(const UrdfTree& tree,
                                                            const UrdfJoints& joints,
                                                            const UrdfPart& part,
                                                            const std::vector<std::size_t>& links);

}  // namespace tfdude
