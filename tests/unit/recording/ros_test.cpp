// Recordings of ROS: names and numbers as the bridge takes them.

#include <array>
#include <string>

#include "tfdude/recording/recording.hpp"

#include "base/cdr.hpp"
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
};

// A file of rosbag2 with one message for each transform, logged from 10 s on, once a second.
std::string file_of(const std::vector<Sent>& all, const std::string& topic = "/tf_static",
                    std::uint32_t stamp = 10) {
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
  std::uint64_t log = 10'000'000'000;
  for (const Sent& sent : all) {
    std::string message;
    CdrWriter cdr(message);
    cdr.u32(1);
    cdr.u32(stamp);
    cdr.u32(0);
    cdr.text(sent.parent);
    cdr.text(sent.child);
    for (const double number : {sent.x, 0.0, 0.0}) cdr.f64(number);
    for (const double number : sent.quat) cdr.f64(number);
    cdr.finish();
    REQUIRE(writer.write({1, static_cast<std::int64_t>(log), 0, message}));
    log += 1'000'000'000;
  }
  REQUIRE(writer.finish());
  return file;
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
