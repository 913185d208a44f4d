#pragma once

#include <optional>
#include <vector>

#include "tfdude/description/urdf.hpp"

#include "description/urdf_model.hpp"
#include "description/urdf_tree.hpp"

namespace tfdude {

/// What a URDF's joint makes of the edge to its child link.
struct UrdfEdge {
  Transform X_PJ;  ///< its origin
  std::optional<JointSpec> joint;
};

/// The edges of all joints, in the order of tree.joints: what a joint mimics may be outside the part. What those outside mimic
/// may be broken.
/// @param links  that the part has
/// @return kInvalidInput naming file, line and joint: an origin, axis, limit, mimic, or what the part says of a joint, that
///   breaks its rule.
[[nodiscard]] Result<std::vector<UrdfEdge>> read_urdf_edges(const UrdfTree& tree,
                                                            const UrdfJoints& joints,
                                                            const UrdfPart& part,
                                                            const std::vector<std::size_t>& links);

}  // namespace tfdude
