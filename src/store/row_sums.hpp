#pragma once

#include <string>
#include <vector>

#include "store/sqlite.hpp"

namespace tfdude {

/// Checksums of all rows, in a table of their own (format 6): SQLite itself does not notice a
/// changed byte of a value.
class RowSums {
 public:
  /// Makes the SQL function known that computes them.
  [[nodiscard]] static Result<void> install(sqlite::Database& database);

  /// The file has the table.
  [[nodiscard]] Result<void> prepare(sqlite::Database& database);

  /// After a row was written or erased, or a table was emptied.
  [[nodiscard]] Result<void> put(const std::string& table, const std::string& key);
  [[nodiscard]] Result<void> erase(const std::string& table, const std::string& key);
  [[nodiscard]] Result<void> clear(const std::string& table);
  /// Of all rows as they are.
  [[nodiscard]] Result<void> put_all();
  /// Of one table.
  [[nodiscard]] Result<void> put_all(const std::string& table);

 private:
  struct Table {
    sqlite::Statement put;
    sqlite::Statement erase;
    sqlite::Statement clear;
    sqlite::Statement put_all;
  };
  [[nodiscard]] Table& table(const std::string& name);

  std::vector<Table> tables_;
};

/// A row whose checksum is wrong, or that is missing although it has one; then also rows that have
/// none.
struct WrongRow {
  std::string table;
  std::string key;
};

/// @param format  that of the file
[[nodiscard]] Result<std::vector<WrongRow>> find_wrong_rows(sqlite::Database& database,
                                                            std::int64_t format);

/// Erases these rows, and what belongs to them. Entries of the configuration become unknown.
/// @return kState for the row that says whose file it is: nothing can replace that
[[nodiscard]] Result<void> erase_rows(sqlite::Database& database,
                                      const std::vector<WrongRow>& rows);

/// "frames 'hand'", for a message.
[[nodiscard]] std::string to_string(const WrongRow& row);

}  // namespace tfdude
