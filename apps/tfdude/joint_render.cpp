#include "joint_render.hpp"

#include <cmath>

#include "format.hpp"

namespace tfdude::cli {
namespace {

bool is_prismatic(const JointInfo& joint) { return joint.type == JointType::kPrismatic; }

// A position in degrees or millimetres, the usual units of joints.
std::string shown(const JointInfo& joint, double value) {
  return is_prismatic(joint) ? format("%.3f mm", value * 1e3)
                             : format("%.3f deg", value * kDegrees);
}

std::string limits_of(const JointInfo& joint) {
  if (!joint.limits) return "none";
  const bool prismatic = is_prismatic(joint);
  const double scale = prismatic ? 1e3 : kDegrees;
  return format("%.4g to %.4g %s", joint.limits->lower * scale, joint.limits->upper * scale,
                prismatic ? "mm" : "deg");
}

std::string remarks_of(const JointInfo& joint) {
  std::string text;
  if (!joint.measured) text += "  no sample yet";
  if (joint.mimic) {
    text += format("  mimics %s (x %g %+g)", joint.mimic->joint.c_str(), joint.mimic->multiplier,
                   joint.mimic->offset);
  }
  if (joint.outside > 0) {
    text += format("  outside %llu times", static_cast<unsigned long long>(joint.outside));
  }
  if (joint.refused > 0) {
    text += format("  rejected %llu times", static_cast<unsigned long long>(joint.refused));
  }
  return text;
}

}  // namespace

std::string joint_table(const std::vector<JointInfo>& joints) {
  if (joints.empty()) return "";
  const char* const kRow = "  %-20s %-16s %12s %11s %s\n";
  std::string text = format(kRow, "joint", "frame", "position", "std dev", "limits");
  for (const JointInfo& joint : joints) {
    text +=
        format(kRow, joint.name.c_str(), joint.frame.c_str(), shown(joint, joint.position).c_str(),
               shown(joint, std::sqrt(joint.variance)).c_str(), limits_of(joint).c_str());
    const std::string remarks = remarks_of(joint);
    if (!remarks.empty()) text += "  " + remarks + "\n";
  }
  return text;
}

std::string outside_table(const std::vector<JointInfo>& joints) {
  std::string text;
  for (const JointInfo& joint : joints) {
    if (joint.outside == 0 && joint.refused == 0) continue;
    if (text.empty()) {
      text = format("  %-22s %12s %10s %10s  %s\n", "joint outside limits", "position", "applied",
                    "rejected", "limits");
    }
    text +=
        format("  %-22s %12s %10llu %10llu  %s\n", joint.name.c_str(),
               shown(joint, joint.position).c_str(), static_cast<unsigned long long>(joint.outside),
               static_cast<unsigned long long>(joint.refused), limits_of(joint).c_str());
  }
  return text;
}

nlohmann::json joint_json(const JointInfo& joint) {
  nlohmann::json json{{"name", joint.name},
                      {"frame", joint.frame},
                      {"type", to_string(joint.type)},
                      {"position", joint.position},
                      {"variance", joint.variance},
                      {"measured", joint.measured},
                      {"outside", joint.outside},
                      {"refused", joint.refused},
                      {"limits", nullptr},
                      {"mimic", nullptr}};
  if (joint.limits) json["limits"] = {joint.limits->lower, joint.limits->upper};
  if (joint.mimic) {
    json["mimic"] = {{"joint", joint.mimic->joint},
                     {"multiplier", joint.mimic->multiplier},
                     {"offset", joint.mimic->offset}};
  }
  return json;
}

}  // namespace tfdude::cli
