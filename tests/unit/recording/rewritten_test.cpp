// A recording in which the past was rewritten.

#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include "tfdude/recording/recording.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "recording/messages.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"

namespace tfdude::recording {
namespace {

using testing::along_x;
using testing::Approx;
using testing::outcome;

Time at(double seconds) { return time_of(static_cast<std::int64_t>(seconds * 1e9 + 0.5)); }

class File {
 public:
  File()
      : path_(std::filesystem::temp_directory_path() /
              ("tfdude-rewritten-" + std::to_string(getpid()) + ".mcap")) {
    std::filesystem::remove(path_);
  }
  ~File() { std::filesystem::remove(path_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  [[nodiscard]] std::string path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// The robot at the time in metres, four times a second from 0 to 20 s; at 21 s all from 5 s on is
// told to have been at 100 m, and from 12 s on as it was.
void record(RecordingWriter& writer) {
  REQUIRE(writer.add({"slam", ReachNews{true, ""}}, at(0)));
  REQUIRE(writer.add({"slam", FramesNews{{{"map", ""}, {"robot", "map"}}, 7}}, at(0)));
  for (int i = 0; i <= 80; ++i) {
    const double t = 0.25 * i;
    WatchedValue value{1, at(t), along_x(t)};
    if (i == 0) value.begins = Covariance();
    REQUIRE(writer.add({"slam", ValuesNews{static_cast<std::uint64_t>(i + 1), {value}}}, at(t)));
  }
  ValuesNews rewritten{100, {}};
  for (double t = 5; t <= 20; t += 0.5) {
    rewritten.values.push_back({1, at(t), along_x(t < 12 ? 100 : t)});
  }
  rewritten.values[0].begins = Covariance();
  rewritten.values[0].kept_before = at(5);
  REQUIRE(writer.add({"slam", rewritten}, at(21)));
  REQUIRE(writer.add({"slam", ValuesNews{101, {{1, at(22), along_x(22)}}}}, at(22)));
}

double x_at(Recording& recording, double t, double believed) {
  recording.seek(at(believed));
  Query query;
  query.at = at(t);
  const auto X = recording.lookup("map", "robot", query);
  // The same, whatever is shown.
  query.believed_at = at(believed);
  recording.seek(at(0));
  CHECK(outcome(recording.lookup_at("map", "robot", at(t), query)) == outcome(X));
  recording.seek(at(1000));
  const auto again = recording.lookup("map", "robot", query);
  REQUIRE(outcome(again) == outcome(X));
  if (X) CHECK(again->pose.translation() == X->pose.translation());
  if (X) CHECK(recording.trajectory("map", "robot", {at(t)}, query).X_AB.at(0).has_value());
  return X ? X->pose.translation().x() : -1;
}

TEST_CASE("a recording answers as it was believed before a rewrite, and after it") {
  const File file;
  {
    auto writer = RecordingWriter::create(file.path(), at(0));
    REQUIRE(writer);
    record(*writer);
    REQUIRE(writer->finish(at(23)));
  }
  auto recording = Recording::open(file.path());
  REQUIRE(recording);
  for (int again = 0; again < 2; ++again) {
    CHECK(x_at(*recording, 7, 20.5) == Approx(7));
    CHECK(x_at(*recording, 7, 21) == 100);
    CHECK(x_at(*recording, 11.25, 22) == 100);
    CHECK(x_at(*recording, 13, 22) == Approx(13));
    // Before the interval nothing has changed.
    CHECK(x_at(*recording, 2, 20.5) == Approx(2));
    CHECK(x_at(*recording, 2, 22) == Approx(2));
    // Of the old samples none is left beside the new ones.
    CHECK(x_at(*recording, 4.875, 22) == Approx((4.75 + 100) / 2));
    CHECK(x_at(*recording, 21, 22) == Approx(21));
  }
}

TEST_CASE("a recording leaves a sample out that is from before the past which was rewritten") {
  const File file;
  {
    auto writer = RecordingWriter::create(file.path(), at(0));
    REQUIRE(writer);
    record(*writer);
    ValuesNews rewritten{102, {{1, at(3), along_x(100)}, {1, at(5), along_x(5)}}};
    rewritten.values[0].begins = Covariance();
    rewritten.values[0].kept_before = at(5);
    REQUIRE(writer->add({"slam", rewritten}, at(22.5)));
    REQUIRE(writer->finish(at(23)));
  }
  auto recording = Recording::open(file.path());
  REQUIRE(recording);
  for (const double t : {2.75, 3.0, 4.25, 4.875, 5.0}) CHECK(x_at(*recording, t, 23) == Approx(t));
}

// The robot drives 1 m/s in odom, which the map has corrected by 3 m in between.
TEST_CASE("a transform between two instants of a recording is of one state") {
  const File file;
  {
    auto writer = RecordingWriter::create(file.path(), at(0));
    REQUIRE(writer);
    REQUIRE(writer->add({"slam", ReachNews{true, ""}}, at(0)));
    REQUIRE(writer->add(
        {"slam", FramesNews{{{"map", ""}, {"odom", "map"}, {"robot", "odom"}, {"eye", "map"}}, 7}},
        at(0)));
    const auto still = [](std::uint32_t frame, double x, double deviation) {
      WatchedValue value{frame, {}, along_x(x)};
      value.X_PC.covariance =
          Covariance::from_stddev({deviation, deviation, deviation, 0, 0, 0}).value();
      value.begins = Covariance();
      return value;
    };
    REQUIRE(writer->add({"slam", ValuesNews{1, {still(1, 0, 0.1), still(3, 2, 0)}}}, at(0)));
    for (int i = 0; i <= 80; ++i) {
      const double t = 0.25 * i;
      WatchedValue value{2, at(t), along_x(t)};
      if (i == 0) value.begins = Covariance();
      REQUIRE(writer->add({"slam", ValuesNews{static_cast<std::uint64_t>(i + 2), {value}}}, at(t)));
      if (i == 40) REQUIRE(writer->add({"slam", ValuesNews{50, {still(1, 3, 0.2)}}}, at(t)));
      if (i != 60) continue;
      REQUIRE(writer->add(
          {"slam",
           FramesNews{{{"map", ""}, {"odom", "map"}, {"robot", "odom"}, {"eye", "robot"}}, 7}},
          at(t)));
      REQUIRE(writer->add({"slam", ValuesNews{70, {still(3, 0.5, 0)}}}, at(t)));
    }
    REQUIRE(writer->finish(at(23)));
  }
  auto recording = Recording::open(file.path());
  REQUIRE(recording);
  const auto between = [&](const std::string& a, double t_a, const std::string& b, double t_b) {
    return recording->lookup_at(a, at(t_a), b, at(t_b), "map", {});
  };
  for (const auto& [from, to] : {std::pair(8.0, 12.0), std::pair(12.0, 8.0)}) {
    const auto X = between("robot", from, "robot", to);
    REQUIRE(X);
    CHECK(X->pose.translation().x() == Approx(to - from));
    CHECK(X->covariance.of_specified().matrix().cwiseAbs().maxCoeff() < 1e-15);
    CHECK(X->stamp == at(to));
  }
  const auto seen = between("eye", 12, "robot", 8);
  REQUIRE(seen);
  CHECK(seen->pose.translation().x() == Approx(3 + 8 - 2));
  CHECK(seen->covariance.of_specified().matrix()(0, 0) == Approx(0.04));
  // In between it is taken from the map to the robot.
  const auto carried = between("eye", 12, "robot", 18);
  REQUIRE(carried);
  CHECK(carried->pose.translation().x() == Approx(3 + 18 - 2));
  // Before the correction nobody knew of it.
  const auto before = between("eye", 7, "robot", 8);
  REQUIRE(before);
  CHECK(before->pose.translation().x() == Approx(8 - 2));
}

// Chunks: a covariance, another one, and a value with the covariance as before.
TEST_CASE("after a damaged part of a recording no covariance from before it is taken") {
  const File file;
  std::uintmax_t begin = 0;
  std::uintmax_t end = 0;
  {
    auto writer = RecordingWriter::create(file.path(), at(0));
    REQUIRE(writer);
    REQUIRE(writer->add({"slam", ReachNews{true, ""}}, at(0)));
    REQUIRE(writer->add({"slam", FramesNews{{{"map", ""}, {"robot", "map"}}, 7}}, at(0)));
    const auto add = [&](int i, double deviation) {
      WatchedValue value{1, at(i), along_x(i)};
      value.X_PC.covariance =
          Covariance::from_stddev({deviation, deviation, deviation, 0, 0, 0}).value();
      if (i == 1) value.begins = Covariance();
      REQUIRE(writer->add({"slam", ValuesNews{static_cast<std::uint64_t>(i), {value}}}, at(i)));
      REQUIRE(writer->flush(at(i)));
    };
    add(1, 0.01);
    begin = std::filesystem::file_size(file.path());
    add(2, 1);
    end = std::filesystem::file_size(file.path());
    add(3, 1);
    REQUIRE(writer->finish(at(4)));
  }
  const auto variance_at = [&](int t) -> std::optional<double> {
    auto recording = Recording::open(file.path());
    REQUIRE(recording);
    const auto X = recording->lookup_at("map", "robot", at(t), {});
    if (!X) return std::nullopt;
    return X->covariance.of_specified().matrix()(0, 0);
  };
  CHECK(variance_at(3) == 1.0);
  {
    std::fstream bytes(file.path(), std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekg(static_cast<std::streamoff>(begin + end) / 2);
    const int byte = bytes.peek();
    bytes.seekp(static_cast<std::streamoff>(begin + end) / 2);
    bytes.put(static_cast<char>(byte ^ 1));
  }
  CHECK(variance_at(1) == Approx(1e-4));
  CHECK_FALSE(variance_at(3));
}

TEST_CASE("ten minutes at 100 Hz are one message of a recording") {
  const File file;
  constexpr std::uint32_t kCount = 60'000;
  {
    auto writer = RecordingWriter::create(file.path(), at(0));
    REQUIRE(writer);
    REQUIRE(writer->add({"slam", ReachNews{true, ""}}, at(0)));
    REQUIRE(writer->add({"slam", FramesNews{{{"map", ""}, {"robot", "map"}}, 7}}, at(0)));
    WatchedValue first{1, at(0), along_x(1)};
    first.begins = Covariance();
    REQUIRE(writer->add({"slam", ValuesNews{1, {first}}}, at(600)));
    ValuesNews rewritten{2, {}};
    for (std::uint32_t i = 0; i < kCount; ++i) {
      Covariance::Upper own{};  // each has another one
      own[0] = 1e-6 * (i + 1);
      rewritten.values.push_back(
          {1, at(0.01 * (i + 1)), {along_x(i + 2).pose, Covariance::trusted(own)}});
    }
    rewritten.values[0].begins = Covariance();
    rewritten.values[0].kept_before = at(0.01);
    REQUIRE(writer->add({"slam", rewritten}, at(601)));
    REQUIRE(writer->finish(at(602)));
  }
  auto recording = Recording::open(file.path());
  REQUIRE(recording);
  CHECK(recording->summary().problems.empty());
  CHECK(x_at(*recording, 0, 600) == 1);
  CHECK(x_at(*recording, 0, 601) == 1);
  CHECK(x_at(*recording, 0.01, 601) == 2);
  CHECK(x_at(*recording, 600, 601) == kCount + 1);
}

TEST_CASE("what a value continues is written after the values, where earlier versions stop") {
  const WatchedFrame edge{"robot", "map"};
  EdgeTable edges;
  std::string with;
  std::string without;
  WatchedValue value{0, at(3), along_x(1), {}, Covariance()};
  {
    ValuesEncoder encoder(without, "slam", 5, false);
    encoder.add(edge, value, false);
    encoder.finish();
  }
  without.resize(without.size() - 4);
  value.kept_before = at(2);
  {
    ValuesEncoder encoder(with, "slam", 5, false);
    encoder.add(edge, value, false);
    encoder.add(edge, WatchedValue{0, at(4), along_x(2)}, false);
    encoder.finish();
  }
  RecordedValues whole;
  REQUIRE(ValuesDecoder(edges).decode(with, whole));
  REQUIRE(whole.values.size() == 2);
  CHECK(whole.values[0].watched(0).kept_before == at(2));
  CHECK_FALSE(whole.values[1].watched(0).kept_before);
  // As earlier versions have written it.
  RecordedValues earlier;
  REQUIRE(ValuesDecoder(edges).decode(without, earlier));
  REQUIRE(earlier.values.size() == 1);
  CHECK_FALSE(earlier.values[0].watched(0).kept_before);
  for (std::size_t size = without.size(); size < with.size(); ++size) {
    RecordedValues cut;
    const bool valid =
        ValuesDecoder(edges).decode(std::string_view(with).substr(0, size), cut).has_value();
    if (valid) CHECK(cut.values.size() <= 2);
  }
}

}  // namespace
}  // namespace tfdude::recording
