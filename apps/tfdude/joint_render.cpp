#include "joint_render.hpp"

#include <algorithm>
#include <cmath>

#include "format.hpp"
#include "table.hpp"
#include "terminal.hpp"

namespace tfdude::cli {
namespace {

bool is_prismatic(const JointInfo& joint) { return joint.type == JointType::kPrismatic; }

// Metres, or the unit of angles.
double in_unit(const JointInfo& joint, double value, const AngleUnit& angles) {
  return is_prismatic(joint) ? value : value * angles.per_radian;
}

const char* unit_of(const JointInfo& joint, const AngleUnit& angles) {
  return is_prismatic(joint) ? "m" : angles.name;
}

std::string position_cell(const JointInfo& joint, double value, const AngleUnit& angles,
                          std::size_t columns) {
  constexpr int kDecimals = 5;  // of metres and radians
  const int decimals = is_prismatic(joint) || angles.per_radian == 1 ? kDecimals : 3;
  return number(in_unit(joint, value, angles), decimals, columns);
}

std::string limits_of(const JointInfo& joint, const AngleUnit& angles) {
  if (!joint.limits) return "none";
  const auto limit = [&](double value) {
    const double shown = in_unit(joint, value, angles);
    return std::abs(shown) < 9999.5 ? format("%.4g", shown) : format("%.2g", shown);
  };
  return limit(joint.limits->lower) + ".." + limit(joint.limits->upper);
}

// Remarks about a joint, below its row.
std::string remarks_of(const JointInfo& joint) {
  std::string text;
  if (!joint.measured) text += "    no sample yet\n";
  if (joint.mimic) {
    text += "    mimics " + shortened(joint.mimic->joint, room(32)) +
            format(" (x %g + %g)\n", joint.mimic->multiplier, joint.mimic->offset);
  }
  if (joint.outside > 0) {
    text += painted(Look::kWarning, format("    outside %llu times\n",
                                           static_cast<unsigned long long>(joint.outside)));
  }
  if (joint.refused > 0) {
    text += painted(Look::kWarning, format("    rejected %llu times\n",
                                           static_cast<unsigned long long>(joint.refused)));
  }
  return text;
}

std::vector<std::string> names_of(const std::vector<JointInfo>& joints,
                                  std::string JointInfo::*name) {
  std::vector<std::string> names;
  for (const JointInfo& joint : joints) names.push_back(joint.*name);
  return names;
}

}  // namespace

std::string position_text(const JointInfo& joint, double position, const AngleUnit& angles) {
  std::string text = format("%.6g %s", in_unit(joint, position, angles), unit_of(joint, angles));
  if (!joint.limits || joint.limits->contain(position)) return text;
  return text + ", outside its limits " + limits_of(joint, angles) + " " + unit_of(joint, angles);
}

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
    std::string line = "    conflict: " + joint.name + " is also a joint of ";
    for (std::size_t i = 0; i < others.size(); ++i) line += (i == 0 ? "" : ", ") + others[i];
    text += painted(Look::kBad, line + "; publish it as " + partition + "/" + joint.name + "\n");
  }
  return text;
}

std::string outside_table(const std::vector<JointInfo>& joints, const AngleUnit& angles) {
  std::string text;
  const std::size_t columns = name_width(names_of(joints, &JointInfo::name), 22);
  for (const JointInfo& joint : joints) {
    if (joint.outside == 0 && joint.refused == 0) continue;
    if (text.empty()) {
      text =
          "  " + cell("joint outside limits", columns) +
          format(" %10s %-4s %10s %10s %s\n", "position", "unit", "applied", "rejected", "limits");
    }
    text += "  " + cell(joint.name, columns) +
            format(" %10s %-4s %10s %10s %s\n",
                   position_cell(joint, joint.position, angles, 10).c_str(), unit_of(joint, angles),
                   number(static_cast<double>(joint.outside), 0, 10).c_str(),
                   number(static_cast<double>(joint.refused), 0, 10).c_str(),
                   limits_of(joint, angles).c_str());
  }
  return text;
}

nlohmann::json joint_json(const JointInfo& joint) {
  nlohmann::json json{{"name", joint.name},
                      {"frame", joint.frame},
                      {"type", to_string(joint.type)},
                      {"position", joint.position},
                      {"variance", nullptr},
                      {"measured", joint.measured},
                      {"outside", joint.outside},
                      {"refused", joint.refused},
                      {"limits", nullptr},
                      {"mimic", nullptr}};
  if (joint.variance) json["variance"] = *joint.variance;
  if (joint.limits) json["limits"] = {joint.limits->lower, joint.limits->upper};
  if (joint.mimic) {
    json["mimic"] = {{"joint", joint.mimic->joint},
                     {"multiplier", joint.mimic->multiplier},
                     {"offset", joint.mimic->offset}};
  }
  return json;
}

}  // namespace tfdude::cli
