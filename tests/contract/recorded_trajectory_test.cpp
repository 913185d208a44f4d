// A recording asked at many instants, beside the same recording asked at each of them.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <unistd.h>
#include <vector>

#include "tfdude/recording/recording.hpp"
#include "tfdude/recording/recording_writer.hpp"

#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::Random;
using testing::transform_diff;

Time instant(int ms) { return Time(std::chrono::seconds(1000)) + Milliseconds(ms); }

// Writes what a recorder would hear: no process is needed for that.
class Writer {
 public:
  explicit Writer(Random& random) : random_(random) {
    for (const char* name : {"base", "arm"}) {
      add({name, ReachNews{true, {}}}, 0);
      tell_frames(name, 0);
    }
    for (const auto& [name, frames] : frames_) {
      ValuesNews news{1, {}};
      for (std::uint32_t i = 0; i < frames.size(); ++i) {
        if (!frames[i].parent.empty()) news.values.push_back(value(i, std::nullopt));
        if (!frames[i].parent.empty()) news.values.back().begins = Covariance();
      }
      add({name, std::move(news)}, 1);
    }
  }

  void add(PartitionNews news, int ms) { REQUIRE(writer_.add(news, instant(ms))); }
  void tell_frames(const std::string& name, int ms) {
    add({name, FramesNews{frames_[name], 1}}, ms);
  }
  // A value of a frame, which was stamped some time ago.
  void tell(const std::string& name, std::uint32_t frame, std::optional<int> stamp, int ms,
            bool begins = false) {
    WatchedValue one = value(frame, stamp ? std::optional(instant(*stamp)) : std::nullopt);
    if (begins) one.begins = Covariance();
    add({name, ValuesNews{++commit_, {one}}}, ms);
  }
  // Moves a frame of the arm to another parent.
  void move(const std::string& parent, int ms) {
    frames_["arm"][1].parent = parent;
    tell_frames("arm", ms);
    tell("arm", 1, std::nullopt, ms, true);
  }
  std::string finish() {
    REQUIRE(writer_.finish(instant(90'000)));
    return file_;
  }

 private:
  [[nodiscard]] WatchedValue value(std::uint32_t frame, std::optional<Time> stamp) {
    return {frame, stamp, random_.transform()};
  }

  Random& random_;
  std::map<std::string, std::vector<WatchedFrame>> frames_ = {
      {"arm", {{"arm", "mast"}, {"hand", "arm"}}},
      {"base", {{"base", "world"}, {"mast", "base"}, {"world", ""}}}};
  std::uint64_t commit_ = 1;
  const std::string file_ = (std::filesystem::temp_directory_path() /
                             ("tfdude-trajectory-" + std::to_string(getpid()) + "-" +
                              std::to_string(random_.index(1U << 30U)) + ".mcap"))
                                .string();
  RecordingWriter writer_ = RecordingWriter::create(file_, instant(0)).value();
};

// All instants at once, and one after the other.
void check_each(const std::string& file, const std::vector<Time>& instants, Milliseconds wait) {
  auto recording = Recording::open(file);
  auto single = Recording::open(file);
  REQUIRE((recording && single));
  const Trajectory all = recording->trajectory("world", "hand", instants, {}, wait);
  for (std::size_t i = 0; i < instants.size(); ++i) {
    INFO("wait " << wait.count() << ", instant " << (instants[i] - instant(0)).count());
    const auto one = single->lookup_at("world", "hand", instants[i], {}, wait);
    REQUIRE(all.X_AB[i].has_value() == one.has_value());
    if (one) {
      CHECK(transform_diff(*all.X_AB[i], *one, 1e-12) == "");
      continue;
    }
    const auto of_it =
        std::find_if(all.missing.begin(), all.missing.end(), [&](const MissingInstants& missing) {
          return i >= missing.first && i < missing.first + missing.count;
        });
    REQUIRE(of_it != all.missing.end());
    CHECK(of_it->error.code == one.error().code);
  }
}

}  // namespace

TEST_CASE("recorded trajectory: each instant as lookup_at() answers it") {
  Random random(4613);
  INFO("seed " << random.seed());
  for (int run = 0; run < 4; ++run) {
    Writer writer(random);
    int ms = 10;
    int base = 0;
    int hand = 0;
    const bool only_samples = run == 0;
    while (ms < 4000) {
      ms += 1 + static_cast<int>(random.index(20));
      switch (random.index(only_samples ? 2 : 16)) {
        case 2:  // a static edge gets another value
          writer.tell("base", 1, std::nullopt, ms);
          break;
        case 3:
          writer.move(random.index(2) == 0 ? "arm" : "mast", ms);
          break;
        case 4:  // a late sample
          if (base > 200) {
            writer.tell("base", 0, base - 1 - static_cast<int>(random.index(100)), ms);
          }
          break;
        default:
          if (random.index(2) == 0) {
            base = std::max(base + 1, ms - static_cast<int>(random.index(30)));
            writer.tell("base", 0, base, ms);
          } else {
            hand = std::max(hand + 1, ms - static_cast<int>(random.index(60)));
            writer.tell("arm", 1, hand, ms);
          }
      }
    }
    const std::string file = writer.finish();
    std::vector<Time> instants;
    for (int i = 0; i < 120; ++i) instants.push_back(instant(static_cast<int>(random.index(4500))));
    INFO("run " << run);
    check_each(file, instants, Milliseconds(10'000));
    auto recording = Recording::open(file);
    REQUIRE(recording);
    CHECK(recording->trajectory("world", "nowhere", {instant(5)}).missing.size() == 1);
    std::filesystem::remove(file);
  }
}

TEST_CASE("recorded trajectory: what comes after the wait is no answer to what was asked before") {
  Random random(7120);
  INFO("seed " << random.seed());
  Writer writer(random);
  // The hand pauses from 1 to 2 s, while the base goes on; then both pause until 4 s.
  for (int ms = 10; ms < 2000; ms += 10) {
    writer.tell("base", 0, ms, ms + 2);
    if (ms <= 1000) writer.tell("arm", 1, ms, ms + 5);
  }
  writer.tell("arm", 1, 2000, 2005);
  writer.tell("base", 0, 4000, 4001);
  writer.tell("arm", 1, 4000, 4002);
  const std::string file = writer.finish();
  std::vector<Time> instants;
  for (int i = 0; i < 60; ++i) instants.push_back(instant(static_cast<int>(random.index(4500))));
  for (const int wait : {0, 7, 300, 1500, 10'000}) check_each(file, instants, Milliseconds(wait));
  std::filesystem::remove(file);
}

TEST_CASE("recorded trajectory: places of the file that nobody asks for are skipped") {
  Random random(3341);
  INFO("seed " << random.seed());
  Writer writer(random);
  // Some 40 MB in 80 s, and so several places where everything is known.
  for (int ms = 2; ms < 80'000; ++ms) {
    writer.tell("base", 0, ms, ms + 1);
    if (ms % 20 == 0) writer.tell("arm", 1, ms - 10, ms + 1);
    if (ms % 30'000 == 0) writer.move("mast", ms + 2);
  }
  const std::string file = writer.finish();
  std::vector<Time> instants;
  for (int i = 0; i < 12; ++i) instants.push_back(instant(static_cast<int>(random.index(80'000))));
  check_each(file, instants, Milliseconds(10'000));
  std::sort(instants.begin(), instants.end());
  check_each(file, instants, Milliseconds(0));
  // In any order, as a recording that was just opened.
  auto recording = Recording::open(file);
  REQUIRE(recording);
  for (int i = 0; i < 12; ++i) {
    const Time at = instants[random.index(instants.size())];
    INFO("instant " << (at - instant(0)).count());
    const auto X = recording->lookup_at("world", "hand", at);
    const auto fresh = Recording::open(file).value().lookup_at("world", "hand", at);
    REQUIRE(X.has_value() == fresh.has_value());
    if (X) CHECK(transform_diff(*X, *fresh, 1e-12) == "");
    CHECK(recording->instant() >= at);
  }
  // A chunk that is damaged is left out, and named.
  {
    std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(static_cast<std::streamoff>(std::filesystem::file_size(file) / 2));
    bytes.write("damaged", 7);
  }
  instants.clear();
  for (int ms = 500; ms < 80'000; ms += 2000) instants.push_back(instant(ms));
  check_each(file, instants, Milliseconds(100));
  auto damaged = Recording::open(file);
  REQUIRE(damaged);
  CHECK(damaged->summary().problems.empty());
  (void)damaged->trajectory("world", "hand", instants);
  CHECK(damaged->summary().problems.size() == 1);
  std::filesystem::remove(file);
}

}  // namespace tfdude
