// Recordings of ROS: names and numbers as the bridge takes them.

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/frame_source.hpp"
#include "tfdude/recording/recording.hpp"
#include "tfdude/tf2.hpp"

#include "base/cdr.hpp"
#include "recording/edge_table.hpp"
#include "recording/foreign_transforms.hpp"
#include "recording/mcap_writer.hpp"
#include "support/catch.hpp"

using namespace tfdude;
using namespace tfdude::recording;
using tfdude::testing::ContainsSubstring;

namespace {

struct Sent {
  std::string parent;
  std::string child;
  double x = 0;
  std::array<double, 4> quat{0, 0, 0, 1};
  std::optional<double> stamp{};  // [s]; otherwise that of the file
  bool is_static = false;         // also in a file of /tf
};

// A file of rosbag2 with one message for each transform, logged from 10 s on, once a second.
std::string file_of(const std::vector<Sent>& all, const std::string& topic = "/tf_static",
                    std::uint32_t stamp = 10, std::int64_t first_log = 10) {
  std::string file;
  McapWriter writer(
      [&](std::string_view bytes) {
        file += bytes;
        return Result<void>();
      },
      {"ros2", "libmcap 1.4.0", true, 1, 300});
  REQUIRE(writer.start());
  REQUIRE(writer.add_schema({1, "tf2_msgs/msg/TFMessage", "ros2msg", "..."}));
  REQUIRE(writer.add_channel({1, 1, topic, "cdr", {}}));
  REQUIRE(writer.add_channel({2, 1, "/tf_static", "cdr", {}}));
  std::int64_t log = first_log * 1'000'000'000;
  for (const Sent& sent : all) {
    std::string message;
    CdrWriter cdr(message);
    cdr.u32(1);
    const double seconds = sent.stamp.value_or(stamp);
    cdr.u32(static_cast<std::uint32_t>(static_cast<std::int32_t>(std::floor(seconds))));
    cdr.u32(static_cast<std::uint32_t>(std::lround((seconds - std::floor(seconds)) * 1e9)));
    cdr.text(sent.parent);
    cdr.text(sent.child);
    for (const double number : {sent.x, 0.0, 0.0}) cdr.f64(number);
    for (const double number : sent.quat) cdr.f64(number);
    cdr.finish();
    const std::uint16_t channel = sent.is_static ? 2 : 1;
    REQUIRE(writer.write({channel, log, 0, message}));
    log += 1'000'000'000;
  }
  REQUIRE(writer.finish());
  return file;
}

Sent sample(double x, double stamp, std::string parent = "odom", std::string child = "base") {
  return {std::move(parent), std::move(child), x, {0, 0, 0, 1}, stamp};
}

// Where a sample of odom -> base says that it is.
std::optional<double> x_at(Recording& recording, double at) {
  Query query;
  query.at = time_of(std::llround(at * 1e9));
  const auto X = recording.lookup("odom", "base", query);
  return X ? std::optional(X->pose.translation().x()) : std::nullopt;
}

}  // namespace

TEST_CASE("recording of ROS: leading slashes are taken off") {
  auto recording =
      Recording::read(file_of({{"base_link", "camera", 1}, {"/camera", "//optical", 0.1}}));
  REQUIRE(recording);
  const auto X = recording->lookup("base_link", "optical");
  REQUIRE(X);
  CHECK(X->pose.translation().x() == 1.1);
  CHECK(recording->roots() == std::vector<std::string>{"base_link"});
}

TEST_CASE("recording of ROS: quaternions are normalized as in tf2, and others counted") {
  auto recording = Recording::read(file_of({{"base", "rounded", 1, {0, 0, 0.70, 0.71}},
                                            {"base", "longer", 1, {0, 0, 0, 1.004}},
                                            {"base", "zero", 1, {0, 0, 0, 0}},
                                            {"base", "zero", 1, {0, 0, 0, 0}},
                                            {"/base", "base", 1},
                                            {"base", "/", 1},
                                            {"base", "good", 1}}));
  REQUIRE(recording);
  for (const char* frame : {"rounded", "longer", "good"}) {
    CAPTURE(frame);
    const auto X = recording->lookup("base", frame);
    REQUIRE(X);
    CHECK(std::abs(X->pose.rotation().norm() - 1) < 1e-15);
  }
  CHECK_FALSE(recording->exists("zero"));
  CHECK_FALSE(recording->summary().left_out);
  recording->read_all();
  CHECK(recording->summary().left_out == 4);
  const auto problems = recording->summary().problems;
  REQUIRE(problems.size() == 3);
  CHECK_THAT(problems[0], ContainsSubstring("'zero'") && ContainsSubstring("not of unit length"));
  CHECK_THAT(problems[1], ContainsSubstring("'base'") && ContainsSubstring("its own parent"));
  // The recording still answers.
  CHECK(recording->lookup("base", "good"));
  recording->read_all();
  CHECK(recording->summary().left_out == 4);
}

TEST_CASE("recording of ROS: a stamp of 0 was not set, and means the time of the message") {
  auto recording = Recording::read(
      file_of({{"odom", "base", 1}, {"odom", "base", 2}, {"odom", "base", 3}}, "/tf", 0));
  REQUIRE(recording);
  recording->read_all();
  Query query;
  query.at = time_of(11'500'000'000);
  const auto X = recording->lookup("odom", "base", query);
  REQUIRE(X);
  CHECK(X->pose.translation().x() == 2.5);
  REQUIRE(recording->summary().problems.size() == 1);
  CHECK_THAT(recording->summary().problems[0], ContainsSubstring("no stamp"));
}

TEST_CASE("recording of ROS: stamps of another clock are looked up at the end") {
  std::vector<Sent> all;
  for (int i = 0; i < 40; ++i) all.push_back(sample(i, i + 1));
  const std::string file = file_of(all, "/tf", 0, 1'700'000'000);
  const auto at = [](double seconds) { return time_of(std::llround(seconds * 1e9)); };
  const auto x = [](const Result<StampedTransform>& X) {
    return X ? X->pose.translation().x() : -1;
  };
  auto recording = Recording::read(file);
  REQUIRE(recording);
  const Time end = *recording->summary().end;
  CHECK(recording->instant_for(at(5.5)) == end);
  CHECK(recording->instant_for(end) == end);
  CHECK(recording->instant_for(*recording->summary().start) == *recording->summary().start);
  // Wherever the recording is.
  for (const Time shown : {end, *recording->summary().start, at(5)}) {
    recording->seek(shown);
    CHECK(x(recording->lookup_at("odom", "base", at(5.5))) == 4.5);
    CHECK(recording->instant() == end);
  }
  CHECK(x(recording->lookup_at("base", at(3), "base", at(5), "odom")) == 2);
  CHECK(recording->lookup_at("odom", "base", at(50)).error().code == Errc::kNotYet);
  CHECK(recording->lookup_at("odom", "base", at(0.5)).error().code == Errc::kTooOld);
  for (const Time shown : {end, at(5)}) {
    auto other = Recording::read(file);
    REQUIRE(other);
    other->seek(shown);
    // The last of these stamps is of the clock of the recording.
    const Trajectory path = other->trajectory("odom", "base", {at(30.5), at(2), at(0.5), end});
    REQUIRE(path.X_AB.size() == 4);
    CHECK(path.X_AB[0].value().pose.translation().x() == 29.5);
    CHECK(path.X_AB[1].value().pose.translation().x() == 1);
    REQUIRE(path.missing.size() == 2);
  }
}

TEST_CASE("recording of ROS: a buffer over it needs no timeouts") {
  std::vector<Sent> all;
  for (int i = 0; i < 40; ++i) all.push_back(sample(i, i + 10));
  auto recording = Recording::read(file_of(all, "/tf"));
  REQUIRE(recording);
  RecordingSource source(*recording);
  const tf2_ros::Buffer buffer(source);
  using std::chrono::milliseconds;
  const auto x = [&](int ms) {
    return buffer.lookupTransform("odom", "base", milliseconds(ms)).transform.translation.x;
  };
  CHECK(x(20'500) == 10.5);
  CHECK(x(12'250) == 2.25);
  // A timeout counts in the time of the recording.
  CHECK_FALSE(buffer.canTransform("odom", "base", milliseconds(20'500), milliseconds(100)));
  CHECK(buffer._frameExists("/odom"));
  CHECK_FALSE(buffer._frameExists("moon"));
  CHECK(buffer.getAllFrameNames().size() == 2);
  CHECK(buffer.lookupTransform("base", milliseconds(12'500), "base", milliseconds(15'000), "odom")
            .transform.translation.x == 2.5);
  CHECK_THROWS_AS(x(90'000), tf2::ExtrapolationException);
}

TEST_CASE("recording of ROS: 0 at the start of simulated time is that time") {
  std::vector<Sent> all;
  for (int i = 0; i < 5; ++i) all.push_back(sample(i, i));
  auto recording = Recording::read(file_of(all, "/tf", 0, 1'700'000'000));
  REQUIRE(recording);
  recording->read_all();
  CHECK(x_at(*recording, 0) == 0);
  CHECK(x_at(*recording, 2.5) == 2.5);
  CHECK(recording->lookup("odom", "base")->stamp == time_of(4'000'000'000));
  CHECK(recording->summary().transforms->unstamped == 1);
  CHECK(recording->summary().left_out == 0);
}

TEST_CASE("recording of ROS: an edge that never has a stamp is dated by those that have one") {
  // The last one comes after all stamps: 1.5 s after the one of 12 s.
  auto recording =
      Recording::read(file_of({sample(1, 0), sample(7, 11, "odom", "other"), sample(3, 0),
                               sample(7, 13, "odom", "other"), sample(5, 0)},
                              "/tf", 0, 1'700'000'000));
  REQUIRE(recording);
  recording->read_all();
  CHECK(x_at(*recording, 10) == 1);
  CHECK(x_at(*recording, 12) == 3);
  CHECK(x_at(*recording, 14) == 5);
  CHECK(recording->summary().transforms->unstamped == 3);
}

TEST_CASE(
    "recording of ROS: of repeated stamps the first value stays, and the others are counted") {
  auto recording =
      Recording::read(file_of({sample(1, 10), sample(1, 10), sample(2, 10), sample(3, 11),
                               sample(4, 11), sample(5, 10.5), sample(6, 10.5), sample(7, 12)},
                              "/tf"));
  REQUIRE(recording);
  recording->read_all();
  CHECK(x_at(*recording, 10) == 1);
  CHECK(x_at(*recording, 10.5) == 5);
  CHECK(x_at(*recording, 11) == 3);
  const auto summary = recording->summary();
  CHECK(summary.transforms->repeated == 3);
  CHECK(summary.transforms->same == 1);
  CHECK(summary.left_out == 3);
  REQUIRE(summary.problems.size() == 1);
  CHECK_THAT(summary.problems[0], ContainsSubstring("'base'") && ContainsSubstring("stamp"));
  REQUIRE(recording->history("base"));
  CHECK(recording->history("base")->front().samples == 4);
}

TEST_CASE("recording of ROS: a jump back of time drops the samples before") {
  std::vector<Sent> all;
  for (int i = 0; i < 10; ++i) all.push_back(sample(i, i + 1));
  for (int i = 0; i < 4; ++i) all.push_back(sample(100 + i, i + 1));
  auto recording = Recording::read(file_of(all, "/tf", 0, 1'700'000'000));
  REQUIRE(recording);
  recording->read_all();
  CHECK(x_at(*recording, 2.5) == 101.5);
  CHECK(recording->lookup("odom", "base")->stamp == time_of(4'000'000'000));
  CHECK_FALSE(x_at(*recording, 7));
  CHECK(recording->summary().transforms->jumps == 1);
  CHECK(recording->summary().left_out == 0);
  // As of the first round.
  recording->seek(time_of(1'700'000'008'500'000'000));
  CHECK(x_at(*recording, 2.5) == 1.5);
  CHECK(x_at(*recording, 7) == 6);
}

TEST_CASE("recording of ROS: a late sample is none of another round") {
  auto recording =
      Recording::read(file_of({sample(1, 10), sample(3, 12), sample(2, 11), sample(4, 13)}, "/tf"));
  REQUIRE(recording);
  recording->read_all();
  CHECK(x_at(*recording, 10.5) == 1.5);
  CHECK(x_at(*recording, 11) == 2);
  CHECK(recording->summary().transforms->jumps == 0);
}

TEST_CASE("recording of ROS: a static transform ends the samples of its frame") {
  Sent fixed = sample(5, 12);
  fixed.is_static = true;
  auto recording =
      Recording::read(file_of({sample(1, 10), sample(2, 11), fixed, sample(3, 13)}, "/tf"));
  REQUIRE(recording);
  CHECK(recording->lookup("odom", "base")->pose.translation().x() == 3);
  CHECK_FALSE(x_at(*recording, 10.5));
  recording->seek(time_of(12'500'000'000));
  CHECK(recording->lookup("odom", "base")->pose.translation().x() == 5);
  CHECK(x_at(*recording, 10.5) == 5);
}

TEST_CASE("recording of ROS: a frame with others below it is not moved below too many") {
  EdgeTable table;
  ForeignTransforms transforms;
  TransformCounts counts;
  const auto takes = [&](const std::string& parent, const std::string& child) {
    std::vector<RecordedValue> values(1);
    values[0].edge = table.add(child, parent);
    transforms.take(values, counts, [](const std::string&) {});
    return values.size() == 1;
  };
  REQUIRE(takes("a", "b"));
  for (int i = 0; i < 20'000; ++i) {
    REQUIRE(takes("f" + std::to_string(i), "f" + std::to_string(i + 1)));
  }
  CHECK(takes("f20000", "leaf"));
  CHECK(takes("f9999", "a"));
  CHECK_FALSE(takes("f10000", "a"));
  CHECK_FALSE(takes("b", "a"));
  CHECK(counts.cycles == 2);
}

TEST_CASE("recording of ROS: names that look alike and cycles are counted by kind") {
  auto recording = Recording::read(file_of({{"base", "a", 1},
                                            {"base", " a", 2},
                                            {"base", "a ", 2},
                                            {"base", "a\xc2\xa0z", 2},
                                            {"base", "-a", 2},
                                            {"b\xe2\x80\x8b", "c", 2},
                                            {"a", "b", 1},
                                            {"b", "c", 1},
                                            {"c", "a", 9},
                                            {"c", "d", 1},
                                            {"base", "zero", 1, {0, 0, 0, 0}},
                                            {"base", "early", 1, {0, 0, 0, 1}, -1}}));
  REQUIRE(recording);
  recording->read_all();
  const auto summary = recording->summary();
  CHECK(summary.transforms->names == 5);
  CHECK(summary.transforms->cycles == 1);
  CHECK(summary.transforms->values == 1);
  CHECK(summary.transforms->early == 1);
  CHECK(summary.left_out == 8);
  CHECK(recording->parent("a") == std::string("base"));
  CHECK(recording->lookup("base", "d")->pose.translation().x() == 4);
  CHECK(recording->frames().size() == 5);
}
