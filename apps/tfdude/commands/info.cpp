#include <array>
#include <optional>
#include <string>

#include "tfdude/base/id.hpp"
#include "tfdude/recording/recording.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/json.hpp"
#include "../../rendering/quantities.hpp"
#include "../commands.hpp"

namespace tfdude::cli {
namespace {

// What was found in transforms of ROS.
struct Kind {
  const char* key;
  const char* meaning;
  std::size_t TransformCounts::*count;
  bool left_out = true;
};

constexpr std::array<Kind, 10> kKinds{{
    {"messages", "messages that cannot be read", &TransformCounts::messages},
    {"names", "a name that cannot be an id", &TransformCounts::names},
    {"values", "not a rigid transform, or a frame in itself", &TransformCounts::values},
    {"cycles", "the parent is below the frame", &TransformCounts::cycles},
    {"repeated", "another value for a stamp that was there before", &TransformCounts::repeated},
    {"old", "older than the stamps that are remembered", &TransformCounts::old},
    {"early", "a negative stamp", &TransformCounts::early},
    {"same", "repeats of a sample", &TransformCounts::same, false},
    {"unstamped", "a stamp of 0; taken as of the time when they were logged",
     &TransformCounts::unstamped, false},
    {"jumps", "the time of an edge jumped back; its samples before were dropped",
     &TransformCounts::jumps, false},
}};

nlohmann::json json_of(const std::optional<TransformCounts>& counts) {
  if (!counts) return nullptr;
  nlohmann::json json = nlohmann::json::object();
  for (const Kind& kind : kKinds) json[kind.key] = (*counts).*kind.count;
  return json;
}

std::string describe(const TransformCounts& counts) {
  std::string text;
  for (const Kind& kind : kKinds) {
    const std::size_t count = counts.*kind.count;
    if (count == 0) continue;
    text += (kind.left_out ? "left out     " : "found        ") + std::to_string(count) + " " +
            kind.key + ": " + kind.meaning + "\n";
  }
  return text;
}

nlohmann::json json_of(const Recording& recording, const std::string& file) {
  const RecordingSummary summary = recording.summary();
  nlohmann::json json{{"file", file},
                      {"bytes", summary.bytes},
                      {"written_by", summary.library},
                      {"foreign", summary.foreign},
                      {"finished", summary.finished},
                      {"chunks", summary.chunks},
                      {"left_out", summary.left_out.value_or(0)},
                      {"transforms", json_of(summary.transforms)},
                      {"problems", summary.problems},
                      {"messages", or_null(summary.messages)},
                      {"start_ns", nullptr},
                      {"end_ns", nullptr},
                      {"seconds", nullptr},
                      {"partitions", nlohmann::json::array()}};
  if (summary.start && summary.end) {
    json["start_ns"] = nanoseconds(*summary.start);
    json["end_ns"] = nanoseconds(*summary.end);
    json["seconds"] = seconds(*summary.end - *summary.start);
  }
  for (const PartitionInfo& partition : recording.partitions()) {
    const auto joints = recording.joints(partition.name);
    json["partitions"].push_back({{"name", partition.name},
                                  {"frames", partition.frames},
                                  {"joints", joints ? joints->size() : 0},
                                  {"reachable", partition.reachable}});
  }
  return json;
}

std::string describe(const Recording& recording) {
  const RecordingSummary summary = recording.summary();
  std::string text = "written by   " + printable(summary.library) +
                     (summary.foreign ? " (transforms of ROS only)\n" : "\n");
  if (summary.start && summary.end) {
    text += "from         " + to_string(*summary.start) + "\n";
    text += "to           " + to_string(*summary.end) +
            format("  (%.3f s)\n", seconds(*summary.end - *summary.start));
  } else {
    text += "empty\n";
  }
  text += format("size         %.3f MB in %zu chunks", static_cast<double>(summary.bytes) / 1e6,
                 summary.chunks);
  if (summary.messages) text += ", " + std::to_string(*summary.messages) + " messages";
  text += "\n";
  if (recording.partitions().empty()) text += "partition    none\n";
  for (const PartitionInfo& partition : recording.partitions()) {
    text += "partition    " + partition.name + ": " + std::to_string(partition.frames) + " frames";
    const auto joints = recording.joints(partition.name);
    if (joints && !joints->empty()) text += ", " + std::to_string(joints->size()) + " joints";
    text += partition.reachable ? "\n" : ", not reachable at the end\n";
  }
  if (summary.transforms) text += describe(*summary.transforms);
  for (const std::string& problem : summary.problems) {
    text += "problem      " + printable(problem) + "\n";
  }
  return text;
}

struct Info final : Command {
  explicit Info(CLI::App& app) { add_recording_file(app, file); }

  int run(const Common& common) const override {
    auto recording = Recording::open(file);
    if (!recording) return report(recording.error(), common);
    if (recording->summary().foreign) recording->read_all();
    return answer(common, json_of(*recording, file), describe(*recording));
  }

  std::string file;
};

}  // namespace

void add_info(Commands& commands) {
  commands.add<Info>("info", "what a recording contains, and what is wrong with it",
                     "info robot.mcap");
}

}  // namespace tfdude::cli
