// Changed bytes of a state file are noticed, and named.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sqlite3.h>
#include <sstream>
#include <string>
#include <vector>

#include "math/flat.hpp"
#include "store/sqlite_store.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::ContainsSubstring;
using testing::outcome;
using testing::Random;
using testing::TemporaryDirectory;
using TestRows = std::vector<std::string>;

constexpr Time kStamp{std::chrono::nanoseconds(1'795'000'000'123'456'789)};

void run(const std::string& file, const std::string& sql) {
  sqlite3* raw = nullptr;
  REQUIRE(sqlite3_open(file.c_str(), &raw) == SQLITE_OK);
  INFO(sql);
  REQUIRE(sqlite3_exec(raw, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(raw);
}

std::string content(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

// "ok", or why it cannot be loaded.
std::string loaded(const std::string& file) {
  const auto store = open_sqlite_store(file, "arms");
  if (!store) return store.error().message;
  const auto state = (*store)->load();
  return state ? "ok" : state.error().message;
}

// All that is stored, as text.
std::string text_of(const StoredState& state) {
  std::ostringstream text;
  text << std::hexfloat << state.epoch << '\n';
  const auto transform = [&](const Transform& X) {
    for (const double number : to_flat(X)) text << ' ' << number;
    text << ' ' << X.covariance.complete();
  };
  const auto correlation = [&](const Correlation& one) {
    text << one.unknown << one.common_errors.size() << one.observed_with.size();
    for (const CommonError& error : one.common_errors) text << error.source << error.loading;
  };
  for (const StoredFrame& frame : state.frames) {
    text << frame.id << ' ' << frame.parent << ' ' << frame.lamport_time << ' '
         << (frame.time.stamp ? nanoseconds(*frame.time.stamp) : -1) << frame.time.cleared;
    transform(frame.X_PC);
    correlation(frame.correlation.said);
    text << '\n';
  }
  for (const Tombstone& one : state.tombstones) {
    text << one.id << ' ' << one.lamport_time << ' ' << static_cast<int>(one.kind) << one.rival
         << '\n';
  }
  for (const FrameSpec& one : state.configured) {
    text << one.id << ' ' << one.parent;
    transform(one.X_PC);
    correlation(one.correlation);
    text << '\n';
  }
  for (const auto& [id, joint] : state.configured_joints) {
    text << id << ' ' << joint.name << ' ' << joint.follows << '\n';
  }
  for (const StoredJoint& one : state.joints) {
    text << one.name << ' ' << one.position << ' ' << one.variance.value_or(-1)
         << static_cast<int>(one.type.value_or(JointType())) << '\n';
  }
  for (const Absent& one : state.absent) {
    text << one.partition << ' ' << one.since << static_cast<int>(one.kind) << one.incarnation
         << '\n';
  }
  return text.str();
}

struct Saved {
  Saved() {
    StateChange change{7, {}, {}, {}};
    change.frames = {{"arm", "", along_x(1), 1},
                     {"hand", "arm", along_x(1.5), 2, {}, {kStamp, false}},
                     {"tool", "hand", along_x(3), 3, {{true, {}, {"arm"}}, {}}, {}}};
    change.tombstones = {{"lamp", 6, Tombstone::Kind::kRemoved, ""}};
    change.joints = {{"elbow", 0.5, 1e-4, JointType::kPrismatic}};
    change.absent = {{"legs", 5, Absent::Kind::kLost, 7}};
    change.configured = {{"arm", "", along_x(1), {}, {true, {}, {}}},
                         {"hand", "arm", along_x(1)},
                         testing::moved_by("tool", "hand", testing::revolute_named("wrist"))};
    REQUIRE(outcome(open_sqlite_store(file, "arms").value()->save(change)) == "ok");
  }
  TemporaryDirectory directory;
  std::string file = state_file(directory.path(), 7, "arms");
};

}  // namespace

TEST_CASE("a changed value is named, and left out if that is wished") {
  const auto [sql, row, frames] = GENERATE(table<std::string, std::string, std::size_t>({
      {"UPDATE frames SET parent = '' WHERE id = 'tool'", "frames 'tool'", 2},
      {"UPDATE frames SET since = 9 WHERE id = 'hand'", "frames 'hand'", 2},
      {"UPDATE frames SET id = 'hanf' WHERE id = 'hand'", "frames 'hand'", 2},
      {"DELETE FROM notes", "notes 'lamp'", 3},
      {"UPDATE notes SET since = 7", "notes 'lamp'", 3},
      {"UPDATE configured SET parent = 'tool' WHERE id = 'hand'", "configured 'hand'", 3},
      {"UPDATE joints SET position = 0.25", "joints 'elbow'", 3},
      {"UPDATE joint_types SET type = 1", "joint_types 'elbow'", 3},
      {"UPDATE ties SET observed = x''", "", 3},  // as it was
      {"UPDATE configured_joints SET name = 'elbow'", "configured_joints 'tool'", 3},
      {"UPDATE absent SET since = 6", "absent 'legs'", 3},
      {"UPDATE samples SET stamp = stamp + 1", "samples 'hand'", 3},
      {"UPDATE sums SET sum = sum + 1 WHERE name = 'frames/arm'", "frames 'arm'", 2},
  }));
  const Saved saved;
  run(saved.file, sql);
  CAPTURE(sql);
  if (row.empty()) {
    CHECK(loaded(saved.file) == "ok");
    return;
  }
  const std::string before = content(saved.file);
  const std::string why = loaded(saved.file);
  if (sql.find("'hanf'") == std::string::npos) {
    CHECK_THAT(why, ContainsSubstring("the checksum of these rows is wrong: " + row));
    CHECK_THAT(why, ContainsSubstring("--drop-damaged"));
  } else {
    CHECK(why != "ok");  // what belongs to the frame of that name is found first
  }
  CHECK(content(saved.file) == before);
  const auto dropped = drop_wrong_rows(saved.file, "arms");
  REQUIRE(dropped);
  if (sql.find("'hanf'") == std::string::npos) CHECK(*dropped == TestRows{row});
  const auto store = open_sqlite_store(saved.file, "arms");
  REQUIRE(store);
  const auto state = (*store)->load();
  REQUIRE(state);
  CHECK(state->frames.size() == frames);
}

TEST_CASE("of a damaged entry of the configuration the id stays") {
  const auto [sql, unknown] = GENERATE(table<std::string, std::set<std::string>>({
      {"UPDATE configured SET parent = 'tool' WHERE id = 'hand'", {"hand"}},
      {"DELETE FROM configured WHERE id = 'arm'", {"arm"}},
      {"UPDATE configured_joints SET follows = 'elbow'", {"tool"}},
      {"UPDATE configured_ties SET said = said || x'00'", {"arm"}},
      {"UPDATE frames SET since = 9 WHERE id = 'hand'", {}},
  }));
  const Saved saved;
  run(saved.file, sql);
  CAPTURE(sql);
  REQUIRE(drop_wrong_rows(saved.file, "arms"));
  const auto state = open_sqlite_store(saved.file, "arms").value()->load();
  INFO((state ? "" : state.error().message));
  REQUIRE(state);
  CHECK(state->unknown_entries == unknown);
  CHECK(state->configured.size() == 3 - unknown.size());
  CHECK(state->configured_joints.size() == 1 - unknown.count("tool"));
  // Until a configuration is saved.
  StateChange next;
  next.configured = {{"arm", "", along_x(1)}};
  REQUIRE(outcome(open_sqlite_store(saved.file, "arms").value()->save(next)) == "ok");
  const auto later = open_sqlite_store(saved.file, "arms").value()->load();
  REQUIRE(later);
  CHECK(later->unknown_entries.empty());
  CHECK(later->configured.size() == 1);
}

TEST_CASE("an edge whose correlation was damaged keeps its pose and claims no covariance") {
  const Saved saved;
  const auto tool = [&] {
    const auto state = open_sqlite_store(saved.file, "arms").value()->load();
    REQUIRE(state);
    return state->frames.at(2);
  };
  CHECK(tool().X_PC.covariance.complete());
  run(saved.file, "UPDATE ties SET said = said || x'00'");
  REQUIRE(drop_wrong_rows(saved.file, "arms"));
  CHECK(tool().X_PC.pose.translation() == along_x(3).pose.translation());
  CHECK_FALSE(tool().X_PC.covariance.complete());
  CHECK(tool().correlation.empty());
}

TEST_CASE("whose state it is cannot be left out") {
  const Saved saved;
  run(saved.file, "UPDATE about SET epoch = 8");
  CHECK_THAT(loaded(saved.file), ContainsSubstring("about 'arms'"));
  const auto dropped = drop_wrong_rows(saved.file, "arms");
  REQUIRE_FALSE(dropped);
  CHECK_THAT(dropped.error().message, ContainsSubstring("about 'arms' cannot be left out"));
}

// Once, one of ten changed bytes was served without a word.
TEST_CASE("whatever byte of a state file changes, nothing else is served") {
  Random random(0x5a5a);
  INFO("seed " << random.seed());
  const Saved saved;
  const std::string whole = content(saved.file);
  const std::string state = text_of(*open_sqlite_store(saved.file, "arms").value()->load());
  std::size_t refused = 0;
  for (int i = 0; i < 400; ++i) {
    std::string changed = whole;
    // Half of them where data is.
    std::size_t at = random.index(changed.size());
    while (i % 2 == 0 && changed[at] == 0) at = random.index(changed.size());
    changed[at] = static_cast<char>(changed[at] ^ (1 << random.index(8)));
    const std::string file = saved.directory.path() + "/copy.sqlite";
    std::ofstream(file, std::ios::binary) << changed;
    std::filesystem::remove(file + "-wal");
    const auto store = open_sqlite_store(file, "arms");
    const auto read = store ? (*store)->load() : tl::unexpected(store.error());
    CAPTURE(at);
    if (read) CHECK(text_of(*read) == state);
    if (!read) ++refused;
  }
  CHECK(refused > 50);
}

TEST_CASE("a file of a format without checksums gets them with its first change") {
  const Saved saved;
  run(saved.file, "DROP TABLE sums; DROP TABLE configured_joints; PRAGMA user_version = 5");
  CHECK(loaded(saved.file) == "ok");
  REQUIRE(outcome(open_sqlite_store(saved.file, "arms").value()->save({8, {}, {}, {}})) == "ok");
  run(saved.file, "UPDATE frames SET since = 9 WHERE id = 'hand'");
  CHECK_THAT(loaded(saved.file), ContainsSubstring("frames 'hand'"));
}

TEST_CASE("a file of a format without the joints of entries has none that are known") {
  const Saved saved;
  const auto known = [&] {
    return open_sqlite_store(saved.file, "arms").value()->load().value().configured_joints;
  };
  using Known = std::map<std::string, PageJoint>;
  CHECK(known() == Known{{"tool", {"wrist", ""}}});
  run(saved.file,
      "DELETE FROM sums WHERE name = 'configured_joints/tool'; "
      "DROP TABLE configured_joints; PRAGMA user_version = 6");
  const Known unknown{{"arm", {}}, {"hand", {}}, {"tool", {}}};
  CHECK(known() == unknown);
  SECTION("also once the file was updated without a configuration") {
    REQUIRE(outcome(open_sqlite_store(saved.file, "arms").value()->save({8, {}, {}, {}})) == "ok");
    CHECK(known() == unknown);
  }
  SECTION("and its rows have checksums as before") {
    run(saved.file, "UPDATE frames SET since = 9 WHERE id = 'hand'");
    CHECK_THAT(loaded(saved.file), ContainsSubstring("frames 'hand'"));
  }
}

TEST_CASE("a damaged row of a format without the joints of entries stays damaged") {
  const Saved saved;
  run(saved.file,
      "UPDATE about SET epoch = 8; DELETE FROM sums WHERE name = 'configured_joints/tool'; "
      "DROP TABLE configured_joints; PRAGMA user_version = 6");
  for (int start = 0; start < 2; ++start) {
    CHECK_FALSE(drop_wrong_rows(saved.file, "arms"));
    CHECK_THAT(loaded(saved.file), ContainsSubstring("about 'arms'"));
  }
}

}  // namespace tfdude
