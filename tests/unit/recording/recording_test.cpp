#include "tfdude/recording/recording.hpp"

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <unistd.h>
#include <vector>

#include "tfdude/recording/recording_writer.hpp"

#include "recording/mcap_writer.hpp"
#include "recording/messages.hpp"
#include "support/catch.hpp"
#include "types/ros_tf.hpp"

using namespace tfdude;
using namespace tfdude::recording;

namespace {

Time at(double seconds) { return time_of(static_cast<std::int64_t>(seconds * 1e9)); }

Transform shifted(double x, const StatedCovariance& covariance = {}) {
  return {*Pose::create(Eigen::Quaterniond::Identity(), {x, 0, 0}), covariance};
}

StatedCovariance stddev(double sigma) {
  return *Covariance::from_stddev({sigma, sigma, sigma, sigma, sigma, sigma});
}

// A file that is removed, with its contents.
class File {
 public:
  File() {
    static int count = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("tfdude-file-" + std::to_string(getpid()) + "-" + std::to_string(++count) + ".mcap");
    std::filesystem::remove(path_);
  }
  ~File() { std::filesystem::remove(path_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

 private:
  std::string path_;
};

const FramesNews kFrames{{{"arm", "base"}, {"base", ""}, {"hand", "arm"}}, 7};

// The arm is static at 1 m, the hand at the time in metres, every 10 ms from 1 s on.
void record(RecordingWriter& writer, double until) {
  REQUIRE(writer.add({"robot", ReachNews{true, ""}}, at(1)));
  REQUIRE(writer.add({"robot", kFrames}, at(1)));
  ValuesNews first{1, {{0, std::nullopt, shifted(1), {}, Covariance()}}};
  first.values.push_back({2, at(1), shifted(1, stddev(0.01)), {}, Covariance()});
  REQUIRE(writer.add({"robot", first}, at(1)));
  for (int i = 1; 1 + i * 0.01 <= until; ++i) {
    const double t = 1 + i * 0.01;
    ValuesNews next{static_cast<std::uint64_t>(i + 1),
                    {{2, at(t), shifted(t, stddev(i % 3 == 0 ? 0.02 : 0.01))}}};
    REQUIRE(writer.add({"robot", next}, at(t)));
  }
}

void append(std::string& out, const std::string& parent, const std::string& child, double x,
            double stamp, McapWriter& writer, std::uint16_t channel) {
  ros::TfEncoder encoder(out);
  encoder.add(parent, child, shifted(x).pose, at(stamp));
  encoder.finish();
  REQUIRE(writer.write({channel, nanoseconds(at(stamp)), 0, out}));
}

// As rosbag2 writes it: odom to base every 100 ms, a camera that is told once.
std::string of_ros() {
  std::string file;
  McapWriter writer(
      [&](std::string_view bytes) {
        file += bytes;
        return Result<void>();
      },
      {"ros2", "libmcap 1.4.0", true, 1, 300});
  REQUIRE(writer.start());
  REQUIRE(writer.add_schema({1, "tf2_msgs/msg/TFMessage", "ros2msg", "..."}));
  REQUIRE(writer.add_schema({2, "std_msgs/msg/String", "ros2msg", "string data"}));
  REQUIRE(writer.add_channel({0, 2, "/chatter", "cdr", {}}));
  REQUIRE(writer.add_channel({1, 1, "/tf", "cdr", {}}));
  REQUIRE(writer.add_channel({2, 1, "/tf_static", "cdr", {}}));
  std::string message;
  append(message, "base", "camera", 0.5, 10, writer, 2);
  for (int i = 0; i <= 300; ++i) {
    append(message, "odom", "base", i * 0.1, 10 + i * 0.1, writer, 1);
    REQUIRE(writer.write({0, nanoseconds(at(10 + i * 0.1)), 0, "hello"}));
  }
  REQUIRE(writer.finish());
  return file;
}

// A file of another program, with one message.
std::string file_of_ros(const std::string& type, const std::string& definition,
                        const std::string& topic) {
  std::string file;
  McapWriter writer(
      [&](std::string_view bytes) {
        file += bytes;
        return Result<void>();
      },
      {"ros2", "other", true, 1, 300});
  REQUIRE(writer.start());
  REQUIRE(writer.add_schema({2, type, "ros2msg", definition}));
  REQUIRE(writer.add_channel({0, 2, topic, "cdr", {}}));
  REQUIRE(writer.write({0, 1, 1, "hello"}));
  REQUIRE(writer.finish());
  return file;
}

}  // namespace

TEST_CASE("recording: transforms of a recording of ROS have an unspecified covariance") {
  auto recording = Recording::read(of_ros());
  REQUIRE(recording);
  CHECK(recording->summary().foreign);
  CHECK(recording->summary().library == "libmcap 1.4.0");
  CHECK(recording->instant() == at(40));
  const auto newest = recording->lookup("odom", "camera");
  REQUIRE(newest);
  CHECK(newest->pose.translation().x() == testing::Approx(30.5));
  CHECK(newest->stamp == at(40));
  CHECK(newest->covariance.if_complete() == nullptr);
  CHECK(newest->basis.unspecified == std::vector<std::string>{"base", "camera"});
  // Before what is loaded at first; also static transforms are told only at the beginning.
  const auto early = recording->lookup_at("odom", "camera", at(12.05));
  REQUIRE(early);
  CHECK(early->pose.translation().x() == testing::Approx(2.55));
  REQUIRE(recording->partitions().size() == 1);
  CHECK(recording->partitions().front().name == "ros");
  CHECK(recording->roots() == std::vector<std::string>{"odom"});
  CHECK_FALSE(recording->lookup("odom", "hand"));
}

TEST_CASE("recording: a file without transforms is rejected with a clear error") {
  const std::string file = file_of_ros("std_msgs/msg/String", "string data", "/chatter");
  const auto recording = Recording::read(file);
  REQUIRE_FALSE(recording);
  CHECK_THAT(recording.error().message, testing::ContainsSubstring("no transforms"));
  CHECK(recording.error().code == Errc::kConfig);
}

TEST_CASE("recording: the code of an error is that of files, not that of the state of partitions") {
  const File file;
  auto writer = RecordingWriter::create(file.path(), at(1)).value();
  record(writer, 3);
  REQUIRE(writer.finish(at(3)));
  const std::string bytes = file.bytes();
  const std::string ros = file_of_ros("tf2_msgs/msg/TFMessage", "", "/tf");
  const auto code_of = [](const auto& result) {
    return result ? std::string("ok") : std::string(to_string(result.error().code));
  };
  CHECK(code_of(Recording::read("no MCAP file")) == "config");
  CHECK(code_of(Recording::read("")) == "config");
  CHECK(code_of(Recording::open(file.path() + ".none")) == "config");
  CHECK(code_of(Recording::open("/")) == "config");
  // Wherever it is cut, and whatever byte is another one, nothing blames a state file.
  for (const std::string& whole : {bytes, ros}) {
    for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 200) {
      const std::string code = code_of(Recording::read(whole.substr(0, size)));
      INFO("cut after " << size << " of " << whole.size() << ": " << code);
      CHECK((code == "ok" || code == "config"));
      std::string damaged = whole;
      damaged[size] = static_cast<char>(damaged[size] ^ 0x55);
      const std::string other = code_of(Recording::read(damaged));
      INFO("damaged at " << size << ": " << other);
      CHECK(other != "state");
    }
  }
  CHECK(code_of(RecordingWriter::create(file.path(), at(1))) == "already_exists");
  CHECK(code_of(RecordingWriter::create("/none/robot.mcap", at(1))) == "invalid_input");
}

// What programs print of a file must not steer the terminal.
TEST_CASE("recording: nothing that is read holds a control character") {
  const std::string steers = "\x1b[2J";
  const std::string shown = "\\x1b[2J";
  std::string bytes;
  encode(RecordedFrames{"robot", 1, false, steers, true, false, {}, {steers, "hand"}}, bytes);
  const auto frames = decode_frames(bytes);
  REQUIRE(frames);
  CHECK(frames->why == shown);
  CHECK(frames->removed == std::vector<std::string>{"hand"});

  const auto joint = [](const std::string& name, const std::string& frame) {
    JointInfo info;
    info.name = name;
    info.frame = frame;
    info.type = JointType::kRevolute;
    return info;
  };
  RecordedJoints joints{"robot", false, {joint("a", "b"), joint(steers, "b"), joint("c", steers)}};
  joints.joints.push_back(joint("d", "e"));
  joints.joints.back().mimic = Mimic{steers, 1, 0};
  bytes.clear();
  encode(joints, bytes);
  const auto read = decode_joints(bytes);
  REQUIRE(read);
  REQUIRE(read->joints.size() == 1);
  CHECK(read->joints.front().name == "a");

  const auto event = [&](const Change& change) {
    bytes.clear();
    encode(change, bytes);
    return decode_event(bytes);
  };
  const Change down{ChangeKind::kPartitionDown, "robot", "", "", "", steers};
  REQUIRE(event(down));
  CHECK(event(down)->message == shown);
  for (auto field : {&Change::partition, &Change::frame, &Change::parent, &Change::rival}) {
    Change bad = down;
    bad.*field = steers;
    CHECK_FALSE(event(bad));
  }
}

TEST_CASE("recording: a compression that cannot be read is named") {
  std::string file = file_of_ros("tf2_msgs/msg/TFMessage", "", "/tf");
  for (auto at = file.find("zstd"); at != std::string::npos; at = file.find("zstd", at)) {
    file.replace(at, 4, "lz77");
  }
  const auto recording = Recording::read(file);
  REQUIRE_FALSE(recording);
  CHECK_THAT(recording.error().message, testing::ContainsSubstring("compressed with 'lz77'"));
}

TEST_CASE("recording: a file that is cut anywhere answers up to where it is whole") {
  const File file;
  {
    RecordingOptions options;
    auto writer = RecordingWriter::create(file.path(), at(1), options);
    REQUIRE(writer);
    record(*writer, 3);
    REQUIRE(writer->finish(at(3)));
  }
  const std::string bytes = file.bytes();
  std::size_t answers = 0;
  for (std::size_t size = 0; size <= bytes.size(); size += 97) {
    auto recording = Recording::read(std::string_view(bytes).substr(0, size));
    if (!recording) continue;
    CHECK(recording->summary().finished == (size == bytes.size()));
    const auto X = recording->lookup("base", "hand");
    if (!X) continue;
    ++answers;
    REQUIRE(X->stamp);
    const double t = std::chrono::duration<double>(X->stamp->time_since_epoch()).count();
    CHECK(X->pose.translation().x() == testing::Approx(1 + t));
  }
  CHECK(answers > 0);
}

TEST_CASE("recording: a chunk with a wrong CRC is left out, and named") {
  const File file;
  {
    RecordingOptions options;
    options.compress = false;
    auto writer = RecordingWriter::create(file.path(), at(1), options);
    REQUIRE(writer);
    record(*writer, 3);
    REQUIRE(writer->finish(at(3)));
  }
  std::string bytes = file.bytes();
  const std::size_t middle = bytes.size() / 2;
  bytes[middle] = static_cast<char>(bytes[middle] ^ 1);
  auto recording = Recording::read(bytes);
  REQUIRE(recording);
  const auto problems = recording->summary().problems;
  REQUIRE(problems.size() == 1);
  CHECK_THAT(problems.front(), testing::ContainsSubstring("CRC"));
  CHECK_FALSE(recording->exists("hand"));
}

TEST_CASE("recording: files are split by time, and each can be read alone") {
  const File file;
  RecordingOptions options;
  options.split_after = std::chrono::seconds(1);
  auto writer = RecordingWriter::create(file.path(), at(1), options);
  REQUIRE(writer);
  record(*writer, 3.5);
  REQUIRE(writer->finish(at(3.5)));
  const auto files = writer->files();
  REQUIRE(files.size() == 3);
  for (const std::string& one : files) {
    auto recording = Recording::open(one);
    REQUIRE(recording);
    CHECK(recording->summary().finished);
    CHECK(recording->lookup("base", "hand"));
    CHECK(recording->summary().problems.empty());
  }
  // The second begins with what is known from the first.
  auto second = Recording::open(files[1]);
  second->seek(*second->summary().start);
  const auto begin = second->lookup("base", "arm");
  REQUIRE(begin);
  CHECK(begin->pose.translation().x() == 1);
  for (std::size_t i = 1; i < files.size(); ++i) std::filesystem::remove(files[i]);
}

TEST_CASE("recording: files are split by size") {
  const File file;
  RecordingOptions options;
  options.compress = false;
  options.split_bytes = 5'000'000;
  auto writer = RecordingWriter::create(file.path(), at(1), options);
  REQUIRE(writer);
  record(*writer, 400);
  REQUIRE(writer->finish(at(400)));
  const auto files = writer->files();
  REQUIRE(files.size() >= 2);
  std::uint64_t sum = 0;
  for (const std::string& one : files) {
    sum += std::filesystem::file_size(one);
    // A chunk is written as a whole.
    CHECK(std::filesystem::file_size(one) < options.split_bytes + 5'000'000);
    CHECK(Recording::open(one)->lookup("base", "hand"));
  }
  CHECK(sum == writer->bytes());
  for (std::size_t i = 1; i < files.size(); ++i) std::filesystem::remove(files[i]);
}

TEST_CASE("recording: a clock that jumps back begins another file") {
  const File file;
  auto writer = RecordingWriter::create(file.path(), at(1));
  REQUIRE(writer);
  record(*writer, 3);
  ValuesNews cleared{500, {{2, std::nullopt, shifted(3), {}, Covariance()}}};
  cleared.values.front().cleared = true;
  REQUIRE(writer->add({"robot", cleared}, at(0.5)));
  ValuesNews again{501, {{2, at(0.6), shifted(7, stddev(0.01))}}};
  REQUIRE(writer->add({"robot", again}, at(0.6)));
  REQUIRE(writer->finish(at(0.7)));
  REQUIRE(writer->files().size() == 2);
  auto recording = Recording::open(writer->files().back());
  REQUIRE(recording);
  CHECK(recording->summary().end == at(0.6));
  const auto X = recording->lookup("base", "hand");
  REQUIRE(X);
  CHECK(X->pose.translation().x() == 8);
  recording->seek(at(0.55));
  const auto none = recording->lookup("base", "hand");
  REQUIRE_FALSE(none);
  CHECK(none.error().code == Errc::kNotYet);
  std::filesystem::remove(writer->files().back());
}

TEST_CASE("recording: what follows an instant is told as a watch tells it") {
  const File file;
  {
    auto writer = RecordingWriter::create(file.path(), at(1));
    REQUIRE(writer);
    record(*writer, 2);
    REQUIRE(writer->add({"robot", ReachNews{false, "it is lost"}}, at(2.1)));
    REQUIRE(writer->finish(at(2.2)));
  }
  auto recording = Recording::open(file.path());
  REQUIRE(recording);
  recording->seek(at(1.5));
  const auto state = recording->state();
  REQUIRE(state.size() == 3);
  CHECK(std::get<ReachNews>(state[0].what).reachable);
  CHECK(std::get<FramesNews>(state[1].what).frames == kFrames.frames);
  CHECK(std::get<ValuesNews>(state[2].what).values.size() == 2);
  std::size_t samples = 0;
  bool lost = false;
  for (auto news = recording->next(); !news.empty(); news = recording->next()) {
    for (const RecordedNews& one : news) {
      CHECK(one.time > at(1.5));
      if (const auto* values = std::get_if<ValuesNews>(&one.news.what)) {
        samples += values->values.size();
        CHECK(values->values.front().frame == 2);
      }
      if (const auto* reach = std::get_if<ReachNews>(&one.news.what)) lost = !reach->reachable;
    }
  }
  CHECK(samples == 50);
  CHECK(lost);
}

TEST_CASE("recording: a trajectory is extrapolated from what was known, as each of its lookups") {
  const File file;
  {
    auto writer = RecordingWriter::create(file.path(), at(1));
    REQUIRE(writer);
    record(*writer, 3);
    REQUIRE(writer->finish(at(3)));
  }
  auto recording = Recording::open(file.path());
  REQUIRE(recording);
  Query query;
  query.extrapolate = std::chrono::milliseconds(20);
  const std::vector<Time> instants{at(1.1049), at(1.5), at(2.0051), at(2.9951), at(3.01)};
  const Trajectory all = recording->trajectory("base", "hand", instants, query);
  for (std::size_t i = 0; i < instants.size(); ++i) {
    INFO("at " << nanoseconds(instants[i]) << " ns");
    const auto one = recording->lookup_at("base", "hand", instants[i], query);
    REQUIRE(one);
    REQUIRE(all.X_AB[i]);
    CHECK(all.X_AB[i]->covariance == one->covariance);
  }
}
