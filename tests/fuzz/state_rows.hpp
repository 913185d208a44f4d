#pragma once

#include <cstdint>
#include <sqlite3.h>
#include <string>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>

namespace tfdude::fuzz {

/// Writes any values to the tables of a state, as another program could, and rarely to its schema.
class RowWriter {
 public:
  RowWriter(const std::string& file, FuzzedDataProvider& choices) : choices_(choices) {
    sqlite3_open(file.c_str(), &database_);
    run("PRAGMA writable_schema = ON; PRAGMA ignore_check_constraints = ON; BEGIN");
  }
  RowWriter(const RowWriter&) = delete;
  RowWriter& operator=(const RowWriter&) = delete;
  ~RowWriter() {
    run("COMMIT");
    sqlite3_close(database_);
  }

  // Statements that SQLite rejects are ignored.
  void step() {
    static constexpr const char* kInserts[] = {
        "INSERT OR REPLACE INTO frames VALUES(?1, ?2, ?3, ?4)",
        "INSERT OR REPLACE INTO notes VALUES(?1, ?4, ?5, ?2)",
        "INSERT OR REPLACE INTO configured VALUES(?1, ?2, ?3)",
        "INSERT OR REPLACE INTO joints VALUES(?1, ?4, ?5)",
        "INSERT OR REPLACE INTO joint_types VALUES(?1, ?4)",
        "INSERT OR REPLACE INTO ties VALUES(?1, zeroblob(9), x'')",
        "INSERT OR REPLACE INTO ties VALUES(?1, zeroblob(9), ?3)",
        "INSERT OR REPLACE INTO configured_ties VALUES(?1, zeroblob(9))",
        "INSERT OR REPLACE INTO configured_joints VALUES(?1, ?2, ?1)",
        "INSERT OR REPLACE INTO absent VALUES(?1, ?4, ?5, ?4)",
        "UPDATE about SET epoch = ?4",
        "UPDATE about SET partition = ?1",
        "INSERT INTO about VALUES('arms', ?4)",
    };
    static constexpr const char* kOthers[] = {
        "CREATE TRIGGER t AFTER INSERT ON frames BEGIN DELETE FROM notes; END",
        "CREATE VIEW v AS SELECT * FROM frames",
        "DROP TABLE notes; CREATE VIEW notes AS SELECT id, since, 1, '' FROM frames",
        "DROP TABLE notes; CREATE TABLE notes(id, since, kind, rival)",
        "CREATE INDEX i ON frames(parent)",
        "UPDATE sqlite_master SET sql = replace(sql, 'PRIMARY KEY', '') WHERE name = 'frames'",
        "UPDATE sqlite_master SET rootpage = 3 WHERE name = 'notes'",
        "PRAGMA user_version = 4",
        "DROP TABLE absent; DROP TABLE ties; DROP TABLE configured_ties; DROP TABLE joint_types; "
        "PRAGMA user_version "
        "= 2",
        "DROP TABLE absent; DROP TABLE ties; DROP TABLE configured_ties; DROP TABLE joint_types; "
        "DROP TABLE joints; "
        "PRAGMA user_version = 1",
    };
    if (rarely()) {
      run(choices_.PickValueInArray(kOthers));
      return;
    }
    sqlite3_stmt* insert = nullptr;
    sqlite3_prepare_v2(database_, choices_.PickValueInArray(kInserts), -1, &insert, nullptr);
    if (insert == nullptr) return;
    for (int at = 1; at <= sqlite3_bind_parameter_count(insert); ++at) bind(insert, at);
    sqlite3_step(insert);
    sqlite3_finalize(insert);
  }

 private:
  void run(const char* sql) { sqlite3_exec(database_, sql, nullptr, nullptr, nullptr); }

  // Most values are such that a state has them: else hardly any file would be accepted.
  bool rarely() { return choices_.ConsumeIntegralInRange(0, 63) == 63; }

  // ?1 and ?2 are ids, ?3 a transform, ?4 a count, ?5 a kind.
  void bind(sqlite3_stmt* insert, int at) {
    switch (rarely() ? choices_.ConsumeIntegralInRange(1, 5) : at) {
      case 1:
      case 2:
        bind_id(insert, at);
        break;
      case 3:
        bind_transform(insert, at);
        break;
      case 4:
        sqlite3_bind_int64(insert, at,
                           rarely() ? choices_.ConsumeIntegral<std::int64_t>()
                                    : choices_.ConsumeIntegralInRange(0, 20));
        break;
      default:
        sqlite3_bind_int64(insert, at, choices_.ConsumeIntegralInRange(rarely() ? 0 : 1, 3));
    }
  }

  void bind_id(sqlite3_stmt* insert, int at) {
    std::string id(1, choices_.PickValueInArray({'a', 'b', 'c', 'd'}));
    if (at == 2 && choices_.ConsumeBool()) id.clear();
    if (rarely()) id = choices_.ConsumeRandomLengthString(300);
    const int size = static_cast<int>(id.size());
    if (rarely()) {
      sqlite3_bind_blob(insert, at, id.data(), size, SQLITE_TRANSIENT);
    } else {
      sqlite3_bind_text(insert, at, id.data(), size, SQLITE_TRANSIENT);
    }
  }

  void bind_transform(sqlite3_stmt* insert, int at) {
    double numbers[28] = {0, 0, 0, 1};
    const bool any = rarely();
    for (double& number : numbers) {
      if (any) number = choices_.ConsumeFloatingPoint<double>();
    }
    const int size = rarely() ? choices_.ConsumeIntegralInRange(0, 224) : 224;
    sqlite3_bind_blob(insert, at, numbers, size, SQLITE_TRANSIENT);
  }

  FuzzedDataProvider& choices_;
  sqlite3* database_ = nullptr;
};

inline void put_rows(const std::string& file, FuzzedDataProvider& choices) {
  RowWriter rows(file, choices);
  while (choices.remaining_bytes() > 0) rows.step();
}

}  // namespace tfdude::fuzz
