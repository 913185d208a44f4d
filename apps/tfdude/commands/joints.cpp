#include "joints.hpp"

#include <algorithm>
#include <cmath>

#include "../../rendering/format.hpp"
#include "../../rendering/json.hpp"
#include "../../rendering/table.hpp"
#include "../../rendering/terminal.hpp"
#include "../../rendering/text.hpp"
#include "../commands.hpp"

namespace tfdude::cli {
namespace {

// Remarks about a joint, below its row.
std::string remarks_of(const JointInfo& joint) {
  std::string text;
  if (!joint.measured) text += "    no sample yet\n";
  if (joint.mimic) {
    text += "    mimics " + shortened(joint.mimic->joint, room(32)) +
            format(" (x %g + %g)\n", joint.mimic->multiplier, joint.mimic->offset);
  }
  const auto warn = [&text](const char* what, std::uint64_t times) {
    if (times == 0) return;
    text += painted(Look::kWarning,
                    std::string("    ") + what + " " + std::to_string(times) + " times\n");
  };
  warn("outside", joint.outside);
  warn("rejected", joint.refused);
  return text;
}

}  // namespace

std::string joint_table(const std::vector<JointInfo>& joints, const AngleUnit& angles) {
  if (joints.empty()) return "";
  const std::size_t name_columns = name_width(names_of(joints, &JointInfo::name), 18, 15);
  const std::size_t frame_columns = name_width(names_of(joints, &JointInfo::frame), 15, 18);
  const auto row = [&](const std::string& name, const std::string& frame,
                       const std::string& position, const std::string& stddev, const char* unit,
                       const std::string& limits) {
    return "  " + cell(name, name_columns) + " " + cell(frame, frame_columns) +
           format(" %10s %9s %-4s %s\n", position.c_str(), stddev.c_str(), unit, limits.c_str());
  };
  std::string text =
      painted(Look::kHeader, row("joint", "frame", "position", "std dev", "unit", "limits"));
  for (const JointInfo& joint : joints) {
    text += row(joint.name, joint.frame, position_cell(joint, joint.position, angles, 10),
                joint.variance ? position_cell(joint, std::sqrt(*joint.variance), angles, 9) : "?",
                unit_of(joint, angles), limits_of(joint, angles)) +
            remarks_of(joint);
  }
  return text;
}

void SameNames::add(const std::string& partition, const std::vector<JointInfo>& joints) {
  for (const JointInfo& joint : joints) {
    if (!joint.mimic) partitions_[joint.name].push_back(partition);
  }
}

std::vector<std::string> SameNames::others(const std::string& partition,
                                           const JointInfo& joint) const {
  const auto found = partitions_.find(joint.name);
  if (joint.mimic || found == partitions_.end()) return {};
  std::vector<std::string> others = found->second;
  others.erase(std::remove(others.begin(), others.end(), partition), others.end());
  return others;
}

std::string SameNames::warnings(const std::string& partition,
                                const std::vector<JointInfo>& joints) const {
  std::string text;
  for (const JointInfo& joint : joints) {
    const auto others = this->others(partition, joint);
    if (others.empty()) continue;
    text += painted(Look::kBad, "    conflict: " + joint.name + " is also a joint of " +
                                    joined(others) + "; publish it as " + partition + "/" +
                                    joint.name + "\n");
  }
  return text;
}

namespace {

struct Joints final : Question {
  explicit Joints(CLI::App& app) {
    add_recording(app);
    explain_angles(app);
  }

  int ask_source(Source source, const Common& common) const override {
    const auto partitions = source.partitions();
    if (!partitions) return report_cause(source, partitions.error(), common);
    if (partitions->empty()) {
      return report_cause(source, {Errc::kUnknownPartition, ""}, common);
    }
    std::map<std::string, Result<std::vector<JointInfo>>> joints_of;
    SameNames same_names;
    for (const PartitionInfo& partition : *partitions) {
      const auto& joints =
          joints_of.emplace(partition.name, source.joints(partition.name)).first->second;
      if (joints) same_names.add(partition.name, *joints);
    }
    auto all = nlohmann::json::array();
    std::string text;
    for (const auto& [partition, joints] : joints_of) {
      all.push_back({{"partition", partition}, {"reachable", joints.has_value()}});
      if (!joints) {
        text += "partition " + partition + ": " + joints.error().message + "\n";
        continue;
      }
      if (!joints->empty()) {
        text += "partition " + partition + "\n" + joint_table(*joints, common.angles) +
                same_names.warnings(partition, *joints);
      }
      auto& list = all.back()["joints"] = nlohmann::json::array();
      for (const JointInfo& joint : *joints) {
        list.push_back(joint_json(joint));
        const auto others = same_names.others(partition, joint);
        if (!others.empty()) list.back()["also_in"] = others;
      }
    }
    return answer(common, {{"partitions", std::move(all)}}, text);
  }
};

}  // namespace

void add_joints(Commands& commands) {
  commands.add<Joints>("joints", "list all joints: positions, limits, which joint they mimic",
                       "joints");
}

}  // namespace tfdude::cli
