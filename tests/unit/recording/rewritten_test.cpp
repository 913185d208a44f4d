// A recording in which the past was rewritten.

#include <filesystem>
#include <string>
#include <unistd.h>
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
