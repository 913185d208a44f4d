#pragma once

#include <map>
#include <string>
#include <vector>

#include "tfdude/types/joint_spec.hpp"

#include "../../rendering/angles.hpp"

namespace tfdude::cli {

/// All joints of a partition as a table.
[[nodiscard]] std::string joint_table(const std::vector<JointInfo>& joints,
                                      const AngleUnit& angles);

/// Joints of several partitions that have the same name, though each moves a frame of its own.
class SameNames {
 public:
  void add(const std::string& partition, const std::vector<JointInfo>& joints);

  /// The other partitions that have a joint of that name.
  [[nodiscard]] std::vector<std::string> others(const std::string& partition,
                                                const JointInfo& joint) const;
  /// A line for each of these joints.
  [[nodiscard]] std::string warnings(const std::string& partition,
                                     const std::vector<JointInfo>& joints) const;

 private:
  std::map<std::string, std::vector<std::string>> partitions_;  // by the joint's name
};

}  // namespace tfdude::cli
