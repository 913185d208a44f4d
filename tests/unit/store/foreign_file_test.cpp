// What others have put into a state file, by accident or not.

#include <filesystem>
#include <fstream>
#include <sqlite3.h>
#include <string>
#include <utility>

#include "store/sqlite_store.hpp"
#include "support/catch.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::TemporaryDirectory;

std::string content(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string refused(const std::string& file) {
  const auto store = open_sqlite_store(file, "arms");
  if (!store) return store.error().message;
  const auto state = (*store)->load();
  return state ? "ok" : state.error().message;
}

// A database that is opened without any of the store's caution.
class Raw {
 public:
  explicit Raw(const std::string& file) { sqlite3_open(file.c_str(), &handle_); }
  Raw(const Raw&) = delete;
  Raw& operator=(const Raw&) = delete;
  ~Raw() { sqlite3_close(handle_); }

  void run(const std::string& sql) {
    INFO(sql << ": " << sqlite3_errmsg(handle_));
    REQUIRE(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK);
  }

 private:
  sqlite3* handle_ = nullptr;
};

// A state with one frame, and what SQL makes of it.
std::string changed_by(const TemporaryDirectory& directory, const std::string& sql) {
  const std::string file = directory.path() + "/arms.sqlite";
  {
    const auto store = open_sqlite_store(file, "arms");
    REQUIRE(store);
    REQUIRE((*store)->save({1, {"hand"}, {{"hand", "", {}, 1}}, {}}));
  }
  Raw(file).run(sql);
  return file;
}

TEST_CASE("a file with foreign tables or triggers or views is rejected and not changed") {
  const TemporaryDirectory directory;
  const std::string sql = GENERATE(
      as<std::string>{}, "CREATE TRIGGER t AFTER INSERT ON frames BEGIN DELETE FROM notes; END",
      "CREATE VIEW v AS SELECT * FROM frames", "CREATE INDEX i ON frames(parent)",
      "CREATE TABLE more(id TEXT)", "DROP TABLE notes",
      "DROP TABLE notes; CREATE VIEW notes AS SELECT id, since, 1 AS kind, '' AS rival FROM frames",
      "DROP TABLE frames; CREATE TABLE frames(id TEXT, parent TEXT, x_pc BLOB, since INTEGER)");
  const std::string file = changed_by(directory, sql);
  const std::string before = content(file);
  CHECK_THAT(refused(file), ContainsSubstring("is damaged (its tables are not those of a state)"));
  CHECK(content(file) == before);
}

TEST_CASE("a file of format 1 is read and updated by the first write") {
  const TemporaryDirectory directory;
  const std::string file = changed_by(
      directory,
      "DROP TABLE sums; DROP TABLE configured_joints; DROP TABLE samples; DROP TABLE absent; "
      "DROP TABLE joints; DROP TABLE ties; DROP "
      "TABLE configured_ties; DROP TABLE joint_types; "
      "PRAGMA user_version = 1; PRAGMA journal_mode = DELETE");
  const std::string before = content(file);
  {
    const auto store = open_sqlite_store(file, "arms");
    REQUIRE(store);
    const auto state = (*store)->load();
    REQUIRE(state);
    CHECK(state->frames.size() == 1);
    CHECK(state->joints.empty());
  }
  CHECK(content(file) == before);
  {
    const auto store = open_sqlite_store(file, "arms");
    REQUIRE(store);
    REQUIRE((*store)->save({1, {}, {}, {}, {{"elbow", 0.5, 0}}}));
  }
  const auto store = open_sqlite_store(file, "arms");
  REQUIRE(store);
  CHECK((*store)->load()->joints.size() == 1);
}

TEST_CASE("a file of format 2 is read and updated by the first write") {
  const TemporaryDirectory directory;
  const std::string file = changed_by(directory,
                                      "DROP TABLE sums; DROP TABLE configured_joints; DROP TABLE "
                                      "samples; DROP TABLE absent; DROP TABLE ties; "
                                      "DROP TABLE configured_ties; DROP TABLE "
                                      "joint_types; PRAGMA user_version = 2; "
                                      "PRAGMA journal_mode = DELETE");
  const StoredCorrelation unknown{{true, {}, {}}, {}};
  {
    const auto store = open_sqlite_store(file, "arms");
    REQUIRE(store);
    REQUIRE((*store)->load());
    REQUIRE((*store)->save({1, {}, {}, {}, {}, {}, {{"hand", {}, unknown}}}));
  }
  const auto store = open_sqlite_store(file, "arms");
  REQUIRE(store);
  const auto state = (*store)->load();
  REQUIRE(state);
  REQUIRE(state->frames.size() == 1);
  CHECK(state->frames[0].correlation == unknown);
}

TEST_CASE("a file with invalid rows is rejected and not changed") {
  const TemporaryDirectory directory;
  const auto [sql, why] = GENERATE(table<std::string, std::string>({
      {"UPDATE frames SET id = CAST(id AS BLOB)", "another type in column id"},
      {"UPDATE frames SET parent = x'41'", "another type in column parent"},
      {"UPDATE frames SET x_pc = 'text'", "another type in column x_pc"},
      {"UPDATE frames SET x_pc = zeroblob(223)", "a transform of 223 bytes"},
      {"UPDATE frames SET x_pc = zeroblob(9000000)", "too big"},
      {"UPDATE frames SET since = 1.5", "another type in column since"},
      {"UPDATE frames SET since = -1", "a time of 18446744073709551615"},
      {"INSERT INTO absent VALUES('head', 1, 6, 1)", "an absence of kind 6"},
      {"INSERT INTO absent VALUES('head', 1, 1, -1)", "a time of 18446744073709551615"},
      {"INSERT INTO absent VALUES('', 1, 1, 1)", "partition"},
      {"UPDATE about SET epoch = -1", "a time of 18446744073709551615"},
      {"INSERT INTO about VALUES('arms', 2)", "it contains 2 partitions"},
      {"DELETE FROM about", "it contains 0 partitions"},
      {"INSERT INTO joints VALUES('elbow', 'much', 0)", "another type in column position"},
      {"INSERT INTO joints VALUES('elbow', 1e10, 0)", "position is not a number, or beyond 1e9"},
      {"INSERT INTO joints VALUES('elbow', 0, -2)", "variance is not a number within"},
      {"INSERT INTO joints VALUES('elbow', 0, 0); INSERT INTO joint_types VALUES('elbow', 4)",
       "joint 'elbow' of type 4"},
      {"INSERT INTO joints VALUES('elbow', 0, 0); INSERT INTO joint_types VALUES('elbow', 'hinge')",
       "another type in column"},
      {"INSERT INTO notes VALUES('eye', 1, 5, '')", "a tombstone of kind 5"},
      {"INSERT INTO ties VALUES('nobody', zeroblob(9), x'')",
       "correlation of 'nobody', which does not exist"},
      {"INSERT INTO ties VALUES('hand', 'text', x'')", "another type in column said"},
      {"INSERT INTO ties VALUES('hand', zeroblob(8), x'')", "a correlation of 8 bytes"},
      {"INSERT INTO ties VALUES('hand', zeroblob(9), x'02')", "a correlation of 1 bytes"},
      {"INSERT INTO configured_ties VALUES('hand', zeroblob(9))", "'hand', which does not exist"},
      {"INSERT INTO notes VALUES('eye', 1, 2, 'a*')", "holds '*'"},
      {"INSERT INTO notes VALUES('eye', 1, 2, CAST(x'07' AS TEXT))", "holds a control character"},
  }));
  const std::string file = changed_by(directory, sql);
  const std::string before = content(file);
  CHECK_THAT(refused(file), ContainsSubstring("is damaged"));
  CHECK_THAT(refused(file), ContainsSubstring(why));
  CHECK(content(file) == before);
}

TEST_CASE("a rejected file keeps its write-ahead log") {
  const TemporaryDirectory directory;
  const std::string file = changed_by(directory, "DELETE FROM notes");
  const std::string copy = directory.path() + "/copy.sqlite";
  {
    Raw open(file);
    open.run("INSERT INTO notes VALUES('eye', 1, 9, '')");
    std::filesystem::copy(file, copy);
    std::filesystem::copy(file + "-wal", copy + "-wal");
  }
  const std::string before = content(copy);
  const std::string log = content(copy + "-wal");
  REQUIRE_FALSE(log.empty());
  CHECK_THAT(refused(copy), ContainsSubstring("a tombstone of kind 9"));
  CHECK(content(copy) == before);
  CHECK(content(copy + "-wal") == log);
}

TEST_CASE("control characters in a file do not reach the error message") {
  const TemporaryDirectory directory;
  const std::string file =
      changed_by(directory,
                 "PRAGMA writable_schema = ON; UPDATE sqlite_master SET sql = 'CREATE TABLE x(', "
                 "name = CAST(x'1b5b' AS TEXT) WHERE name = 'notes'");
  const std::string message = refused(file);
  CHECK_THAT(message, ContainsSubstring("is damaged"));
  CHECK(message.find('\x1b') == std::string::npos);
}

}  // namespace
}  // namespace tfdude
