// Damage of the log behind which changes are lost is told from what crashes leave.

#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "store/sqlite_store.hpp"
#include "support/catch.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::Random;
using testing::TemporaryDirectory;

constexpr int kChanges = 12;
constexpr std::size_t kHeader = 32;
constexpr std::size_t kFrame = 24 + 4096;

std::string content(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write(const std::string& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

// What a process has left that was killed after so many changes, each of which adds a frame.
struct Killed {
  explicit Killed(int changes = kChanges) {
    const std::string running = directory.path() + "/running.sqlite";
    const auto store = open_sqlite_store(running, "arms").value();
    for (int i = 0; i < changes; ++i) {
      const std::string id = "f" + std::to_string(i);
      REQUIRE(store->save({1, {id}, {{id, "", {}, 1}}, {}}));
    }
    whole = content(running);
    log = content(running + "-wal");
    REQUIRE(log.size() % kFrame == kHeader);
    put(log);
  }

  void put(const std::string& bytes) const {
    write(file, whole);
    write(file + "-wal", bytes);
  }

  // How many frames are loaded; -1: none, and why says it.
  int loaded(std::string& why) const {
    const auto store = open_sqlite_store(file, "arms");
    const auto state = store ? (*store)->load() : tl::unexpected(store.error());
    if (!state) why = state.error().message;
    return state ? static_cast<int>(state->frames.size()) : -1;
  }

  TemporaryDirectory directory;
  std::string file = directory.path() + "/arms.sqlite";
  std::string whole;
  std::string log;
};

std::string flipped(std::string bytes, std::size_t at, unsigned bit = 0) {
  bytes[at] = static_cast<char>(bytes[at] ^ static_cast<char>(1U << bit));
  return bytes;
}

// Once, all changes behind such a byte were lost without a word.
TEST_CASE("log: whatever byte of a log changes, no change behind it is lost silently") {
  Random random(0x106);
  INFO("seed " << random.seed());
  const Killed killed;
  std::string why;
  REQUIRE(killed.loaded(why) == kChanges);
  int rejected = 0;
  for (int i = 0; i < 200; ++i) {
    const std::size_t at = random.index(killed.log.size());
    CAPTURE(at);
    killed.put(flipped(killed.log, at, static_cast<unsigned>(random.index(8))));
    const int frames = killed.loaded(why);
    // The last frame of all may be one that was never whole: then the last change is left out.
    const bool last = at >= killed.log.size() - kFrame;
    CHECK((frames == -1 || frames == kChanges || (last && frames == kChanges - 1)));
    if (frames == -1) ++rejected;
  }
  CHECK(rejected > 150);
}

TEST_CASE("log: damage is named, and what is behind it left out if that is wished") {
  const Killed killed;
  std::string why;
  const bool of_header = GENERATE(false, true);
  const std::string bad =
      flipped(killed.log, of_header ? 25 : killed.log.size() / 2 / kFrame * kFrame);
  killed.put(bad);
  CHECK(killed.loaded(why) == -1);
  CHECK_THAT(why, ContainsSubstring("state file '" + killed.file + "' is damaged (a checksum"));
  CHECK_THAT(why, ContainsSubstring("-wal', and "));
  CHECK_THAT(why, ContainsSubstring("tfduded --drop-damaged"));
  CHECK(content(killed.file) == killed.whole);
  CHECK(content(killed.file + "-wal") == bad);
  const auto dropped = drop_wrong_rows(killed.file, "arms").value();
  REQUIRE(dropped.size() == 1);
  CHECK_THAT(dropped[0], ContainsSubstring(of_header ? "the header of '" : " or more changes"));
  const int frames = killed.loaded(why);
  CHECK(frames >= 0);
  CHECK((frames == 0) == of_header);
  CHECK(frames < kChanges);
  CHECK(drop_wrong_rows(killed.file, "arms").value().empty());
}

TEST_CASE("log: what a crash leaves is no damage") {
  const Killed killed;
  std::string why;
  SECTION("an incomplete last frame") {
    for (const std::size_t missing : {std::size_t{1}, kFrame - 1, kFrame}) {
      killed.put(killed.log.substr(0, killed.log.size() - missing));
      CHECK(killed.loaded(why) == kChanges - 1);
    }
  }
  SECTION("a header alone, or a part of it") {
    for (const std::size_t left : {std::size_t{0}, std::size_t{20}, kHeader}) {
      killed.put(flipped(killed.log, 3).substr(0, left));
      CHECK(killed.loaded(why) == 0);
    }
  }
  SECTION("frames of a change that was not committed, behind the last one") {
    std::string again = killed.log.substr(killed.log.size() - 3 * kFrame);
    for (std::size_t at = 0; at < again.size(); at += kFrame) again.replace(at + 4, 4, 4, '\0');
    killed.put(killed.log + again);
    CHECK(killed.loaded(why) == kChanges);
  }
  SECTION("missing blocks, after the computer has stopped") {
    killed.put(flipped(killed.log, killed.log.size() / 2));
    std::filesystem::last_write_time(killed.file + "-wal", std::filesystem::file_time_type() -
                                                               std::chrono::hours(24 * 365 * 200));
    CHECK(killed.loaded(why) >= 0);
    CHECK(killed.loaded(why) < kChanges);
  }
}

TEST_CASE("log: frames from before it was begun again are no damage") {
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/arms.sqlite";
  std::string why;
  const auto store = open_sqlite_store(file, "arms").value();
  // The log is begun again beyond 1000 pages.
  std::string log;
  for (int i = 0; i < 500; ++i) {
    const std::string id = "f" + std::to_string(i);
    REQUIRE(store->save({1, {id}, {{id, "", {}, 1}}, {}}));
    if (i % 50 != 0) continue;
    const std::string copy = directory.path() + "/copy.sqlite";
    write(copy, content(file));
    write(copy + "-wal", content(file + "-wal"));
    const auto copied = open_sqlite_store(copy, "arms");
    CHECK(copied.value()->load().value().frames.size() == static_cast<std::size_t>(i + 1));
  }
}

}  // namespace
}  // namespace tfdude
