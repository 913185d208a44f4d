#include "joints.hpp"

#include <algorithm>
#include <map>

#include "tfdude/base/id.hpp"

namespace tfdude::ros {

JointPositions JointImport::take(const JointState& message) {
  JointPositions out;
  out.stamp = given_stamp(message.stamp);
  std::set<std::string> seen;
  for (std::size_t i = 0; i < message.names.size(); ++i) {
    const std::string& name = message.names[i];
    if (!settings_.joints.takes(name)) continue;
    const std::string scope = settings_.partition.empty() ? "" : settings_.partition + "/";
    std::string id = settings_.prefix + name;
    const bool good = i < message.positions.size() && is_position(message.positions[i]) &&
                      check_id(id, "joint") && seen.insert(id).second;
    if (!good) {
      ++counts_.refused;
      continue;
    }
    const auto own = settings_.stddev_of.find(name);
    const auto stddev = own == settings_.stddev_of.end() ? settings_.stddev : own->second;
    JointValue joint{scope + id, message.positions[i]};
    if (stddev) joint.variance = *stddev * *stddev;
    if (out.stamp) note(joint, *out.stamp, out.reports);
    out.joints.push_back(std::move(joint));
    ++counts_.taken;
  }
  if (!out.stamp && !out.joints.empty()) {
    const auto report =
        stamps_.unstamped("joint " + quote(out.joints.front().name) + " and those beside it",
                          "taken as of the time of its arrival");
    if (report) out.reports.push_back(*report);
  }
  return out;
}

void JointImport::note(const JointValue& joint, Time stamp, std::vector<std::string>& reports) {
  // Names that nobody has here need not be known.
  constexpr std::size_t kMost = 10'000;
  const auto known = newest_.find(joint.name);
  if (known == newest_.end()) {
    if (newest_.size() < kMost) newest_.emplace(joint.name, Newest{stamp, joint.position});
  } else if (stamp != known->second.stamp) {
    // Also after a jump back of time.
    known->second = {stamp, joint.position};
  } else if (joint.position == known->second.position) {
    stamps_.same();
  } else if (const auto report = stamps_.repeated("joint " + quote(joint.name), readable(stamp))) {
    reports.push_back(*report);
  }
}

void JointExport::heard(const JointState& message) {
  // Names that nobody has here need not be known.
  constexpr std::size_t kMost = 10'000;
  for (const std::string& name : message.names) {
    if (from_ros_.size() < kMost && check_id(name, "joint")) from_ros_.insert(name);
  }
}

void JointExport::add(const std::vector<JointInfo>& joints, JointState& message) const {
  for (const JointInfo& joint : joints) {
    auto name = ros_name_of(joint.name, settings_.prefix);
    if (!joint.measured || !name || from_ros_.count(*name) != 0) continue;
    message.names.push_back(*std::move(name));
    message.positions.push_back(joint.position);
  }
}

std::set<std::string> JointExport::drop_repeated(JointState& message) {
  std::map<std::string, int> count;
  for (const std::string& name : message.names) ++count[name];
  JointState once;
  std::set<std::string> repeated;
  for (std::size_t i = 0; i < message.names.size(); ++i) {
    if (count[message.names[i]] > 1) {
      repeated.insert(message.names[i]);
      continue;
    }
    once.names.push_back(message.names[i]);
    once.positions.push_back(message.positions[i]);
  }
  message.names = std::move(once.names);
  message.positions = std::move(once.positions);
  return repeated;
}

}  // namespace tfdude::ros
