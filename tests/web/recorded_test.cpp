// A recording that a page has sent, without a network: how it comes in pieces, and what the page is
// told of it.

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/recording/recording_writer.hpp"

#include "recording/mcap_writer.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "tfdude-web/recorded_view.hpp"
#include "tfdude-web/upload.hpp"
#include "types/ros_tf.hpp"

namespace tfdude::web {
namespace {

using testing::along_x;
using testing::ContainsSubstring;

Time at(double seconds) { return time_of(static_cast<std::int64_t>(seconds * 1e9)); }

std::string bytes_of(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

WatchedValue value(std::uint32_t frame, double x, std::optional<Time> stamp = std::nullopt,
                   bool begins = false) {
  WatchedValue made{frame, stamp, along_x(x)};
  if (begins) made.begins = Covariance();
  return made;
}

// The hand moves in the base from 10 s to 12 s, ten times a second: it is where it is in time [m].
// At 11 s a finger is added. A joint moves with it, and the arm is lost at the end.
std::string of_robot(const testing::TemporaryDirectory& folder) {
  const std::string file = folder.path() + "/robot.mcap";
  auto writer = RecordingWriter::create(file, at(10));
  REQUIRE(writer);
  const auto add = [&](PartitionNews news, double t) { REQUIRE(writer->add(news, at(t))); };
  add({"arm", ReachNews{true, ""}}, 10);
  add({"arm", FramesNews{{{"base", ""}, {"hand", "base"}}, 7}}, 10);
  add({"arm", ValuesNews{1, {value(1, 10, at(10), true)}}}, 10);
  for (int i = 1; i <= 20; ++i) {
    const double t = 10 + i * 0.1;
    if (i == 10) {
      add({"arm", FramesNews{{{"base", ""}, {"finger", "hand"}, {"hand", "base"}}, 7}}, t);
      Change change;
      change.kind = ChangeKind::kFrameAdded;
      change.partition = "arm";
      change.frame = "finger";
      REQUIRE(writer->add(change, at(t)));
    }
    const std::uint32_t hand = i < 10 ? 1 : 2;
    add({"arm", ValuesNews{static_cast<std::uint64_t>(i + 1), {value(hand, t, at(t))}}}, t);
    JointInfo joint;
    joint.name = "elbow";
    joint.frame = "hand";
    joint.position = t;
    REQUIRE(writer->add("arm", {joint}, at(t)));
  }
  add({"arm", ReachNews{false, "it was lost"}}, 12.1);
  REQUIRE(writer->finish(at(12.1)));
  return bytes_of(file);
}

// The message of a kind in what is told; null: there is none.
nlohmann::json said(const std::vector<Told>& told, const std::string& op) {
  for (const Told& one : told) {
    if (one.binary) continue;
    auto json = nlohmann::json::parse(one.bytes);
    if (json.at("op") == op) return json;
  }
  return nullptr;
}

// The binary message of values.
std::string values_in(const std::vector<Told>& told) {
  for (const Told& one : told) {
    if (one.binary && one.bytes.at(0) == 1) return one.bytes;
  }
  return {};
}

template <class T>
T number_at(const std::string& bytes, std::size_t place) {
  T number{};
  REQUIRE(bytes.size() >= place + sizeof(T));
  std::memcpy(&number, bytes.data() + place, sizeof(T));
  return number;
}

}  // namespace

TEST_CASE("web recording: pieces come whole, in order, and not too far ahead of the disk") {
  const auto now = Upload::Clock::now();
  Upload upload(10 * Upload::kPiece + 5, now);
  CHECK_FALSE(upload.receive(5, now));
  CHECK_FALSE(upload.receive(0, now));
  CHECK_FALSE(upload.receive(Upload::kPiece + 1, now));
  for (std::size_t i = 0; i < Upload::kAhead; ++i) CHECK(upload.receive(Upload::kPiece, now));
  CHECK_FALSE(upload.receive(Upload::kPiece, now));
  upload.write(Upload::kPiece);
  CHECK(upload.receive(Upload::kPiece, now));
  CHECK_FALSE(upload.receive(Upload::kPiece, now));
  upload.write(8 * Upload::kPiece);
  CHECK(upload.receive(Upload::kPiece, now));
  CHECK_FALSE(upload.receive(Upload::kPiece, now));
  CHECK(upload.receive(5, now));
  CHECK_FALSE(upload.receive(1, now));
  CHECK_FALSE(upload.complete());
  upload.write(Upload::kPiece + 5);
  CHECK(upload.complete());
}

TEST_CASE("web recording: one that stalls, or takes too long, is late") {
  const auto begin = Upload::Clock::now();
  Upload upload(200 * Upload::kPiece, begin);
  CHECK_FALSE(upload.is_late(begin + Upload::kPieceTime));
  CHECK(upload.is_late(begin + Upload::kPieceTime + std::chrono::milliseconds(1)));
  auto now = begin;
  std::size_t pieces = 0;
  for (; !upload.is_late(now); now += std::chrono::seconds(9), ++pieces) {
    REQUIRE(upload.receive(Upload::kPiece, now));
    upload.write(Upload::kPiece);
  }
  CHECK(now - begin > Upload::kWholeTime);
  CHECK(pieces < 100);
  // All has come; that it is written is not the page's part.
  Upload small(5, begin);
  REQUIRE(small.receive(5, begin));
  CHECK_FALSE(small.is_late(begin + std::chrono::hours(1)));
}

TEST_CASE("web recording: what is too large, empty or no MCAP file is told before it is sent") {
  constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;
  CHECK(check_size(1, kMiB));
  CHECK(check_size(kMiB, kMiB));
  CHECK(check_size(kMiB + 1, kMiB).error().message ==
        "the file has 2 MiB, and this server takes 1 MiB (--max-recording)");
  CHECK(check_size(UINT64_MAX, kMiB).error().code == Errc::kTooMuch);
  CHECK(check_size(0, kMiB).error().code == Errc::kInvalidInput);
  CHECK(check_size(1, 0).error().code == Errc::kTooMuch);
  CHECK(check_beginning("\x89MCAP0\r\n and more"));
  for (const char* bad : {"", "\x89MCAP", "#ROSBAG V2.0\n", "SQLite format 3", "\x89MCAP1\r\n"}) {
    INFO(bad);
    REQUIRE_FALSE(check_beginning(bad));
    CHECK_THAT(check_beginning(bad).error().message, ContainsSubstring("no MCAP file"));
  }
}

TEST_CASE("web recording: a page is told what was known at an instant, in any order") {
  const testing::TemporaryDirectory folder;
  auto view = RecordedView::read(of_robot(folder));
  REQUIRE(view);
  const auto first = view->begin();
  const auto about = said(first, "recording");
  CHECK(about.at("start") == std::to_string(nanoseconds(at(10))));
  CHECK(about.at("end") == std::to_string(nanoseconds(at(12.1))));
  CHECK(about.at("foreign") == false);
  CHECK(about.at("finished") == true);
  REQUIRE(said(first, "events").at("events").size() == 1);
  CHECK(said(first, "events")["events"][0].at("frame") == "finger");

  const auto end = view->at(at(99), "base", "hand");  // after the end: the end
  REQUIRE(end);
  const auto late = said(*end, "structure");
  CHECK(late.at("frames").size() == 3);
  CHECK(late.at("partitions").at(0).at("reachable") == false);
  CHECK_THAT(said(*end, "pair").at("error").get<std::string>(), ContainsSubstring("it was lost"));

  const auto early = view->at(at(10.55), "base", "hand");
  REQUIRE(early);
  const auto structure = said(*early, "structure");
  CHECK(structure.at("frames").size() == 2);
  CHECK(structure.at("version") != late.at("version"));
  CHECK(structure.at("partitions").at(0).at("reachable") == true);
  const std::string values = values_in(*early);
  CHECK(number_at<std::uint8_t>(values, 1) == 1);  // of the instant that was asked for
  CHECK(number_at<std::uint32_t>(values, 4) == structure.at("version").get<std::uint32_t>());
  CHECK(number_at<std::int64_t>(values, 8) == nanoseconds(at(10.55)));
  REQUIRE(number_at<std::uint32_t>(values, 16) == 1);
  CHECK(number_at<std::int32_t>(values, 24) == -500);  // 50 ms before, in 0.1 ms
  CHECK(number_at<float>(values, 28) == 10.5F);
  const auto pair = said(*early, "pair");
  CHECK(pair.at("past") == true);
  CHECK(pair.at("translation")[0] == testing::Approx(10.5));
  CHECK(said(*early, "joints").at("joints")[0].at("position") == testing::Approx(10.5));

  // The same structure is not told again, and what is not chosen is not told.
  const auto next = view->at(at(10.56), "", "");
  REQUIRE(next);
  CHECK(said(*next, "structure").is_null());
  CHECK(said(*next, "pair").is_null());
  CHECK(said(*next, "joints").is_null());
  CHECK(number_at<std::uint32_t>(values_in(*next), 4) ==
        structure.at("version").get<std::uint32_t>());
  const auto nowhere = view->at(at(10.6), "base", "nowhere");
  REQUIRE(nowhere);
  CHECK_THAT(said(*nowhere, "pair").at("error").get<std::string>(), ContainsSubstring("nowhere"));
}

TEST_CASE("web recording: a recording of ROS is shown, without covariances and events") {
  std::string file;
  recording::McapWriter writer(
      [&](std::string_view bytes) {
        file += bytes;
        return Result<void>();
      },
      {"ros2", "libmcap", true, 1, 300});
  REQUIRE(writer.start());
  REQUIRE(writer.add_schema({1, "tf2_msgs/msg/TFMessage", "ros2msg", "..."}));
  REQUIRE(writer.add_channel({1, 1, "/tf", "cdr", {}}));
  for (int i = 0; i <= 20; ++i) {
    std::string message;
    ros::TfEncoder encoder(message);
    encoder.add("odom", "base", along_x(i).pose, at(10 + i));
    encoder.finish();
    REQUIRE(writer.write({1, nanoseconds(at(10 + i)), 0, message}));
  }
  REQUIRE(writer.finish());
  auto view = RecordedView::read(file);
  REQUIRE(view);
  const auto first = view->begin();
  CHECK(said(first, "recording").at("foreign") == true);
  CHECK(said(first, "events").at("events").empty());
  const auto told = view->at(at(15.5), "odom", "base");
  REQUIRE(told);
  CHECK(said(*told, "structure").at("partitions").at(0).at("name") == "ros");
  CHECK(said(*told, "pair").at("translation")[0] == testing::Approx(5));
  CHECK(said(*told, "pair").at("covariance").is_null());
}

TEST_CASE("web recording: more frames than a page draws are rejected") {
  const testing::TemporaryDirectory folder;
  const std::string file = folder.path() + "/many.mcap";
  auto writer = RecordingWriter::create(file, at(1));
  REQUIRE(writer);
  FramesNews frames{{{"base", ""}}, 1};
  for (std::size_t i = 1; i <= RecordedView::kMostFrames; ++i) {
    frames.frames.push_back({"f" + std::to_string(1'000'000 + i), "base"});
  }
  REQUIRE(writer->add({"fleet", ReachNews{true, ""}}, at(1)));
  REQUIRE(writer->add({"fleet", frames}, at(1)));
  REQUIRE(writer->finish(at(2)));
  auto view = RecordedView::open(file);
  REQUIRE(view);
  const auto told = view->at(at(2), "", "");
  REQUIRE_FALSE(told);
  CHECK(told.error().code == Errc::kTooMuch);
  CHECK_THAT(told.error().message, ContainsSubstring("50001 frames"));
}

TEST_CASE("web recording: an error does not name the server's file") {
  const testing::TemporaryDirectory folder;
  const std::string file = folder.write("secret.mcap", "\x89MCAP0\r\n nothing");
  const auto view = RecordedView::open(file);
  REQUIRE_FALSE(view);
  CHECK_THAT(view.error().message, ContainsSubstring("the file") && !ContainsSubstring("secret"));
}

}  // namespace tfdude::web
