// Reads any text as a file of each format of another program: what is accepted can be served, and
// written again.

#include <string>

#include "tfdude/description/frame_file.hpp"

#include "fuzz/demand.hpp"
#include "partition/partition.hpp"
#include "support/replica.hpp"

namespace tfdude::fuzz {
namespace {

void demand_served(const std::vector<FrameSpec>& frames) {
  testing::Replica replica("files");
  Partition partition("files", 1, replica.forest, replica.directory);
  demand(partition.load(frames, Time{}).has_value(), "what was accepted can be loaded");
  for (const FrameSpec& frame : frames) {
    demand(frame.X_PC.pose.matrix().allFinite(), "a pose is finite");
    demand(frame.X_PC.covariance.of_specified().matrix().allFinite(), "a covariance is finite");
  }
  const auto written = write_frames(frames, FrameFormat::kRos2);
  if (!written) return;
  const auto again = parse_frames(*written, {"file", FrameFormat::kRos2});
  demand(again && again->size() == frames.size(), "what was written can be read");
}

void run(const std::string& text) {
  for (const char* format : {"kalibr", "eye-on-hand", "ros2", "opencv", "colmap", "g2o"}) {
    FrameFile file;
    file.file = "file";
    file.format = frame_format_named(format).value();
    const auto frames = parse_frames(text, file);
    if (frames) {
      demand_served(*frames);
    } else {
      demand_printable(frames.error());
      demand(frames.error().message.rfind("file", 0) == 0, "a message names the file");
    }
  }
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  tfdude::fuzz::run({data, data + size});
  return 0;
}
