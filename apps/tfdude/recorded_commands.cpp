#include <cmath>
#include <cstdio>

#include "tfdude/base/id.hpp"
#include "tfdude/recording/recording.hpp"

#include "commands.hpp"
#include "format.hpp"
#include "recording_options.hpp"
#include "render.hpp"
#include "screen.hpp"
#include "time_render.hpp"

// Commands about a recording, and those that go through one.
namespace tfdude::cli {
namespace {

double seconds_between(Time from, Time to) {
  return std::chrono::duration<double>(to - from).count();
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
                      {"problems", summary.problems},
                      {"partitions", nlohmann::json::array()}};
  json["messages"] = summary.messages ? nlohmann::json(*summary.messages) : nlohmann::json();
  for (const char* key : {"start_ns", "end_ns", "seconds"}) json[key] = nullptr;
  if (summary.start && summary.end) {
    json["start_ns"] = nanoseconds(*summary.start);
    json["end_ns"] = nanoseconds(*summary.end);
    json["seconds"] = seconds_between(*summary.start, *summary.end);
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
            format("  (%.3f s)\n", seconds_between(*summary.start, *summary.end));
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
  if (summary.left_out.value_or(0) > 0) {
    text += "left out     " + std::to_string(*summary.left_out) + " invalid transforms\n";
  }
  for (const std::string& problem : summary.problems) {
    text += "problem      " + printable(problem) + "\n";
  }
  return text;
}

// Where the command begins.
Result<Time> beginning(Recording& recording, const Arguments& arguments) {
  const auto at = optional_stamp(Source(recording), arguments.stamp);
  if (!at) return tl::unexpected(at.error());
  if (*at) return **at;
  return recording.summary().start.value_or(Time{});
}

}  // namespace

int run_info(const Arguments& arguments) {
  const std::string& file = arguments.recording.file;
  auto recording = Recording::open(file);
  if (!recording) return report(recording.error(), arguments);
  if (recording->summary().foreign) recording->read_all();
  return answer(arguments, json_of(*recording, file), describe(*recording));
}

int run_recorded_events(Recording& recording, const Arguments& arguments) {
  const auto from = beginning(recording, arguments);
  if (!from) return report(from.error(), arguments);
  recording.events(*from, [&](const Change& change) {
    print_event(change, arguments);
    return true;
  });
  return kDone;
}

int run_recorded_echo(Recording& recording, const Arguments& arguments) {
  const auto from = beginning(recording, arguments);
  if (!from) return report(from.error(), arguments);
  const Time end = recording.summary().end.value_or(Time{});
  const std::chrono::nanoseconds period(std::llround(1e9 / arguments.rate));
  Screen screen;
  for (Time at = *from; at <= end; at += period) {
    recording.seek(at);
    const auto X_AB = recording.lookup(arguments.id, arguments.other);
    if (!X_AB) {
      (void)report(X_AB.error(), arguments);
    } else if (arguments.json) {
      (void)answer(arguments, path_json(Source(recording), arguments, *X_AB), "");
    } else {
      screen.redraw(echo_lines(arguments.id, arguments.other, *X_AB, at, arguments.angles));
    }
    // People watch it in the time of the recording, programs read it at once.
    if (!arguments.json && interrupted_within(1.0 / arguments.rate)) break;
  }
  return kDone;
}

}  // namespace tfdude::cli
