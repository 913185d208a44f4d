#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <sqlite3.h>
#include <string>
#include <string_view>

#include "tfdude/base/result.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude::sqlite {

/// An open database. Errors are kState with SQLite's message. Not thread-safe.
class Database {
 public:
  [[nodiscard]] static Result<Database> open(const std::string& file);

  /// From now on, closing merges the log into the file. Without this call, closing leaves the file
  /// as it was found. @param tidy  false: takes that back
  void tidy_up_at_close(bool tidy = true);

  /// Runs statements that return no rows.
  [[nodiscard]] Result<void> run(const char* sql);

  /// Runs a function in a transaction: either all of its writes are kept, or none; no transaction
  /// is left open.
  [[nodiscard]] Result<void> atomically(const std::function<Result<void>()>& write);

  /// The first column of the first row, as a number; 0 if there is no row.
  [[nodiscard]] Result<std::int64_t> number(const char* sql);
  /// The same as text; empty if there is no row.
  [[nodiscard]] Result<std::string> text(const char* sql);

  /// Whether the last failure was caused by the file, not by the directory, the disk or the
  /// computer.
  [[nodiscard]] bool is_damaged() const;
  /// Whether the file could only be opened for reading. Its first write would fail with an error
  /// that does not name the cause.
  [[nodiscard]] bool is_read_only() const {
    return sqlite3_db_readonly(handle_.get(), "main") == 1;
  }
  /// Whether the file is no longer where it was opened: nobody will find what is written to it.
  [[nodiscard]] bool is_gone() const;
  [[nodiscard]] int code() const { return sqlite3_errcode(handle_.get()); }
  [[nodiscard]] sqlite3* get() const { return handle_.get(); }

 private:
  struct Close {
    void operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }
  };
  std::unique_ptr<sqlite3, Close> handle_;
};

/// Bytes that are not text.
struct Blob {
  std::string bytes;
};

/// A prepared statement, used repeatedly.
class Statement {
 public:
  Statement() = default;
  [[nodiscard]] static Result<Statement> prepare(const Database& database, const char* sql);

  /// Binds values to ?1, ?2 ... and takes the first step.
  /// @return whether there is a row
  template <class... Values>
  [[nodiscard]] Result<bool> start(const Values&... values) {
    sqlite3_reset(handle_.get());
    int at = 0;
    (bind(++at, values), ...);
    return next();
  }
  /// Binds values and runs to the end.
  template <class... Values>
  [[nodiscard]] Result<void> run(const Values&... values) {
    auto row = start(values...);
    sqlite3_reset(handle_.get());
    if (!row) return tl::unexpected(std::move(row.error()));
    return {};
  }
  [[nodiscard]] Result<bool> next();

  /// Checks the types of the row's columns (SQLITE_INTEGER and so on), because a column may hold
  /// any type. @return kState
  [[nodiscard]] Result<void> check_types(std::initializer_list<int> types) const;
  [[nodiscard]] std::string text(int column) const;
  [[nodiscard]] std::uint64_t number(int column) const;
  [[nodiscard]] double real(int column) const;
  /// All bytes of a text or a blob.
  [[nodiscard]] std::string bytes(int column) const { return text(column); }
  /// @return kState if the column does not have the size of a transform; as computed_from()
  [[nodiscard]] Result<Transform> transform(int column) const;

 private:
  void bind(int at, const std::string& text);
  void bind(int at, std::uint64_t number);
  void bind(int at, double number);
  void bind(int at, const Transform& X);
  void bind(int at, const Blob& blob);

  struct Finalize {
    void operator()(sqlite3_stmt* handle) const { sqlite3_finalize(handle); }
  };
  std::unique_ptr<sqlite3_stmt, Finalize> handle_;
};

/// Calls take(row) for each row that a query returns, up to the first row that it rejects.
template <class Take>
Result<void> each_row(const Database& database, const char* sql, Take take) {
  auto rows = Statement::prepare(database, sql);
  if (!rows) return tl::unexpected(std::move(rows.error()));
  for (auto row = rows->start();; row = rows->next()) {
    if (!row) return tl::unexpected(std::move(row.error()));
    if (!*row) return {};
    if (auto taken = take(*rows); !taken) return taken;
  }
}

}  // namespace tfdude::sqlite
