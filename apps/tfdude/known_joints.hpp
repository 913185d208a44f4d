#pragma once

#include <map>
#include <set>
#include <string>

#include "tfdude/client/client.hpp"

namespace tfdude::cli {

/// The joints of all partitions that answer, by name and as PARTITION/JOINT. A name that several
/// partitions have means none of their joints. One round trip for each partition.
[[nodiscard]] inline std::map<std::string, JointInfo> known_joints(Client& client) {
  std::map<std::string, JointInfo> known;
  std::map<std::string, JointInfo> scoped;
  std::set<std::string> contested;
  const auto partitions = client.partitions();
  if (!partitions) return known;
  for (const PartitionInfo& partition : *partitions) {
    if (!partition.reachable) continue;
    const auto joints = client.joints(partition.name);
    if (!joints) continue;
    for (const JointInfo& joint : *joints) {
      const auto [there, fresh] = known.emplace(joint.name, joint);
      // One that mimics another is not moved by its name.
      if (!fresh && !joint.mimic && !there->second.mimic) contested.insert(joint.name);
      if (there->second.mimic) there->second = joint;
      scoped.emplace(partition.name + "/" + joint.name, joint);
    }
  }
  for (const std::string& name : contested) known.erase(name);
  // A joint with such a name comes before that of a partition.
  known.merge(scoped);
  return known;
}

}  // namespace tfdude::cli
