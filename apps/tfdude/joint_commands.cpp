#include "commands.hpp"
#include "joint_render.hpp"

// Commands for joints.
namespace tfdude::cli {

int run_joint(Client& client, const Arguments& arguments) {
  const auto stamp = optional_stamp(client, arguments.stamp);
  if (!stamp) return report(stamp.error(), arguments);
  JointValue joint{arguments.id, arguments.position};
  if (const auto stddev = arguments.joint_stddev) joint.variance = *stddev * *stddev;
  const auto updated = client.update_joints({joint}, *stamp);
  return finish(client, updated, arguments, "moved");
}

int run_joints(Source source, const Arguments& arguments) {
  const auto partitions = source.partitions();
  if (!partitions) return refuse(source, partitions.error(), arguments);
  if (partitions->empty()) return refuse(source, {Errc::kUnknownPartition, ""}, arguments);
  nlohmann::json json = nlohmann::json::array();
  std::string text;
  for (const PartitionInfo& partition : *partitions) {
    const auto joints = source.joints(partition.name);
    nlohmann::json one{{"partition", partition.name}, {"reachable", joints.has_value()}};
    if (!joints) {
      text += "partition " + partition.name + ": " + joints.error().message + "\n";
    } else if (!joints->empty()) {
      text += "partition " + partition.name + "\n" + joint_table(*joints);
    }
    if (joints) {
      one["joints"] = nlohmann::json::array();
      for (const JointInfo& joint : *joints) one["joints"].push_back(joint_json(joint));
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
