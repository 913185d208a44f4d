// What a recording answers when frames are moved: as the live system, in the structure of each
// instant. The news of several owners are recorded one after the other, in any order.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <unistd.h>
#include <utility>
#include <vector>

#include "tfdude/recording/recording.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "support/catch.hpp"

using namespace tfdude;

namespace {

Time at(double seconds) { return time_of(static_cast<std::int64_t>(seconds * 1e9)); }

// A value that holds for all times, of the frame with this index.
WatchedValue fixed(std::uint32_t frame, double x) {
  return {frame,
          std::nullopt,
          {*Pose::create(Eigen::Quaterniond::Identity(), {x, 0, 0}), {}},
          {},
          Covariance()};
}

// One of an instant, which is 1 m less than its time.
WatchedValue sample(std::uint32_t frame, double t, bool begins = false) {
  WatchedValue value = fixed(frame, t - 1);
  value.stamp = at(t);
  if (!begins) value.begins.reset();
  return value;
}

// A file, of a partition "root" with the frame "world", and others.
class Film {
 public:
  Film()
      : path_(std::filesystem::temp_directory_path() /
              ("tfdude-structure-" + std::to_string(getpid()) + ".mcap")) {
    std::filesystem::remove(path_);
    auto created = RecordingWriter::create(path_, at(1), {});
    REQUIRE(created);
    writer_.emplace(*std::move(created));
    add("root", {{"world", ""}}, 1);
  }
  ~Film() { std::filesystem::remove(path_); }
  Film(const Film&) = delete;
  Film& operator=(const Film&) = delete;

  // All frames of a partition, of this process of it; they are sorted.
  void add(const std::string& partition, const std::vector<WatchedFrame>& frames, double t,
           std::uint64_t incarnation = 1) {
    reach(partition, t);
    REQUIRE(writer_->add({partition, FramesNews{frames, incarnation}}, at(t)));
  }
  // A partition is reachable, and its frames follow.
  void reach(const std::string& partition, double t) {
    REQUIRE(writer_->add({partition, ReachNews{true, ""}}, at(t)));
  }
  void set(const std::string& partition, std::vector<WatchedValue> values, double t) {
    REQUIRE(writer_->add({partition, ValuesNews{++commit_, std::move(values)}}, at(t)));
  }
  [[nodiscard]] Recording watched() {
    REQUIRE(writer_->finish(at(20)));
    auto recording = Recording::open(path_);
    REQUIRE(recording);
    return *std::move(recording);
  }

 private:
  const std::string path_;
  std::optional<RecordingWriter> writer_;
  std::uint64_t commit_ = 0;
};

std::string said(const Result<StampedTransform>& X) {
  if (!X) return std::string(to_string(X.error().code));
  return std::to_string(X->pose.translation().x());
}

std::string said(const Trajectory& trajectory, std::size_t i) {
  if (const auto& X = trajectory.X_AB[i]) return std::to_string(X->pose.translation().x());
  for (const MissingInstants& missing : trajectory.missing) {
    const bool is_among = i >= missing.first && i < missing.first + missing.count;
    if (is_among) return std::string(to_string(missing.error.code));
  }
  return "nothing";
}

// By a lookup and by a trajectory, which reads a file once for many instants.
std::string then(Recording& recording, const char* frame, double t) {
  const std::string one = said(recording.lookup_at("world", frame, at(t)));
  const Trajectory many = recording.trajectory("world", frame, {at(t), at(t + 0.001)});
  CHECK(said(many, 0) == one);
  return one;
}

std::string newest(Recording& recording, const char* frame, double t) {
  recording.seek(at(t));
  return said(recording.lookup("world", frame));
}

}  // namespace

TEST_CASE("recording: a frame and the one below it change places") {
  const bool other_process = GENERATE(false, true);
  const bool upwards = GENERATE(false, true);
  CAPTURE(other_process, upwards);
  Film film;
  const std::vector<WatchedFrame> up{{"arm", "world"}, {"hand", "arm"}};
  const std::vector<WatchedFrame> down{{"arm", "hand"}, {"hand", "world"}};
  film.add("robot", upwards ? up : down, 1);
  film.set("robot", {fixed(0, 1), fixed(1, 10)}, 1);
  film.add("robot", upwards ? down : up, 5, other_process ? 2 : 1);
  film.set("robot", {fixed(0, 2), fixed(1, 20)}, 5.001);
  Recording recording = film.watched();
  CHECK(newest(recording, "arm", 4) == (upwards ? "1.000000" : "11.000000"));
  CHECK(newest(recording, "hand", 4) == (upwards ? "11.000000" : "10.000000"));
  CHECK(newest(recording, "arm", 9) == (upwards ? "22.000000" : "2.000000"));
  CHECK(newest(recording, "hand", 9) == (upwards ? "20.000000" : "22.000000"));
  CHECK(recording.parent("arm").value() == (upwards ? "hand" : "world"));
}

TEST_CASE("recording: frames of two owners change places, and the second one is recorded first") {
  Film film;
  film.add("A", {{"a", "b"}}, 1);
  film.set("A", {fixed(0, 10)}, 1);
  film.add("B", {{"b", "world"}}, 1);
  film.set("B", {fixed(0, 1)}, 1);
  for (int i = 0; i < 3; ++i) {
    // a below the root, then b below a.
    const double t = 3 + 4 * i;
    film.add("B", {{"b", "a"}}, t);
    film.set("B", {fixed(0, 2 + i)}, t + 0.01);
    film.add("A", {{"a", "world"}}, t + 0.1);
    film.set("A", {fixed(0, 20)}, t + 0.11);
    // b below the root, then a below b.
    film.add("A", {{"a", "b"}}, t + 2);
    film.set("A", {fixed(0, 30 + i)}, t + 2.01);
    film.add("B", {{"b", "world"}}, t + 2.1);
    film.set("B", {fixed(0, 3)}, t + 2.11);
  }
  Recording recording = film.watched();
  CHECK(then(recording, "a", 2) == "11.000000");
  for (int i = 0; i < 3; ++i) {
    CAPTURE(i);
    const double t = 3 + 4 * i;
    const std::string swapped = std::to_string(22.0 + i);
    const std::string again = std::to_string(33.0 + i);
    CHECK(newest(recording, "b", t + 0.05) == "not_connected");
    CHECK(newest(recording, "b", t + 1) == swapped);
    CHECK(then(recording, "b", t + 0.05) == swapped);
    CHECK(then(recording, "b", t + 1) == swapped);
    CHECK(then(recording, "a", t + 1) == "20.000000");
    CHECK(newest(recording, "a", t + 2.05) == "not_connected");
    CHECK(newest(recording, "a", t + 3) == again);
    CHECK(then(recording, "a", t + 2.05) == again);
    CHECK(then(recording, "a", t + 3) == again);
    CHECK(then(recording, "b", t + 3) == "3.000000");
  }
}

TEST_CASE(
    "recording: a frame that waits for another one to move is not looked up in a later place") {
  Film film;
  film.add("A", {{"a", "b"}}, 1);
  film.set("A", {fixed(0, 10)}, 1);
  film.add("B", {{"b", "world"}}, 1);
  film.set("B", {fixed(0, 1)}, 1);
  // What A did is not in the file.
  film.add("B", {{"b", "a"}}, 3);
  film.set("B", {fixed(0, 2)}, 3.01);
  film.add("B", {{"b", "world"}}, 5);
  film.set("B", {fixed(0, 3)}, 5.01);
  Recording recording = film.watched();
  for (const char* frame : {"a", "b"}) {
    CAPTURE(frame);
    CHECK(then(recording, frame, 4) == "not_connected");
  }
  CHECK(then(recording, "b", 6) == "3.000000");
  CHECK(then(recording, "a", 6) == "13.000000");
}

TEST_CASE("recording: a lookup reads on for samples, in the structure of its instant") {
  Film film;
  film.add("A", {{"hand", "world"}, {"head", "world"}}, 1);
  film.set("A", {fixed(0, 1), sample(1, 1, true)}, 1);
  film.set("A", {sample(1, 2)}, 2.01);
  film.set("A", {sample(1, 4)}, 4.01);
  // The hand is removed, and added elsewhere; the head is moved to a neck, and the eye is new.
  film.add("A", {{"head", "world"}}, 5);
  film.add("A", {{"head", "neck"}, {"neck", "world"}}, 7);
  film.set("A", {fixed(0, 100), fixed(1, 100)}, 7.01);
  film.add("A", {{"eye", "head"}, {"head", "neck"}, {"neck", "world"}}, 8);
  film.set("A", {fixed(0, 1000)}, 8.01);
  film.add("B", {{"hand", "world"}}, 8.5);
  film.set("B", {fixed(0, 500)}, 8.51);
  Recording recording = film.watched();
  CHECK(then(recording, "hand", 4) == "1.000000");
  CHECK(then(recording, "hand", 6) == "unknown_end");
  CHECK(then(recording, "hand", 8.4) == "unknown_end");
  CHECK(then(recording, "hand", 9) == "500.000000");
  CHECK(then(recording, "head", 3) == "2.000000");
  CHECK(then(recording, "head", 4.5) == "not_yet");
  CHECK(then(recording, "head", 7.5) == "200.000000");
  CHECK(then(recording, "eye", 7.5) == "unknown_end");
  CHECK(then(recording, "eye", 9) == "1200.000000");
  // Each of many instants as it is alone.
  const Trajectory all = recording.trajectory("world", "hand", {at(4), at(6), at(8.4), at(9)});
  CHECK(said(all, 0) == "1.000000");
  CHECK(said(all, 1) == "unknown_end");
  CHECK(said(all, 2) == "unknown_end");
  CHECK(said(all, 3) == "500.000000");
  const Trajectory heads = recording.trajectory("world", "head", {at(7.5), at(3), at(4.5)});
  CHECK(said(heads, 0) == "200.000000");
  CHECK(said(heads, 1) == "2.000000");
  CHECK(said(heads, 2) == "not_yet");
}

TEST_CASE("recording: the first frames of a partition were there since it was reachable") {
  Film film;
  film.reach("slow", 1.5);
  film.reach("later", 5);
  film.add("slow", {{"arm", "world"}}, 6);
  film.set("slow", {fixed(0, 1)}, 6.01);
  film.add("later", {{"leg", "world"}}, 7);
  film.set("later", {fixed(0, 2)}, 7.01);
  Recording recording = film.watched();
  // The recording had just begun to discover them.
  CHECK(then(recording, "arm", 1.01) == "1.000000");
  CHECK(then(recording, "arm", 4) == "1.000000");
  CHECK(then(recording, "leg", 1.01) == "unknown_end");
  CHECK(then(recording, "leg", 4.9) == "unknown_end");
  CHECK(then(recording, "leg", 5.1) == "2.000000");
  const Trajectory all = recording.trajectory("world", "leg", {at(4.9), at(5.1), at(8)});
  CHECK(said(all, 0) == "unknown_end");
  CHECK(said(all, 1) == "2.000000");
  CHECK(said(all, 2) == "2.000000");
}
