#pragma once

#include <map>
#include <string>

#include "tfdude/client/client.hpp"

namespace tfdude::cli {

/// The joints of all partitions that answer, by name. One round trip for each partition.
[[nodiscard]] inline std::map<std::string, JointInfo> known_joints(Client& client) {
  std::map<std::string, JointInfo> known;
  const auto partitions = client.partitions();
  if (!partitions) return known;
  for (const PartitionInfo& partition : *partitions) {
    if (!partition.reachable) continue;
    const auto joints = client.joints(partition.name);
    if (!joints) continue;
    for (const JointInfo& joint : *joints) known.emplace(joint.name, joint);
  }
  return known;
}

}  // namespace tfdude::cli
