#include "store/row_sums.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <initializer_list>

#include "tfdude/base/id.hpp"

#include "store/schema.hpp"

namespace tfdude {
namespace {

using sqlite::Database;
using sqlite::each_row;
using sqlite::Statement;

struct Columns {
  const char* table;
  const char* key;
  const char* all;
  std::int64_t since = kSumsFormat;  // the first format with the table and its checksums
};

constexpr const char* kAbout = "about";
constexpr std::array<Columns, 11> kTables{
    {{kAbout, "partition", "partition, epoch"},
     {"frames", "id", "id, parent, x_pc, since"},
     {"notes", "id", "id, since, kind, rival"},
     {"configured", "id", "id, parent, x_pc"},
     {"joints", "name", "name, position, variance"},
     {"joint_types", "name", "name, type"},
     {"ties", "id", "id, said, observed"},
     {"configured_ties", "id", "id, said"},
     {"absent", "partition", "partition, since, kind, incarnation"},
     {"samples", "id", "id, stamp"},
     {"configured_joints", "id", "id, name, follows", kEntryJointsFormat}}};

// FNV-1a.
class Hash {
 public:
  void add(const void* bytes, std::size_t size) {
    const auto* const first = static_cast<const unsigned char*>(bytes);
    for (std::size_t i = 0; i < size; ++i) value_ = (value_ ^ first[i]) * 1099511628211U;
  }
  template <class T>
  void add(const T& value) {
    add(&value, sizeof value);
  }
  [[nodiscard]] std::int64_t value() const { return static_cast<std::int64_t>(value_); }

 private:
  std::uint64_t value_ = 14695981039346656037U;
};

void row_sum(sqlite3_context* context, int count, sqlite3_value** values) {
  Hash hash;
  for (int i = 0; i < count; ++i) {
    sqlite3_value* const value = values[i];
    const int type = sqlite3_value_type(value);
    hash.add(type);
    if (type == SQLITE_INTEGER) {
      hash.add(sqlite3_value_int64(value));
    } else if (type == SQLITE_FLOAT) {
      hash.add(sqlite3_value_double(value));
    } else {
      const void* const bytes = sqlite3_value_blob(value);
      const int size = sqlite3_value_bytes(value);
      hash.add(size);
      if (bytes != nullptr) hash.add(bytes, static_cast<std::size_t>(size));
    }
  }
  sqlite3_result_int64(context, hash.value());
}

std::string name_in(const Columns& table, const std::string& key) {
  return "'" + std::string(table.table) + "/' || " + key;
}

// Each column with its table: the sums have a column "name", too.
std::string qualified(const Columns& table) {
  const std::string prefix = std::string(table.table) + ".";
  std::string all = prefix + table.all;
  for (auto at = all.find(", "); at != std::string::npos; at = all.find(", ", at + 2)) {
    all.insert(at + 2, prefix);
  }
  return all;
}

std::string put_sql(const Columns& table) {
  return "INSERT OR REPLACE INTO sums SELECT " + name_in(table, table.key) + ", row_sum(" +
         table.all + ") FROM " + table.table;
}

Result<Statement> prepared(Database& database, const std::string& sql) {
  return Statement::prepare(database, sql.c_str());
}

}  // namespace

Result<void> RowSums::install(Database& database) {
  const int flags = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_DIRECTONLY;
  if (sqlite3_create_function_v2(database.get(), "row_sum", -1, flags, nullptr, row_sum, nullptr,
                                 nullptr, nullptr) == SQLITE_OK) {
    return {};
  }
  return fail(Errc::kState, sqlite3_errmsg(database.get()));
}

Result<void> RowSums::prepare(Database& database) {
  tables_.clear();
  for (const Columns& one : kTables) {
    auto put = prepared(database, put_sql(one) + " WHERE " + one.key + " = ?1");
    auto erase = prepared(database, "DELETE FROM sums WHERE name = " + name_in(one, "?1"));
    const std::string of_table = std::string(one.table) + "/";
    auto clear = prepared(database, "DELETE FROM sums WHERE substr(name, 1, " +
                                        std::to_string(of_table.size()) + ") = '" + of_table + "'");
    auto put_all = prepared(database, put_sql(one));
    for (const auto* statement : {&put, &erase, &clear, &put_all}) {
      if (!*statement) return tl::unexpected(statement->error());
    }
    tables_.push_back({std::move(*put), std::move(*erase), std::move(*clear), std::move(*put_all)});
  }
  return {};
}

RowSums::Table& RowSums::table(const std::string& name) {
  std::size_t i = 0;
  while (kTables.at(i).table != name) ++i;
  return tables_.at(i);
}

Result<void> RowSums::put(const std::string& name, const std::string& key) {
  return table(name).put.run(key);
}
Result<void> RowSums::erase(const std::string& name, const std::string& key) {
  return table(name).erase.run(key);
}
Result<void> RowSums::clear(const std::string& name) { return table(name).clear.run(); }

Result<void> RowSums::put_all() {
  Result<void> done;
  for (Table& one : tables_) {
    if (done) done = one.put_all.run();
  }
  return done;
}

Result<void> RowSums::put_all(const std::string& name) { return table(name).put_all.run(); }

namespace {

// The keys that a query returns, as rows of a table.
Result<void> add_rows(Database& database, const Columns& table, const std::string& query,
                      std::vector<WrongRow>& rows) {
  return each_row(database, query.c_str(), [&](const Statement& row) -> Result<void> {
    rows.push_back({table.table, row.text(0)});
    return {};
  });
}

// The checksum of the row at hand.
std::string sum_of(const Columns& table) {
  return "SELECT 1 FROM sums WHERE sums.name = " +
         name_in(table, std::string(table.table) + "." + table.key);
}

std::string changed_rows(const Columns& table) {
  return std::string("SELECT ") + table.key + " FROM " + table.table + " WHERE EXISTS(" +
         sum_of(table) + " AND sums.sum <> row_sum(" + qualified(table) + "))";
}

std::string missing_rows(const Columns& table) {
  const std::string name = table.table;
  const std::string size = std::to_string(name.size() + 1);
  return "SELECT substr(sums.name, 1 + " + size + ") FROM sums WHERE substr(sums.name, 1, " + size +
         ") = '" + name + "/' AND NOT EXISTS(SELECT 1 FROM " + name +
         " WHERE sums.name = " + name_in(table, name + "." + table.key) + ")";
}

std::string rows_without_sum(const Columns& table) {
  return std::string("SELECT ") + table.key + " FROM " + table.table + " WHERE NOT EXISTS(" +
         sum_of(table) + ")";
}

}  // namespace

Result<std::vector<WrongRow>> find_wrong_rows(Database& database, std::int64_t format) {
  std::vector<WrongRow> wrong;
  Result<void> done;
  for (const Columns& table : kTables) {
    if (format < table.since) continue;
    if (done) done = add_rows(database, table, changed_rows(table), wrong);
    if (done) done = add_rows(database, table, missing_rows(table), wrong);
  }
  // A row whose key has changed has no checksum, but another one is missing.
  for (const Columns& table : kTables) {
    if (format < table.since) continue;
    if (done && !wrong.empty()) done = add_rows(database, table, rows_without_sum(table), wrong);
  }
  if (!done) return tl::unexpected(std::move(done.error()));
  return wrong;
}

namespace {

// Runs statements one after the other, each for one id.
Result<void> run_for(Database& database, const std::string& id,
                     std::initializer_list<const char*> statements) {
  for (const char* sql : statements) {
    auto statement = prepared(database, sql);
    auto done = statement ? statement->run(id) : tl::unexpected(statement.error());
    if (!done) return done;
  }
  return {};
}

// What an entry said of the configuration, of which a part is damaged. Its id stays, so that it
// does not count as new, which would replace what was set at run time.
Result<void> make_unknown(Database& database, const std::string& id) {
  if (!check_id(id, "id")) return {};
  return run_for(
      database, id,
      {"DELETE FROM configured_ties WHERE id = ?1", "DELETE FROM configured_joints WHERE id = ?1",
       "INSERT OR REPLACE INTO configured VALUES(?1, '', x'')",
       "INSERT OR REPLACE INTO sums SELECT 'configured/' || id, row_sum(id, "
       "parent, x_pc) FROM configured WHERE id = ?1"});
}

// What is stored beside a correlation is the covariance of the edge's own part, which is too small
// without it: only the pose stays, in its 7 numbers.
Result<void> leave_covariance_out(Database& database, const std::string& id) {
  return run_for(database, id,
                 {"UPDATE frames SET x_pc = substr(x_pc, 1, 56) WHERE id = ?1",
                  "INSERT OR REPLACE INTO sums SELECT 'frames/' || id, row_sum(id, parent, "
                  "x_pc, since) FROM frames WHERE id = ?1"});
}

bool is_of_entry(const std::string& table) {
  return table == "configured" || table == "configured_ties" || table == "configured_joints";
}

}  // namespace

Result<void> erase_rows(Database& database, const std::vector<WrongRow>& rows) {
  return database.atomically([&]() -> Result<void> {
    for (const WrongRow& row : rows) {
      for (const Columns& one : kTables) {
        if (row.table != one.table) continue;
        if (row.table == kAbout) return fail(Errc::kState, to_string(row) + " cannot be left out");
        auto erase = prepared(database, "DELETE FROM " + row.table + " WHERE " + one.key + " = ?1");
        auto sum = prepared(database, "DELETE FROM sums WHERE name = " + name_in(one, "?1"));
        if (!erase || !sum) return tl::unexpected(erase ? sum.error() : erase.error());
        if (auto done = erase->run(row.key); !done) return done;
        if (auto done = sum->run(row.key); !done) return done;
      }
    }
    for (const WrongRow& row : rows) {
      Result<void> done;
      if (row.table == "ties") done = leave_covariance_out(database, row.key);
      if (is_of_entry(row.table)) done = make_unknown(database, row.key);
      if (!done) return done;
    }
    // What belongs to a frame or an entry that is no longer there.
    return database.run(
        "DELETE FROM ties WHERE id NOT IN (SELECT id FROM frames);"
        "DELETE FROM samples WHERE id NOT IN (SELECT id FROM frames);"
        "DELETE FROM configured_ties WHERE id NOT IN (SELECT id FROM configured);"
        "DELETE FROM configured_joints WHERE id NOT IN (SELECT id FROM configured);"
        "DELETE FROM joint_types WHERE name NOT IN (SELECT name FROM joints);"
        "DELETE FROM sums WHERE substr(name, 1, 5) = 'ties/' AND substr(name, 6) NOT IN "
        "(SELECT id FROM ties);"
        "DELETE FROM sums WHERE substr(name, 1, 8) = 'samples/' AND substr(name, 9) NOT IN "
        "(SELECT id FROM samples);"
        "DELETE FROM sums WHERE substr(name, 1, 16) = 'configured_ties/' AND substr(name, 17) NOT "
        "IN (SELECT id FROM configured_ties);"
        "DELETE FROM sums WHERE substr(name, 1, 18) = 'configured_joints/' AND substr(name, 19) "
        "NOT IN (SELECT id FROM configured_joints);"
        "DELETE FROM sums WHERE substr(name, 1, 12) = 'joint_types/' AND substr(name, 13) NOT IN "
        "(SELECT name FROM joint_types);");
  });
}

std::string to_string(const WrongRow& row) { return row.table + " " + quote(row.key); }

}  // namespace tfdude
