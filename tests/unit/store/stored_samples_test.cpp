// When stored values were measured.

#include <sqlite3.h>
#include <string>

#include "store/schema.hpp"
#include "store/sqlite_store.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::ContainsSubstring;
using testing::outcome;
using testing::TemporaryDirectory;

constexpr Time kStamp{std::chrono::nanoseconds(1'795'000'000'123'456'789)};

void run(const std::string& file, const std::string& sql) {
  sqlite3* raw = nullptr;
  REQUIRE(sqlite3_open(file.c_str(), &raw) == SQLITE_OK);
  REQUIRE(sqlite3_exec(raw, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(raw);
}

std::string loaded(const std::string& file) {
  const auto store = open_sqlite_store(file, "arms");
  REQUIRE(store);
  const auto state = (*store)->load();
  return state ? "ok" : state.error().message;
}

struct Saved {
  Saved() {
    const auto store = open_sqlite_store(file, "arms");
    REQUIRE(store);
    StateChange change;
    change.frames = {{"arm", "", along_x(1), 1},
                     {"hand", "arm", along_x(2), 2, {}, {kStamp, false}},
                     {"tool", "hand", along_x(3), 3, {}, {std::nullopt, true}}};
    REQUIRE((*store)->save(change));
  }
  [[nodiscard]] StoredTime time_of(std::size_t frame) const {
    const auto store = open_sqlite_store(file, "arms");
    REQUIRE(store);
    return (*store)->load().value().frames.at(frame).time;
  }

  TemporaryDirectory directory;
  std::string file = state_file(directory.path(), 7, "arms");
};

}  // namespace

TEST_CASE("a stored value is a sample, is cleared, or neither") {
  const Saved saved;
  CHECK_FALSE(saved.time_of(0).stamp);
  CHECK_FALSE(saved.time_of(0).cleared);
  CHECK(saved.time_of(1).stamp == kStamp);
  CHECK_FALSE(saved.time_of(2).stamp);
  CHECK(saved.time_of(2).cleared);
  {
    const auto store = open_sqlite_store(saved.file, "arms");
    REQUIRE(store);
    StateChange change;
    change.values = {{"arm", along_x(1), {}, {Time{}, false}},
                     {"hand", along_x(2), {}, {}},
                     {"nobody", along_x(2), {}, {kStamp, false}}};
    change.erased = {"tool"};
    change.frames = {{"tool", "hand", along_x(3), 3}};
    REQUIRE((*store)->save(change));
  }
  CHECK(saved.time_of(0).stamp == Time{});
  CHECK_FALSE(saved.time_of(1).stamp);
  CHECK_FALSE(saved.time_of(2).cleared);
}

TEST_CASE("stamps that cannot be, or are of no frame, make a state invalid") {
  const Saved saved;
  SECTION("negative") {
    run(saved.file, "UPDATE samples SET stamp = -2 WHERE id = 'hand'");
    CHECK_THAT(loaded(saved.file), ContainsSubstring("frame 'hand': a stamp of -2 ns"));
  }
  SECTION("of no frame") {
    run(saved.file, "INSERT INTO samples VALUES('nobody', 1)");
    CHECK_THAT(loaded(saved.file), ContainsSubstring("a sample of 'nobody', which does not exist"));
  }
}

TEST_CASE("a state of format 4 has no stamps, and gets them with the next change") {
  const Saved saved;
  run(saved.file,
      "DROP TABLE sums; DROP TABLE configured_joints; DROP TABLE samples; PRAGMA user_version = 4");
  CHECK(loaded(saved.file) == "ok");
  CHECK_FALSE(saved.time_of(1).stamp);
  {
    const auto store = open_sqlite_store(saved.file, "arms");
    REQUIRE(store);
    StateChange change;
    change.values = {{"hand", along_x(2), {}, {kStamp, false}}};
    REQUIRE((*store)->save(change));
  }
  CHECK(saved.time_of(1).stamp == kStamp);
}

}  // namespace tfdude
