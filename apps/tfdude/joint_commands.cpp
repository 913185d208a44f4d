#include <map>

#include "tfdude/base/id.hpp"

#include "../numbers.hpp"
#include "commands.hpp"
#include "joint_render.hpp"
#include "known_joints.hpp"
#include "samples.hpp"

// Commands for joints.
namespace tfdude::cli {
namespace {

struct Typed {
  std::string name;
  double position;
};

// NAME=POSITION..., or NAME POSITION. A name may contain '=', a position cannot.
Result<std::vector<Typed>> typed_joints(const std::vector<std::string>& words) {
  if (words.size() == 2 && is_number(words[1])) {
    return std::vector<Typed>{{words[0], std::strtod(words[1].c_str(), nullptr)}};
  }
  std::vector<Typed> typed;
  for (const std::string& word : words) {
    const std::size_t equals = word.rfind('=');
    const std::string number = equals == std::string::npos ? "" : word.substr(equals + 1);
    if (!is_number(number)) {
      return fail(Errc::kInvalidInput, quote(word) + " is not NAME=POSITION");
    }
    typed.push_back({word.substr(0, equals), std::strtod(number.c_str(), nullptr)});
  }
  if (typed.empty()) return fail(Errc::kInvalidInput, "no joint is given: NAME=POSITION");
  return typed;
}

Result<std::vector<JointValue>> values_of(const std::vector<Typed>& typed, const Arguments& said,
                                          const SampleReader& units) {
  std::vector<JointValue> values;
  for (const Typed& joint : typed) {
    const auto position = units.position(joint.name, joint.position);
    if (!position) return tl::unexpected(position.error());
    values.push_back({joint.name, *position});
    if (!said.joint_stddev) continue;
    const double stddev = *units.position(joint.name, *said.joint_stddev);
    values.back().variance = stddev * stddev;
  }
  return values;
}

}  // namespace

int run_joint(Client& client, const Arguments& arguments) {
  if (!arguments.from.empty()) return send_lines(client, arguments, true);
  const auto typed = typed_joints(arguments.joints);
  if (!typed) {
    (void)report(typed.error(), arguments);
    return kWrongUsage;
  }
  const auto stamp = optional_stamp(client, arguments.stamp);
  if (!stamp) return report(stamp.error(), arguments);
  const auto known = known_joints(client);
  const auto values = values_of(*typed, arguments, SampleReader(arguments.angles, known));
  if (!values) return refuse(client, values.error(), arguments);
  const auto updated = client.update_joints(*values, *stamp);
  if (!updated) return refuse(client, updated.error(), arguments);
  nlohmann::json json = nlohmann::json::array();
  std::string text;
  for (const JointValue& value : *values) {
    const auto joint = known.find(value.name);
    json.push_back({{"name", value.name}, {"position", value.position}});
    text += "moved " + value.name;
    if (joint != known.end()) {
      const JointInfo& info = joint->second;
      json.back()["outside"] = info.limits && !info.limits->contain(value.position);
      text += " to " + position_text(info, value.position, arguments.angles);
    }
    text += "\n";
  }
  return answer(arguments, {{"done", "moved"}, {"joints", std::move(json)}}, text);
}

int run_joints(Source source, const Arguments& arguments) {
  const auto partitions = source.partitions();
  if (!partitions) return refuse(source, partitions.error(), arguments);
  if (partitions->empty()) return refuse(source, {Errc::kUnknownPartition, ""}, arguments);
  std::map<std::string, Result<std::vector<JointInfo>>> joints_of;
  SameNames same_names;
  for (const PartitionInfo& partition : *partitions) {
    const auto& joints =
        joints_of.emplace(partition.name, source.joints(partition.name)).first->second;
    if (joints) same_names.add(partition.name, *joints);
  }
  nlohmann::json json = nlohmann::json::array();
  std::string text;
  for (const auto& [partition, joints] : joints_of) {
    nlohmann::json one{{"partition", partition}, {"reachable", joints.has_value()}};
    if (!joints) {
      text += "partition " + partition + ": " + joints.error().message + "\n";
    } else if (!joints->empty()) {
      text += "partition " + partition + "\n" + joint_table(*joints, arguments.angles) +
              same_names.warnings(partition, *joints);
    }
    if (joints) {
      one["joints"] = nlohmann::json::array();
      for (const JointInfo& joint : *joints) {
        one["joints"].push_back(joint_json(joint));
        const auto others = same_names.others(partition, joint);
        if (!others.empty()) one["joints"].back()["also_in"] = others;
      }
    }
    json.push_back(std::move(one));
  }
  return answer(arguments, {{"partitions", std::move(json)}}, text);
}

int run_description(Client& client, const Arguments& arguments) {
  const auto text = client.description(arguments.partition);
  if (!text) return refuse(client, text.error(), arguments);
  if (text->empty()) {
    return report({Errc::kInvalidInput, "partition '" + arguments.partition +
                                            "' has no description: it serves no URDF, or several"},
                  arguments);
  }
  return answer(arguments, {{"partition", arguments.partition}, {"description", *text}}, *text);
}

}  // namespace tfdude::cli
