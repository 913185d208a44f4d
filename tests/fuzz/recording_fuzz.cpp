// Opens any bytes as a recording: a whole file, or messages of which one is made.

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/recording/recording.hpp"

#include "fuzz/demand.hpp"
#include "recording/mcap_writer.hpp"
#include "recording/messages.hpp"
#include "recording/schemas.hpp"

namespace tfdude::fuzz {
namespace {

using namespace recording;

constexpr char kMagic = '\x89';
constexpr std::size_t kMostFrames = 8;  // of which all pairs are looked up

// A file of messages: for each its topic, its time [s], the length in two bytes, and its bytes.
// Without our metadata it is one of ROS.
std::string file_of(std::string_view choices) {
  std::string file;
  McapWriter writer(
      [&](std::string_view bytes) {
        file += bytes;
        return Result<void>();
      },
      {"ros2", "fuzz", false, 1, 100});
  const bool ours = !choices.empty() && choices.front() % 2 == 0;
  (void)writer.start();
  if (ours) (void)writer.add_metadata({"tfdude", {}});
  for (std::uint16_t i = 0; i < topic_types().size(); ++i) {
    const TopicType& type = topic_types()[i];
    (void)writer.add_schema({static_cast<std::uint16_t>(i + 1), std::string(type.type), "", ""});
    (void)writer.add_channel({i, static_cast<std::uint16_t>(i + 1), std::string(type.name), "cdr"});
  }
  for (std::size_t at = 1; at + 4 < choices.size();) {
    const auto number = [&](std::size_t i) { return static_cast<unsigned char>(choices[at + i]); };
    const std::string_view data = choices.substr(at + 4, number(2) * 256U + number(3));
    const auto topic = static_cast<std::uint16_t>(number(0) % topic_types().size());
    (void)writer.write({topic, number(1) * 1'000'000'000LL, 0, data});
    at += 4 + data.size();
  }
  (void)writer.finish();
  return file;
}

// What is read can be written, and is then the same.
template <class Decode, class Encode>
void demand_same(std::string_view data, Decode decode, Encode encode_one) {
  const auto read = decode(data);
  if (!read) return demand_printable(read.error());
  std::string written;
  encode_one(*read, written);
  const auto again = decode(written);
  demand(again.has_value(), "what was written can be read");
  std::string twice;
  encode_one(*again, twice);
  demand(twice == written, "what was written is read as it was");
}

void demand_messages(std::string_view data) {
  const auto encoder = [](const auto& one, std::string& out) { encode(one, out); };
  demand_same(data, decode_frames, encoder);
  demand_same(data, decode_joints, encoder);
  demand_same(data, decode_event, encoder);
}

void demand_answer(const Result<StampedTransform>& X_AB) {
  if (!X_AB) return demand_printable(X_AB.error());
  demand(X_AB->pose.matrix().allFinite(), "a pose is finite");
}

std::vector<std::string> ids_of(const Recording& recording) {
  std::vector<std::string> ids;
  for (const Frame& frame : recording.frames()) ids.push_back(frame.id);
  return ids;
}

void run(std::string_view bytes) {
  const bool is_file = !bytes.empty() && bytes.front() == kMagic;
  if (!is_file) demand_messages(bytes);
  auto recording = Recording::read(is_file ? std::string(bytes) : file_of(bytes));
  if (!recording) return demand_printable(recording.error());
  const RecordingSummary summary = recording->summary();
  for (const std::string& problem : summary.problems) {
    demand_printable({Errc::kState, problem});
  }
  const std::vector<std::string> ids = ids_of(*recording);
  for (std::size_t a = 0; a < std::min(ids.size(), kMostFrames); ++a) {
    for (std::size_t b = 0; b < std::min(ids.size(), kMostFrames); ++b) {
      demand_answer(recording->lookup(ids[a], ids[b]));
      demand_answer(recording->lookup_at(ids[a], ids[b], summary.start.value_or(Time{})));
      recording->seek(summary.end.value_or(Time{}));
    }
    (void)recording->history(ids[a]);
  }
  for (const PartitionInfo& partition : recording->partitions()) {
    demand(recording->joints(partition.name).has_value(), "a partition has joints, or none");
  }
  recording->events(Time{}, [](const Change&) { return true; });
  recording->seek(summary.end.value_or(Time{}));
  demand(ids_of(*recording) == ids, "the same instant has the same frames");
  recording->seek(summary.start.value_or(Time{}));
  (void)recording->state();
  for (auto news = recording->next(); !news.empty(); news = recording->next()) {
    for (const RecordedNews& one : news) {
      demand(!one.news.partition.empty(), "news name their partition");
    }
  }
}

}  // namespace
}  // namespace tfdude::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): bytes as characters
  tfdude::fuzz::run({reinterpret_cast<const char*>(data), size});
  return 0;
}
