// What a recording answers when an owner dies, and perhaps returns: what the live system said.

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <unistd.h>
#include <vector>

#include "tfdude/recording/recording.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "support/catch.hpp"

using namespace tfdude;
using tfdude::testing::ContainsSubstring;

namespace {

Time at(double seconds) { return time_of(static_cast<std::int64_t>(seconds * 1e9)); }

Transform shifted(double x) {
  return {*Pose::create(Eigen::Quaterniond::Identity(), {x, 0, 0}), {}};
}

// The indices of kFrames.
constexpr std::uint32_t kArm = 0;
constexpr std::uint32_t kHand = 1;
const std::vector<WatchedFrame> kFrames{{"arm", "base"}, {"hand", "arm"}};

WatchedValue fixed(std::uint32_t frame, double x) {
  return {frame, std::nullopt, shifted(x), {}, Covariance()};
}
WatchedValue unsampled(std::uint32_t frame, double x) {
  WatchedValue value = fixed(frame, x);
  value.unsampled = true;
  return value;
}
WatchedValue sample(double x, double t, bool begins = false) {
  return {kHand, at(t), shifted(x), {}, begins ? std::optional(Covariance()) : std::nullopt};
}

// A robot "base" that is always there, and an arm that is killed at 5 s, which is noticed 0.5 s
// later. The arm's frame is static at 1 m, its hand is at 100 m and its time in metres.
class Film {
 public:
  explicit Film(const RecordingOptions& options = {})
      : path_(std::filesystem::temp_directory_path() /
              ("tfdude-deaths-" + std::to_string(getpid()) + ".mcap")) {
    std::filesystem::remove(path_);
    auto created = RecordingWriter::create(path_, at(1), options);
    REQUIRE(created);
    writer_.emplace(*std::move(created));
    add("robot", ReachNews{true, ""}, 1);
    add("robot", FramesNews{{{"base", ""}}, 3}, 1);
    add("arm", ReachNews{true, ""}, 1);
    add("arm", FramesNews{kFrames, 7}, 1);
    add("arm", ValuesNews{1, {fixed(kArm, 1), sample(101, 1, true)}}, 1);
    move(1, 5);
    add("arm", ReachNews{false, "partition 'arm' was lost"}, 5.5);
  }
  ~Film() {
    for (const std::string& file : writer_->files()) std::filesystem::remove(file);
  }
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;

  template <class News>
  void add(const std::string& partition, News news, double t) {
    REQUIRE(writer_->add(PartitionNews{partition, std::move(news)}, at(t)));
  }
  // A sample every 20 ms after an instant, recorded at once or, late, at this time.
  void move(double from, double until, double late = 0) {
    for (int i = 1; from + i * 0.02 <= until + 1e-6; ++i) {
      const double t = from + i * 0.02;
      add("arm", ValuesNews{++commit_, {sample(100 + t, t)}}, std::max(t + 0.001, late));
    }
  }
  // The arm is back at 9 s, as another process.
  void restart(const std::vector<WatchedFrame>& frames = kFrames) {
    add("arm", ReachNews{true, ""}, 9);
    add("arm", FramesNews{frames, 8}, 9.0001);
  }
  [[nodiscard]] Recording watched() {
    REQUIRE(writer_->finish(at(20)));
    auto recording = Recording::open(writer_->files().back());
    REQUIRE(recording);
    return *std::move(recording);
  }
  [[nodiscard]] RecordingWriter& writer() { return *writer_; }

 private:
  const std::string path_;
  std::optional<RecordingWriter> writer_;
  std::uint64_t commit_ = 1;
};

// The translation and the stamp, or the error.
std::string said(const Result<StampedTransform>& X) {
  if (!X) return std::string(to_string(X.error().code));
  const auto x = std::to_string(X->pose.translation().x());
  return x + (X->stamp ? " at " + std::to_string(nanoseconds(*X->stamp) / 1'000'000) : "");
}

std::string then(Recording& recording, const char* to, double t) {
  return said(recording.lookup_at("base", to, at(t)));
}

std::string newest(Recording& recording, const char* to, double t) {
  recording.seek(at(t));
  return said(recording.lookup("base", to));
}

const std::string kBefore = "104.030000 at 3030";  // between two samples

}  // namespace

TEST_CASE("recording: within the gap of a death it answers as the live system: unreachable") {
  Film film;
  film.restart();
  SECTION("with the last sample, restored") {
    film.add("arm", ValuesNews{1, {fixed(kArm, 1), sample(105, 5, true)}}, 9.001);
    film.add("arm", ValuesNews{2, {sample(109.5, 9.5, true)}}, 9.501);
  }
  SECTION("with the configured value, that of no instant") {
    film.add("arm", ValuesNews{1, {fixed(kArm, 1), unsampled(kHand, 100)}}, 9.001);
    film.add("arm", ValuesNews{2, {sample(109.5, 9.5)}}, 9.501);
  }
  SECTION("with a value that held for all times, as earlier versions restored it") {
    film.add("arm", ValuesNews{1, {fixed(kArm, 1), fixed(kHand, 100)}}, 9.001);
    film.add("arm", ValuesNews{2, {sample(109.5, 9.5)}}, 9.501);
  }
  film.move(9.5, 12);
  Recording recording = film.watched();
  CHECK(then(recording, "hand", 3.03) == kBefore);
  CHECK(then(recording, "hand", 5) == "106.000000 at 5000");
  for (const double t : {5.01, 5.3, 5.6, 7.0, 8.999}) {
    CAPTURE(t);
    CHECK(then(recording, "hand", t) == "unreachable");
  }
  for (const double t : {5.6, 7.0, 8.999}) {
    CAPTURE(t);
    CHECK(then(recording, "arm", t) == "unreachable");
    CHECK(newest(recording, "arm", t) == "unreachable");
    CHECK(newest(recording, "hand", t) == "unreachable");
    CHECK(said(recording.lookup_at("base", "base", at(t))) == "0.000000");
  }
  const auto why = recording.lookup_at("base", "hand", at(7));
  REQUIRE_FALSE(why);
  CHECK(why.error().message == "partition 'arm' was lost");
  CHECK(then(recording, "hand", 10.03) == "111.030000 at 10030");
  CHECK(then(recording, "arm", 10) == "1.000000");
  // The frame is in the structure all the time.
  recording.seek(at(7));
  CHECK(recording.exists("hand"));
  CHECK_FALSE(recording.partitions().at(0).reachable);
}

TEST_CASE("recording: between the return and the first sample nobody has measured a pose") {
  Film film;
  film.restart();
  const bool restored = GENERATE(false, true);
  CAPTURE(restored);
  const WatchedValue left = restored ? sample(105, 5, true) : unsampled(kHand, 100);
  film.add("arm", ValuesNews{1, {fixed(kArm, 1), left}}, 9.001);
  film.add("arm", ValuesNews{2, {sample(109.5, 9.5, restored)}}, 9.501);
  film.move(9.5, 12);
  Recording recording = film.watched();
  CHECK(then(recording, "hand", 9.2) == "too_old");
  CHECK(newest(recording, "hand", 9.2) == (restored ? "106.000000 at 5000" : "101.000000"));
  CHECK(then(recording, "arm", 9.2) == "1.000000");
  // The values of the process before are not those of this one.
  CHECK(newest(recording, "hand", 9.0005) == "not_yet");
}

TEST_CASE("recording: a process that was silent and continues has the samples of its silence") {
  Film film;
  film.add("arm", ReachNews{true, ""}, 7);
  film.move(5, 12, 7.001);
  Recording recording = film.watched();
  CHECK(newest(recording, "hand", 6) == "unreachable");
  CHECK(then(recording, "hand", 6.01) == "107.010000 at 6010");
  CHECK(then(recording, "arm", 6) == "1.000000");
}

TEST_CASE("recording: an owner that never returns stays unreachable until the end") {
  Film film;
  Recording recording = film.watched();
  CHECK(said(recording.lookup("base", "hand")) == "unreachable");
  CHECK(said(recording.lookup("base", "arm")) == "unreachable");
  CHECK(then(recording, "hand", 3.03) == kBefore);
  CHECK(then(recording, "hand", 5.2) == "unreachable");
  CHECK(then(recording, "hand", 19) == "unreachable");
}

TEST_CASE("recording: what only a former process owned is unreachable within the gap") {
  Film film;
  film.restart({{"arm", "base"}});
  film.add("arm", ValuesNews{1, {fixed(kArm, 2)}}, 9.001);
  Recording recording = film.watched();
  CHECK(then(recording, "hand", 7) == "unreachable");
  CHECK(then(recording, "arm", 7) == "unreachable");
  CHECK(then(recording, "arm", 4) == "1.000000");
  CHECK(then(recording, "arm", 10) == "2.000000");
  CHECK(then(recording, "hand", 10) == "unknown_end");
}

TEST_CASE("recording: a file that begins within the gap knows that the owner is unreachable") {
  RecordingOptions options;
  options.split_after = Milliseconds(6000);
  Film film(options);
  film.add("robot", ValuesNews{1, {}}, 7);  // the second file begins
  film.restart();
  film.add("arm", ValuesNews{1, {fixed(kArm, 1), sample(105, 5, true)}}, 9.001);
  film.add("arm", ValuesNews{2, {sample(109.5, 9.5, true)}}, 9.501);
  film.move(9.5, 12);
  REQUIRE(film.writer().files().size() == 2);
  Recording recording = film.watched();
  CHECK(newest(recording, "hand", 8) == "unreachable");
  CHECK(then(recording, "hand", 8) == "unreachable");
  CHECK(then(recording, "arm", 8) == "unreachable");
  CHECK(then(recording, "hand", 10.03) == "111.030000 at 10030");
}

TEST_CASE("recording: a frame that another partition takes over has no value of its owner before") {
  Film film;
  film.add("spare", ReachNews{true, ""}, 8);
  film.add("spare", FramesNews{kFrames, 9}, 8);
  film.add("spare", ValuesNews{1, {fixed(kArm, 3), unsampled(kHand, 50)}}, 8.5);
  Recording recording = film.watched();
  CHECK(newest(recording, "hand", 7) == "unreachable");
  CHECK(newest(recording, "hand", 8.2) == "not_yet");
  CHECK(newest(recording, "hand", 8.6) == "53.000000");
  CHECK(then(recording, "hand", 8.6) == "not_yet");
  // Nobody knows where they were before.
  CHECK(then(recording, "hand", 7) == "unreachable");
  CHECK(then(recording, "arm", 7) == "unreachable");
  CHECK(then(recording, "arm", 8.6) == "3.000000");
  const Trajectory all = recording.trajectory("base", "arm", {at(7), at(8.6)});
  CHECK_FALSE(all.X_AB[0]);
  CHECK(all.X_AB[1]);
}

TEST_CASE("recording: a frame that is added again elsewhere was nowhere before") {
  Film film;
  film.add("spare", ReachNews{true, ""}, 6);
  film.add("spare", FramesNews{{}, 9}, 6);
  film.add("spare", FramesNews{{{"arm", "base"}}, 9}, 8);
  film.add("spare", ValuesNews{1, {fixed(0, 700)}}, 8.1);
  Recording recording = film.watched();
  CHECK(then(recording, "arm", 4) == "1.000000");
  CHECK(then(recording, "arm", 7) == "unreachable");
  CHECK(then(recording, "arm", 9) == "700.000000");
}

TEST_CASE("recording: the state of a value that is that of no instant is repeated in each file") {
  RecordingOptions options;
  options.split_after = Milliseconds(9500);
  Film film(options);
  film.restart();
  film.add("arm", ValuesNews{1, {fixed(kArm, 1), unsampled(kHand, 100)}}, 9.001);
  film.add("robot", ValuesNews{1, {}}, 11);
  REQUIRE(film.writer().files().size() == 2);
  Recording recording = film.watched();
  CHECK(said(recording.lookup("base", "hand")) == "101.000000");
  CHECK(then(recording, "hand", 11) == "not_yet");
  // And told to players.
  bool told = false;
  for (const PartitionNews& news : recording.state()) {
    if (const auto* values = std::get_if<ValuesNews>(&news.what)) {
      for (const WatchedValue& value : values->values) told = told || value.unsampled;
    }
  }
  CHECK(told);
}
