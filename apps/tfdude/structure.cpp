#include "structure.hpp"

#include <algorithm>
#include <cstdio>

#include "tfdude/base/id.hpp"

#include "../rendering/json.hpp"
#include "../rendering/table.hpp"
#include "answer.hpp"

namespace tfdude::cli {

Result<Structure> Structure::of(Source source) {
  auto frames = source.frames();
  if (!frames) return tl::unexpected(std::move(frames.error()));
  auto partitions = source.partitions();
  if (!partitions) return tl::unexpected(std::move(partitions.error()));
  Structure all{*std::move(frames), {}, {}};
  for (PartitionInfo& partition : *partitions) {
    // Others have been asked for the frames of one that was lost.
    if (!partition.complete && partition.reachable) all.incomplete.push_back(partition.name);
    if (!partition.reachable && partition.compatible()) all.absent.push_back(std::move(partition));
  }
  return all;
}

std::vector<std::string> Structure::absent_names() const {
  return names_of(absent, &PartitionInfo::name);
}

std::string Structure::warnings() const {
  std::string text;
  for (const PartitionInfo& one : absent) {
    const auto count = std::count_if(frames.begin(), frames.end(), [&](const Frame& frame) {
      return frame.partition == one.name;
    });
    text += "partition " + quote(one.name) + " " + why_absent(one) + " since " +
            to_string(one.since) + ": " +
            (count == 0
                 ? "its frames are not known here"
                 : "its " + std::to_string(count) + " frames are listed as they were last known") +
            "\n";
  }
  for (const std::string& name : incomplete) {
    text += "partition " + quote(name) + " has not sent all of its frames: some are missing here\n";
  }
  return text;
}

int Structure::print(const Common& common, const std::string& text) const {
  const auto names = absent_names();
  auto all = nlohmann::json::array();
  for (const Frame& frame : frames) {
    all.push_back(frame_json(frame));
    all.back()["reachable"] = std::count(names.begin(), names.end(), frame.partition) == 0;
  }
  nlohmann::json object{{"frames", std::move(all)}};
  if (!incomplete.empty()) object["incomplete"] = incomplete;
  (void)answer(common, object, text);
  if (!common.json) std::fputs(warnings().c_str(), stderr);
  return kDone;
}

}  // namespace tfdude::cli
