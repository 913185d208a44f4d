// Reads any text as a daemon's URDF: a daemon must be able to serve what it accepts, and to move
// its joints.

#include <string>

#include "tfdude/description/urdf.hpp"

#include "fuzz/demand.hpp"
#include "partition/partition.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

void demand_refusal(const Error& error, const std::string& file) {
  demand(error.code == Errc::kConfig || error.code == Errc::kInvalidInput,
         "the file or its content is to blame");
  demand_printable(error);
  demand(error.message.rfind(file, 0) == 0, "a message names the file");
}

void demand_served(const std::vector<FrameSpec>& frames) {
  testing::Replica replica("robot");
  Partition partition("robot", 1, replica.forest, replica.directory);
  demand(partition.load(frames, Time{}).has_value(), "what was accepted can be loaded");
  JointUpdate update;
  for (const FrameSpec& frame : frames) {
    demand(frame.X_PC.pose.matrix().allFinite(), "a pose is finite");
    demand(frame.X_PC.covariance.of_specified().matrix().allFinite(), "a covariance is finite");
    if (frame.joint && !frame.joint->mimic) update.joints.push_back({frame.joint->name, 0.5, 1e-6});
  }
  demand(partition.apply(update).has_value(), "its joints can be moved");
}

void run(const std::string& text) {
  UrdfPart part;
  part.file = "robot.urdf";
  const auto frames = parse_urdf(text, part);
  if (frames) {
    demand_served(*frames);
  } else {
    demand_refusal(frames.error(), part.file);
  }
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
