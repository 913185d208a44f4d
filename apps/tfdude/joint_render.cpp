#include "joint_render.hpp"

#include <cmath>

#include "format.hpp"
#include "table.hpp"

namespace tfdude::cli {
namespace {

bool is_prismatic(const JointInfo& joint) { return joint.type == JointType::kPrismatic; }

const char* unit_of(const JointInfo& joint) { return is_prismatic(joint) ? "mm" : "deg"; }

// Degrees or millimetres, the usual units of joints.
double in_unit(const JointInfo& joint, double value) {
  return value * (is_prismatic(joint) ? 1e3 : kDegrees);
}

std::string limits_of(const JointInfo& joint) {
  if (!joint.limits) return "none";
  const auto limit = [&](double value) {
    const double shown = in_unit(joint, value);
    return std::abs(shown) < 9999.5 ? format("%.4g", shown) : format("%.2g", shown);
  };
  return limit(joint.limits->lower) + ".." + limit(joint.limits->upper);
}

// Remarks about a joint, below its row.
std::string remarks_of(const JointInfo& joint) {
  std::string text;
  if (!joint.measured) text += "    no sample yet\n";
  if (joint.mimic) {
    text += format("    mimics %s (x %g + %g)\n", shortened(joint.mimic->joint, 32).c_str(),
                   joint.mimic->multiplier, joint.mimic->offset);
  }
  if (joint.outside > 0) {
    text += format("    outside %llu times\n", static_cast<unsigned long long>(joint.outside));
  }
  if (joint.refused > 0) {
    text += format("    rejected %llu times\n", static_cast<unsigned long long>(joint.refused));
  }
  return text;
}

}  // namespace

std::string joint_table(const std::vector<JointInfo>& joints) {
  if (joints.empty()) return "";
  const auto row = [](const std::string& name, const std::string& frame,
                      const std::string& position, const std::string& stddev, const char* unit,
                      const std::string& limits) {
    return "  " + cell(name, 18) + " " + cell(frame, 15) +
           format(" %10s %9s %-4s %s\n", position.c_str(), stddev.c_str(), unit, limits.c_str());
  };
  std::string text = row("joint", "frame", "position", "std dev", "unit", "limits");
  for (const JointInfo& joint : joints) {
    text += row(joint.name, joint.frame, number(in_unit(joint, joint.position), 3, 10),
                joint.variance ? number(in_unit(joint, std::sqrt(*joint.variance)), 3, 9) : "?",
                unit_of(joint), limits_of(joint)) +
            remarks_of(joint);
  }
  return text;
}

std::string outside_table(const std::vector<JointInfo>& joints) {
  std::string text;
  for (const JointInfo& joint : joints) {
    if (joint.outside == 0 && joint.refused == 0) continue;
    if (text.empty()) {
      text =
          "  " + cell("joint outside limits", 22) +
          format(" %10s %-4s %10s %10s %s\n", "position", "unit", "applied", "rejected", "limits");
    }
    text +=
        "  " + cell(joint.name, 22) +
        format(" %10s %-4s %10s %10s %s\n", number(in_unit(joint, joint.position), 3, 10).c_str(),
               unit_of(joint), number(static_cast<double>(joint.outside), 0, 10).c_str(),
               number(static_cast<double>(joint.refused), 0, 10).c_str(), limits_of(joint).c_str());
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
