#include "store/sqlite_store.hpp"

#include <array>
#include <filesystem>
#include <fstream>
#include <sqlite3.h>
#include <string>
#include <sys/fsuid.h>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

#include "math/flat.hpp"
#include "partition/incarnation.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "support/random.hpp"
#include "support/small_disk.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::outcome;
using testing::Random;
using testing::TemporaryDirectory;

std::unique_ptr<StateStore> opened(const std::string& file, const std::string& partition = "arms") {
  auto store = open_sqlite_store(file, partition);
  INFO((store ? "" : store.error().message));
  REQUIRE(store);
  return *std::move(store);
}

// "code: message" of what keeps a file from being opened.
std::string refused(const std::string& file, const std::string& partition = "arms") {
  const auto store = open_sqlite_store(file, partition);
  if (!store) return std::string(to_string(store.error().code)) + ": " + store.error().message;
  const auto state = (*store)->load();
  return state ? "ok" : std::string(to_string(state.error().code)) + ": " + state.error().message;
}

// Calls as a user without root's rights, on this thread.
template <class Call>
std::string as_nobody(Call call) {
  constexpr uid_t kNobody = 65534;
  const auto me = static_cast<uid_t>(setfsuid(getuid() == 0 ? kNobody : getuid()));
  std::string result = call();
  setfsuid(me);
  return result;
}

void put(const std::string& file, std::streamoff at, const std::string& bytes) {
  std::fstream out(file, std::ios::in | std::ios::out | std::ios::binary);
  out.seekp(at);
  out << bytes;
}

std::string content(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_CASE("a saved state is restored to the last bit by the next process") {
  Random random(0x57a7e);
  INFO("seed " << random.seed());
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  const StoredFrame hand{"hand", "arm", random.transform(), 5};
  const StoredFrame tool{"tool \xc3\xa4'\"", "", random.transform(), 1ULL << 62U};
  const Tombstone gone{"lamp", 6, Tombstone::Kind::kRemoved, ""};
  const Tombstone lost{"eye", 4, Tombstone::Kind::kYielded, "head"};
  const Transform later = random.transform();
  {
    const auto store = opened(file);
    CHECK(store->load()->frames.empty());
    CHECK(outcome(store->save({3, {"hand", "lamp"}, {hand}, {gone}})) == "ok");
    CHECK(outcome(store->save({4, {tool.id, "eye"}, {tool}, {lost}, {{"wrist", 1, 1}}})) == "ok");
    CHECK(outcome(store->save({4,
                               {},
                               {},
                               {},
                               {{"elbow", 0.5, 1e-4, JointType::kPrismatic}, {"wrist", 3}},
                               {},
                               {{"hand", later}, {"nobody", later}},
                               {},
                               {{{"hand", "arm", hand.X_PC}}}})) == "ok");
  }
  const auto state = opened(file)->load();
  REQUIRE(state);
  CHECK(state->epoch == 4);
  REQUIRE(state->frames.size() == 2);
  CHECK(state->frames[0].id == "hand");
  CHECK(state->frames[0].parent == "arm");
  CHECK(state->frames[0].lamport_time == 5);
  CHECK(to_flat(state->frames[0].X_PC) == to_flat(later));
  CHECK(state->frames[1].id == tool.id);
  CHECK(state->frames[1].lamport_time == tool.lamport_time);
  // The oldest first.
  CHECK(state->tombstones == std::vector<Tombstone>{lost, gone});
  REQUIRE(state->joints.size() == 2);
  CHECK(state->joints[0].name == "elbow");
  CHECK(state->joints[0].position == 0.5);
  CHECK(state->joints[0].variance == 1e-4);
  CHECK(state->joints[0].type == JointType::kPrismatic);
  CHECK(state->joints[1].position == 3);
  CHECK_FALSE(state->joints[1].type);
  CHECK_FALSE(state->joints[1].variance);
  REQUIRE(state->configured.size() == 1);
  CHECK(to_flat(state->configured[0].X_PC) == to_flat(hand.X_PC));
}

TEST_CASE("an unspecified covariance is restored and differs from zero") {
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  const Transform zero{Pose(), Covariance()};
  const Transform nothing{Pose(), StatedCovariance::unspecified()};
  {
    const auto store = opened(file);
    CHECK(outcome(store->save({1, {}, {{"a", "", zero, 1}, {"b", "", nothing, 2}}, {}})) == "ok");
    StateChange change{2, {}, {{"c", "", zero, 3}}, {}};
    change.values = {{"c", nothing}};
    change.configured = std::vector<FrameSpec>{{"a", "", zero}, {"b", "", nothing}};
    CHECK(outcome(store->save(change)) == "ok");
  }
  const auto state = opened(file)->load();
  REQUIRE(state);
  REQUIRE(state->frames.size() == 3);
  CHECK(state->frames[0].X_PC.covariance == StatedCovariance::exact());
  CHECK(state->frames[1].X_PC.covariance == StatedCovariance::unspecified());
  CHECK(state->frames[2].X_PC.covariance == StatedCovariance::unspecified());
  REQUIRE(state->configured.size() == 2);
  CHECK(state->configured[0].X_PC.covariance == StatedCovariance::exact());
  CHECK(state->configured[1].X_PC.covariance == StatedCovariance::unspecified());
}

TEST_CASE("the last saved list of absences is restored") {
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  const Absent lost{"head", -5, Absent::Kind::kLost, 7};
  const Absent stopped{"base", 1'800'000'000'000'000'000, Absent::Kind::kStopped, 1};
  // An incarnation that no process can have is stored, and the file stays readable.
  const Absent most{"far", 0, Absent::Kind::kForgotten, ~0ULL};
  {
    const auto store = opened(file);
    REQUIRE(store->save({1, {}, {}, {}, {}, {{lost, stopped}}}));
    REQUIRE(store->save({2, {"hand"}, {{"hand", "", {}, 1}}, {}}));
  }
  {
    const auto store = opened(file);
    CHECK(store->load()->absent == std::vector<Absent>{stopped, lost});
    REQUIRE(store->save({3, {}, {}, {}, {}, {{most}}}));
  }
  const auto state = opened(file)->load();
  REQUIRE(state);
  REQUIRE(state->absent.size() == 1);
  CHECK(state->absent[0].partition == "far");
  CHECK(state->absent[0].kind == Absent::Kind::kForgotten);
  CHECK(state->absent[0].incarnation >= IncarnationSource::kEnd);
}

TEST_CASE("correlations are stored and removed with the values of their edges") {
  Random random(0x57a7f);
  INFO("seed " << random.seed());
  const Correlation supply{true, {{"supply", false, Loading::Ones(6, 2)}}, {}};
  const Correlation seen{false, {{"observed:1", true, Loading::Ones(6, 36)}}, {"arm", "tool"}};
  const Transform X = random.transform();
  const TemporaryDirectory directory;
  // As large as can be.
  Correlation most{false, {}, std::vector<std::string>(kMaxCommonErrors, std::string(255, 'o'))};
  for (std::size_t i = 0; i < kMaxCommonErrors; ++i) {
    most.common_errors.push_back(
        {std::string(250, 's') + std::to_string(i), false, Loading::Ones(6, kMaxLoadingColumns)});
  }
  const std::string file = state_file(directory.path(), 7, "arms");
  {
    const auto store = opened(file);
    REQUIRE(store->save({1,
                         {},
                         {{"a", "", X, 1, {supply, {}}},
                          {"b", "", X, 1, {{}, seen}},
                          {"c", "", X, 1, {most, most}},
                          {"d", "", X, 1, {supply, seen}}},
                         {}}));
    REQUIRE(store->save({1,
                         {},
                         {},
                         {},
                         {},
                         {},
                         {{"a", X, {supply, seen}}, {"d", X}, {"nobody", X, {supply, {}}}},
                         {},
                         {{{"a", "", X, {}, supply}, {"b", "", X}}}}));
  }
  {
    const auto store = opened(file);
    const auto state = store->load();
    REQUIRE(state);
    REQUIRE(state->frames.size() == 4);
    CHECK(state->frames[0].correlation == StoredCorrelation{supply, seen});
    CHECK(state->frames[1].correlation == StoredCorrelation{{}, seen});
    CHECK(state->frames[2].correlation == StoredCorrelation{most, most});
    CHECK(state->frames[3].correlation.empty());
    CHECK(state->configured[0].correlation == supply);
    CHECK(state->configured[1].correlation.empty());
    REQUIRE(store->save({2, {"a", "b"}, {{"b", "", X, 2}}, {}}));
  }
  const auto state = opened(file)->load();
  REQUIRE(state);
  REQUIRE(state->frames.size() == 3);
  CHECK(state->frames[0].correlation.empty());
}

TEST_CASE("erased frames and tombstones are not restored") {
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  {
    const auto store = opened(file);
    REQUIRE(store->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}}));
    REQUIRE(store->save({2, {"hand"}, {}, {{"hand", 2, Tombstone::Kind::kRemoved, ""}}}));
    REQUIRE(store->save({3, {"hand"}, {}, {}}));
  }
  const auto state = opened(file)->load();
  CHECK(state->frames.empty());
  CHECK(state->tombstones.empty());
}

TEST_CASE("erased joints are not restored and leave no checksums") {
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  const auto store = opened(file);
  StateChange change;
  change.joints = {{"elbow", 0.5, 0}, {"wrist", 0.25, 0}};
  REQUIRE(store->save(change));
  change.joints = {{"knee", 0.75, 0}};
  change.erased_joints = {"elbow", "nobody"};
  REQUIRE(store->save(change));
  const auto state = store->load();
  REQUIRE(state);
  REQUIRE(state->joints.size() == 2);
  CHECK(state->joints[0].name == "knee");
  CHECK(state->joints[1].name == "wrist");
}

TEST_CASE("a saved state survives a kill of its process") {
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  const pid_t child = fork();
  if (child == 0) {
    const auto store = open_sqlite_store(file, "arms");
    for (int i = 0; store && i < 200; ++i) {
      const std::string id = "f" + std::to_string(i);
      if (!(*store)->save({1, {id}, {{id, "", {}, 1}}, {}})) _exit(1);
    }
    kill(getpid(), SIGKILL);
  }
  int status = 0;
  REQUIRE(waitpid(child, &status, 0) == child);
  REQUIRE(WIFSIGNALED(status));
  CHECK(opened(file)->load()->frames.size() == 200);
}

TEST_CASE("a state that is in use is rejected") {
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  const auto store = opened(file);
  CHECK_THAT(refused(file),
             ContainsSubstring("state: state file '" + file + "' is in use by another process"));
}

TEST_CASE("a file that is not this partition's state is rejected and not changed") {
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  REQUIRE(opened(file)->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}}));
  SECTION("not a database") {
    put(file, 0, "something else altogether");
    CHECK_THAT(refused(file),
               ContainsSubstring("is damaged (file is not a database (SQLite code 26)): move it"));
  }
  SECTION("truncated") {
    std::filesystem::resize_file(file, 5000);
    CHECK_THAT(refused(file), ContainsSubstring("is damaged"));
  }
  SECTION("damaged inside") {
    for (std::streamoff at = 4096; at < 4096 * 4; at += 64) put(file, at, "garbage");
    CHECK_THAT(refused(file), ContainsSubstring("is damaged"));
  }
  SECTION("of a newer format") {
    put(file, 60, std::string("\0\0\0\10", 4));
    CHECK_THAT(refused(file), ContainsSubstring("has format 8; this version reads formats 1 to 7"));
  }
  SECTION("of another program") {
    put(file, 68, std::string("\0\0\0\2", 4));
    CHECK_THAT(refused(file), ContainsSubstring("belongs to another program"));
  }
  SECTION("of another partition") {
    CHECK_THAT(refused(file, "legs"), ContainsSubstring("is of partition 'arms', not of 'legs'"));
  }
  const std::string before = content(file);
  CHECK(refused(file, "legs") != "ok");
  CHECK(content(file) == before);
}

TEST_CASE("an intact file in a read-only directory is not called damaged") {
  const TemporaryDirectory directory;
  const std::string file = state_file(directory.path(), 7, "arms");
  REQUIRE(opened(file)->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}}));
  const auto folder = std::filesystem::path(file).parent_path();
  const auto allow = [&](const std::filesystem::path& path, unsigned mode) {
    std::filesystem::permissions(path, std::filesystem::perms(mode));
  };
  allow(directory.path(), 0755);
  std::string message;
  SECTION("the directory") {
    allow(folder, 0555);
    allow(file, 0666);
    message = as_nobody([&] { return refused(file); });
    CHECK_THAT(message, ContainsSubstring("SQLite code 1544"));
    CHECK_THAT(message, ContainsSubstring("attempt to write a readonly database"));
  }
  SECTION("the file") {
    allow(folder, 0777);
    allow(file, 0444);
    message = as_nobody([&] { return refused(file); });
    CHECK_THAT(message, ContainsSubstring("SQLite code 8"));
  }
  CHECK_THAT(message, ContainsSubstring("Keep it"));
  CHECK_THAT(message, ContainsSubstring("state file '" + file + "'"));
  CHECK(message.find("damaged") == std::string::npos);
  CHECK(message.find("away") == std::string::npos);
  allow(folder, 0777);
  allow(file, 0666);
  CHECK(opened(file)->load()->frames.size() == 1);
}

TEST_CASE("a full disk loses nothing and storing continues once there is room") {
  testing::SmallDisk disk(300);
  if (!disk.mounted()) {
    WARN("SKIPPED: " << disk.missing());
    return;
  }
  const std::string file = state_file(disk.path(), 7, "arms");
  const auto store = opened(file);
  REQUIRE(store->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}}));
  disk.fill();
  std::string message;
  int kept = 0;
  for (int i = 0; i < 200 && message.empty(); ++i) {
    const std::string id = "f" + std::to_string(i);
    const auto saved = store->save({1, {id}, {{id, "", {}, 1}}, {}});
    if (saved) ++kept;
    if (!saved) message = saved.error().message;
  }
  CHECK_THAT(message, ContainsSubstring("database or disk is full (SQLite code 13)"));
  CHECK_FALSE(store->save({1, {"late"}, {{"late", "", {}, 1}}, {}}));
  CHECK(store->load()->frames.size() == static_cast<std::size_t>(kept) + 1);
  disk.make_room();
  CHECK(outcome(store->save({1, {"late"}, {{"late", "", {}, 1}}, {}})) == "ok");
  CHECK(store->load()->frames.size() == static_cast<std::size_t>(kept) + 2);
}

TEST_CASE("a change for which there was room is saved on a disk that is full since") {
  testing::SmallDisk disk(600);
  if (!disk.mounted()) {
    WARN("SKIPPED: " << disk.missing());
    return;
  }
  const std::string file = state_file(disk.path(), 7, "arms");
  REQUIRE(opened(file)->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}}));
  const auto store = opened(file);
  REQUIRE(store->make_room());
  REQUIRE(store->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}}));
  REQUIRE(store->make_room());
  disk.fill();
  std::size_t kept = 0;
  Result<void> room;
  // What each of these leaves in the log would fill the disk many times.
  for (int i = 0; i < 500; ++i) {
    REQUIRE(outcome(store->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}})) == "ok");
    REQUIRE(outcome(store->make_room()) == "ok");
  }
  while (room && kept < 1000) {
    const std::string id = "f" + std::to_string(kept);
    REQUIRE(outcome(store->save({1, {id}, {{id, "", {}, 1}}, {}})) == "ok");
    ++kept;
    room = store->make_room();
  }
  REQUIRE_FALSE(room);
  CHECK(room.error().code == Errc::kState);
  CHECK_THAT(room.error().message, ContainsSubstring("state file '" + file + "'"));
  CHECK_THAT(room.error().message, ContainsSubstring("has no room on its disk"));
  disk.make_room();
  CHECK(outcome(store->make_room()) == "ok");
  CHECK(store->load()->frames.size() == kept + 1);
}

TEST_CASE("a state file that is removed or moved below its process takes no change") {
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/arms.sqlite";
  const std::string aside = directory.path() + "/aside.sqlite";
  const std::string log = file + "-wal";
  auto store = opened(file);
  REQUIRE(store->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}}));
  const StateChange more{1, {"late"}, {{"late", "", {}, 1}}, {}};
  const auto is_refused = [&] {
    const auto saved = store->save(more);
    REQUIRE_FALSE(saved);
    CHECK(saved.error().code == Errc::kState);
    CHECK_THAT(saved.error().message,
               ContainsSubstring("state file '" + file + "' was removed, moved or replaced"));
  };
  SECTION("removed, with its directory") {
    std::filesystem::remove_all(directory.path());
    is_refused();
    is_refused();
    store.reset();
    CHECK_FALSE(std::filesystem::exists(file));
  }
  SECTION("moved, until it is put back") {
    std::filesystem::rename(file, aside);
    is_refused();
    std::filesystem::rename(aside, file);
    CHECK(outcome(store->save(more)) == "ok");
    store.reset();
    CHECK(opened(file)->load()->frames.size() == 2);
  }
  SECTION("replaced, by one with a log of its own") {
    std::filesystem::rename(file, aside);
    std::filesystem::copy_file(aside, file);
    std::filesystem::rename(log, aside + "-wal");
    std::ofstream(log) << "another's";
    is_refused();
    store.reset();
    CHECK(std::filesystem::file_size(log) == 9);
  }
}

TEST_CASE("a file that cannot be updated to the current format stays unchanged until it can") {
  testing::SmallDisk disk(300);
  if (!disk.mounted()) {
    WARN("SKIPPED: " << disk.missing());
    return;
  }
  const std::string file = state_file(disk.path(), 7, "arms");
  REQUIRE(opened(file)->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}}));
  sqlite3* raw = nullptr;
  REQUIRE(sqlite3_open(file.c_str(), &raw) == SQLITE_OK);
  const char* const older =
      "DROP TABLE absent; DROP TABLE joint_types; DROP TABLE configured_ties; DROP TABLE ties; "
      "DROP TABLE joints; DROP TABLE samples; DROP TABLE sums; DROP TABLE configured_joints; "
      "PRAGMA user_version = 1";
  REQUIRE(sqlite3_exec(raw, older, nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(raw);
  const auto store = opened(file);
  REQUIRE(store->load());
  disk.fill();
  const auto full = store->save({1, {}, {}, {}, {{"elbow", 0.5, 0}}});
  REQUIRE_FALSE(full);
  CHECK_THAT(full.error().message,
             ContainsSubstring("cannot be written: database or disk is full"));
  // No transaction was left open: the next attempt begins one.
  const auto again = store->save({1, {}, {}, {}, {{"elbow", 0.5, 0}}});
  REQUIRE_FALSE(again);
  CHECK_THAT(again.error().message, ContainsSubstring("disk is full"));
  disk.make_room();
  CHECK(outcome(store->save({1, {}, {}, {}, {{"elbow", 0.5, 0}}})) == "ok");
  CHECK(store->load()->joints.size() == 1);
  CHECK(store->load()->frames.size() == 1);
}

TEST_CASE("a directory that cannot be created is named") {
  CHECK_THAT(refused("/proc/nowhere/arms.sqlite"), ContainsSubstring("cannot be opened"));
}

TEST_CASE("each partition and domain has its own file whatever the name") {
  CHECK(state_file("/s", 7, "arms") == "/s/domain-7/arms.sqlite");
  CHECK(state_file("/s", 8, "left/arm") == "/s/domain-8/left%2farm.sqlite");
  CHECK(state_file("/s", 7, "..") == "/s/domain-7/%2e..sqlite");
  const std::string longest = state_file("/s", 7, std::string(255, ' '));
  CHECK(std::filesystem::path(longest).filename().string().size() < 255);
  CHECK(longest != state_file("/s", 7, std::string(254, ' ')));
}

}  // namespace
}  // namespace tfdude
