// What commands ask of a recording.

#include "tfdude/source.hpp"

#include <cmath>
#include <filesystem>
#include <string>
#include <unistd.h>

#include "tfdude/recording/recording_writer.hpp"

#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

Time at(double seconds) { return time_of(std::llround((1000 + seconds) * 1e9)); }

// Two frames that are at the time in metres, told in turns, from 1 s to 5 s.
Recording two_that_move() {
  const std::string file = (std::filesystem::temp_directory_path() /
                            ("tfdude-source-" + std::to_string(getpid()) + ".mcap"))
                               .string();
  std::filesystem::remove(file);
  auto writer = RecordingWriter::create(file, at(1));
  REQUIRE(writer);
  REQUIRE(writer->add({"robot", ReachNews{true, ""}}, at(1)));
  REQUIRE(writer->add({"robot", FramesNews{{{"arm", "base"}, {"base", ""}, {"tool", "base"}}, 7}},
                      at(1)));
  for (int i = 0; i <= 400; ++i) {
    const double t = 1 + i * 0.01;
    const auto X = Transform::exact(Pose::trusted(Eigen::Quaterniond::Identity(), {t, 0, 0}));
    ValuesNews news{static_cast<std::uint64_t>(i + 1), {}};
    for (const std::uint32_t frame : {0U, 2U}) {
      if (i > 1 && i % 2 != (frame == 0 ? 0 : 1)) continue;
      WatchedValue value{frame, at(t), X};
      if (i == 0) value.begins = Covariance();
      news.values.push_back(std::move(value));
    }
    REQUIRE(writer->add({"robot", std::move(news)}, at(t)));
  }
  REQUIRE(writer->finish(at(5)));
  auto recording = Recording::open(file);
  std::filesystem::remove(file);
  REQUIRE(recording);
  return *std::move(recording);
}

}  // namespace

TEST_CASE("source: a recording is read on for each frame at one instant") {
  Recording recording = two_that_move();
  const bool arm_first = GENERATE(true, false);
  Source source(recording);
  source.go_to(at(2.005));
  Query query;
  query.at = at(2.005);
  for (int i = 0; i < 2; ++i) {
    for (const char* frame : {arm_first ? "arm" : "tool", arm_first ? "tool" : "arm"}) {
      CAPTURE(frame, i);
      const auto X = source.lookup("base", frame, query);
      REQUIRE(X);
      CHECK(X->pose.translation().x() == testing::Approx(2.005));
    }
  }
}

TEST_CASE("source: a stamp of another clock is answered as of the end") {
  Recording recording = two_that_move();
  Source source(recording);
  const Time other = at(-995);
  source.go_to(other);
  CHECK(recording.instant() == at(5));
  CHECK(source.frames()->size() == 3);
  Query query;
  query.at = other;
  CHECK(source.lookup("base", "arm", query).error().code == Errc::kTooOld);
  query.at = at(1.5);
  CHECK(source.lookup("base", "arm", query));
  // One just before the beginning is of this clock: nothing is known then.
  CHECK(recording.instant_for(at(0.5)) == at(0.5));
}

}  // namespace tfdude::cli
