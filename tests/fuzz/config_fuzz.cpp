// Reads any text as a daemon's configuration: a daemon must be able to serve what it accepts.

#include <set>
#include <string>

#include "tfdude/description/config.hpp"

#include "fuzz/demand.hpp"
#include "partition/partition.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

constexpr const char* kName = "robot.yaml";

void demand_refusal(const Error& error) {
  demand(error.code == Errc::kConfig || error.code == Errc::kInvalidInput,
         "the file or its content is to blame");
  demand_printable(error);
  demand(error.message.rfind(kName, 0) == 0, "a message names the file");
}

void demand_served(const Config& config) {
  const std::string name = config.partition.empty() ? "robot" : config.partition;
  demand(check_partition_name(name).has_value(), "a partition's name is checked");
  testing::Replica replica(name);
  Partition partition(name, 1, replica.forest, replica.directory);
  const auto loaded = partition.load(config.frames, Time{});
  demand(loaded.has_value(), "what was accepted can be loaded");
  std::set<std::string> ids;
  for (const FrameSpec& frame : config.frames) {
    demand(ids.insert(frame.id).second, "an id is given once");
    const auto info = replica.forest.info(frame.id);
    demand(info && info->parent == frame.parent, "a frame hangs where it was to");
    demand(frame.X_PC.covariance.of_specified().matrix().allFinite(), "a covariance is finite");
  }
  demand(replica.forest.frames().size() == ids.size(), "all frames are there");
}

void run(const std::string& text) {
  const auto config = parse_config(text, kName);
  if (config) {
    demand_served(*config);
  } else {
    demand_refusal(config.error());
  }
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
