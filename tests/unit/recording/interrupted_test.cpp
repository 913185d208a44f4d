// Files of other writers, which keep schemas and channels in their chunks, that were interrupted.

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/recording/recording.hpp"

#include "base/bytes.hpp"
#include "recording/crc32.hpp"
#include "recording/mcap_reader.hpp"
#include "recording/zstd.hpp"
#include "support/catch.hpp"
#include "types/ros_tf.hpp"

using namespace tfdude;
using namespace tfdude::recording;

namespace {

Time at(double seconds) { return time_of(static_cast<std::int64_t>(seconds * 1e9)); }

void append(std::string& out, Op op, const std::string& body) {
  ByteWriter writer(out);
  writer.u8(static_cast<std::uint8_t>(op));
  writer.u64(body.size());
  out += body;
}

/// A file as libmcap writes it by default, so also rosbag2: the schema and the channel of a message
/// are in the chunk of the first one, and its indices follow each chunk.
class ChunkedFile {
 public:
  explicit ChunkedFile(bool compress) : compress_(compress), file_(kMagic) {
    std::string header;
    ByteWriter writer(header);
    writer.text("ros2");
    writer.text("libmcap 1.4.0");
    append(file_, Op::kHeader, header);
  }

  void add_channel(std::uint16_t id, const std::string& topic, const std::string& type,
                   const std::string& definition = "...") {
    std::string schema;
    ByteWriter schema_writer(schema);
    schema_writer.u16(id);
    schema_writer.text(type);
    schema_writer.text("ros2msg");
    schema_writer.text(definition);
    append(chunk_, Op::kSchema, schema);
    std::string channel;
    ByteWriter writer(channel);
    writer.u16(id);
    writer.u16(id);
    writer.text(topic);
    writer.text("cdr");
    writer.u32(0);
    append(chunk_, Op::kChannel, channel);
    append(names_, Op::kSchema, schema);
    append(names_, Op::kChannel, channel);
  }

  void add_message(std::uint16_t channel, Time log, const std::string& data) {
    const auto time = static_cast<std::uint64_t>(nanoseconds(log));
    if (offsets_.empty()) start_ = time;
    end_ = time;
    offsets_[channel].emplace_back(time, chunk_.size());
    std::string body;
    ByteWriter writer(body);
    writer.u16(channel);
    writer.u32(0);
    writer.u64(time);
    writer.u64(time);
    append(chunk_, Op::kMessage, body + data);
  }

  void add_transform(std::uint16_t channel, const std::string& parent, const std::string& child,
                     double x, double stamp) {
    std::string data;
    ros::TfEncoder encoder(data);
    encoder.add(parent, child, *Pose::create(Eigen::Quaterniond::Identity(), {x, 0, 0}), at(stamp));
    encoder.finish();
    add_message(channel, at(stamp), data);
  }

  /// @return the size of the file up to the end of this chunk, without its indices
  std::size_t end_chunk() {
    Compressor compressor(1);
    const std::string packed = compress_ ? std::string(compressor.compress(chunk_)) : chunk_;
    std::string body;
    ByteWriter writer(body);
    writer.u64(start_);
    writer.u64(end_);
    writer.u64(chunk_.size());
    writer.u32(crc32(chunk_));
    writer.text(compress_ ? "zstd" : "");
    writer.u64(packed.size());
    append(file_, Op::kChunk, body + packed);
    const std::size_t size = file_.size();
    for (const auto& [channel, offsets] : offsets_) {
      std::string index;
      ByteWriter entries(index);
      entries.u16(channel);
      entries.u32(static_cast<std::uint32_t>(offsets.size() * 16));
      for (const auto& [time, offset] : offsets) {
        entries.u64(time);
        entries.u64(offset);
      }
      append(file_, Op::kMessageIndex, index);
    }
    offsets_.clear();
    chunk_.clear();
    return size;
  }

  /// With a summary that has only the channels.
  [[nodiscard]] std::string finished() const {
    std::string file = file_;
    append(file, Op::kDataEnd, std::string(4, '\0'));
    const std::size_t start = file.size();
    file += names_;
    std::string footer;
    ByteWriter writer(footer);
    writer.u64(start);
    writer.u64(0);
    writer.u32(0);
    append(file, Op::kFooter, footer);
    return file.append(kMagic);
  }

  [[nodiscard]] const std::string& bytes() const { return file_; }

 private:
  bool compress_;
  std::string file_;
  std::string chunk_;
  std::string names_;
  std::uint64_t start_ = 0;
  std::uint64_t end_ = 0;
  std::map<std::uint16_t, std::vector<std::pair<std::uint64_t, std::size_t>>> offsets_;
};

constexpr std::uint16_t kCamera = 1;
constexpr std::uint16_t kTf = 2;
constexpr std::uint16_t kStatic = 3;

struct Robot {
  std::string bytes;
  std::map<std::size_t, double> newest;  // by where chunks end: the stamp of the last sample
};

// A camera that begins before the robot moves, from 10 s on, one chunk a second. @param early
// whether channels begin before their first message, as other writers have them
Robot drive(bool compress, bool early) {
  ChunkedFile file(compress);
  Robot robot;
  std::optional<double> newest;
  file.add_channel(kCamera, "/camera", "std_msgs/msg/String");
  for (int chunk = 0; chunk < 12; ++chunk) {
    const double begin = 10 + chunk;
    for (int i = 0; i < 5; ++i) file.add_message(kCamera, at(begin + i * 0.1), "a picture");
    if (chunk == (early ? 2 : 4)) {
      file.add_channel(kTf, "/tf", "tf2_msgs/msg/TFMessage");
      file.add_channel(kStatic, "/tf_static", "tf2_msgs/msg/TFMessage");
    }
    if (chunk == 4) file.add_transform(kStatic, "base", "laser", 0.5, begin + 0.5);
    if (chunk >= 4 && chunk % 2 == 0) {
      newest = begin + 0.6;
      file.add_transform(kTf, "odom", "base", *newest, *newest);
    }
    const std::size_t end = file.end_chunk();
    if (newest) robot.newest[end] = *newest;
  }
  robot.bytes = file.finished();
  return robot;
}

void check(std::string_view bytes, std::optional<double> newest) {
  auto recording = Recording::read(bytes);
  if (!newest) {
    CHECK_FALSE((recording && recording->lookup("odom", "laser")));
    return;
  }
  REQUIRE(recording);
  const auto summary = recording->summary();
  CHECK(summary.foreign);
  CHECK_FALSE(summary.messages);
  const auto X = recording->lookup("odom", "laser");
  REQUIRE(X);
  CHECK(X->stamp == at(*newest));
  CHECK(X->pose.translation().x() == testing::Approx(*newest + 0.5));
  // Also from another place of the file.
  if (*newest <= 16) return;
  const auto between = recording->lookup_at("odom", "laser", at(15));
  REQUIRE(between);
  CHECK(between->pose.translation().x() == testing::Approx(15.5));
}

}  // namespace

TEST_CASE("interrupted: a file whose channels are in its chunks answers up to its last chunk") {
  const bool compress = GENERATE(false, true);
  const bool early = GENERATE(false, true);
  CAPTURE(compress, early);
  const Robot robot = drive(compress, early);
  REQUIRE(robot.newest.size() > 5);
  std::vector<std::size_t> sizes;
  for (std::size_t size = 0; size <= robot.bytes.size(); size += 61) sizes.push_back(size);
  for (std::size_t missing = 0; missing < 40; ++missing) {
    sizes.push_back(robot.bytes.size() - missing);
  }
  for (const auto& chunk : robot.newest) {
    for (std::size_t more = 0; more < 120; ++more) sizes.push_back(chunk.first + more);
  }
  for (const std::size_t size : sizes) {
    CAPTURE(size);
    const auto after = robot.newest.upper_bound(size);
    const auto newest =
        after != robot.newest.begin() ? std::optional(std::prev(after)->second) : std::nullopt;
    check(std::string_view(robot.bytes).substr(0, size), newest);
  }
}

TEST_CASE("interrupted: chunks without transforms are not read again") {
  const Robot robot = drive(true, true);
  const std::size_t cut = std::prev(robot.newest.end())->first;
  auto reader =
      McapReader::open(std::make_unique<TextSource>(std::string_view(robot.bytes).substr(0, cut)));
  REQUIRE(reader);
  REQUIRE(reader->chunks().size() == 12);
  CHECK(reader->channels().empty());
  CHECK(reader->learn_channels(0));
  CHECK(reader->channels().size() == 1);
  CHECK(reader->learn_channels(3));
  CHECK(reader->channels().size() == 1);
  // That of the transforms began in a chunk that was left out.
  CHECK(reader->learn_channels(4));
  CHECK(reader->channels().size() == 3);
  CHECK_FALSE(reader->chunks()[1].names_read);
  CHECK(reader->chunks()[2].names_read);
  CHECK(reader->chunks()[10].channels.size() == 2);
  // Not all of its index may be there.
  CHECK(reader->chunks()[11].channels.empty());
  CHECK(reader->learn_channels(11));
  CHECK(reader->chunks()[11].channels == std::vector<std::uint16_t>{kCamera});
}

TEST_CASE("interrupted: a chunk that tells no channel is named, and others are read") {
  Robot robot = drive(false, false);
  const std::size_t picture = robot.bytes.find("a picture");
  robot.bytes[picture] = 'A';
  auto recording = Recording::read(std::string_view(robot.bytes).substr(0, robot.bytes.size() - 1));
  REQUIRE(recording);
  CHECK(recording->lookup("odom", "laser"));
  const auto problems = recording->summary().problems;
  REQUIRE(problems.size() == 2);
  CHECK_THAT(problems[1], testing::ContainsSubstring("wrong CRC"));
}

TEST_CASE("interrupted: definitions in a chunk count once, however often it is read") {
  ChunkedFile file(true);
  file.add_channel(kTf, "/tf", "tf2_msgs/msg/TFMessage", std::string(std::size_t{1} << 20U, '#'));
  file.add_transform(kTf, "odom", "base", 1, 10);
  file.end_chunk();
  auto reader = McapReader::open(std::make_unique<TextSource>(file.bytes()));
  REQUIRE(reader);
  REQUIRE(reader->chunks().size() == 1);
  for (int i = 0; i < 100; ++i) {
    REQUIRE(reader->read(reader->chunks()[0], [](const Message&) { return true; }));
  }
}
