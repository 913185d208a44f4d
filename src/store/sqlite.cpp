#include "store/sqlite.hpp"

#include <array>
#include <cstring>
#include <system_error>
#include <utility>

#include "math/flat.hpp"

namespace tfdude::sqlite {
namespace {

// Longer than any row that is ever written: the correlation of an edge may have 128 common errors
// of 36 columns, twice.
constexpr int kLongestRow = 1024 * 1024;

// Of a transform of unspecified covariance.
constexpr std::size_t kPoseBytes = 7 * sizeof(double);

// SQLite's message with its error code, which its documentation explains; and the system's message
// if the system is the cause.
std::string reason_of(sqlite3* handle) {
  const int code = sqlite3_extended_errcode(handle);
  std::string reason =
      std::string(sqlite3_errmsg(handle)) + " (SQLite code " + std::to_string(code);
  const int kind = code & 0xff;
  const int error = sqlite3_system_errno(handle);
  const bool of_system = kind == SQLITE_CANTOPEN || kind == SQLITE_IOERR;
  if (of_system && error != 0) reason += ": " + std::generic_category().message(error);
  return reason + ")";
}

tl::unexpected<Error> failed(sqlite3* handle) { return fail(Errc::kState, reason_of(handle)); }

// A file may come from anywhere: code in its schema must not run, and reading must not change the
// file.
void distrust(sqlite3* handle) {
  constexpr std::array<std::pair<int, int>, 6> kSettings{{{SQLITE_DBCONFIG_DEFENSIVE, 1},
                                                          {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                                          {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                                          {SQLITE_DBCONFIG_ENABLE_VIEW, 0},
                                                          {SQLITE_DBCONFIG_DQS_DDL, 0},
                                                          {SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1}}};
  for (const auto& [setting, value] : kSettings) {
    sqlite3_db_config(handle, setting, value, nullptr);
  }
  sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, kLongestRow);
}

}  // namespace

Result<Database> Database::open(const std::string& file) {
  Database database;
  sqlite3* handle = nullptr;
  const int status =
      sqlite3_open_v2(file.c_str(), &handle,
                      SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  database.handle_.reset(handle);
  if (status != SQLITE_OK) {
    return fail(Errc::kState, handle != nullptr ? reason_of(handle) : sqlite3_errstr(status));
  }
  distrust(handle);
  return database;
}

void Database::tidy_up_at_close(bool tidy) {
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, tidy ? 0 : 1, nullptr);
}

bool Database::is_gone() const {
  int gone = 0;
  return sqlite3_file_control(handle_.get(), "main", SQLITE_FCNTL_HAS_MOVED, &gone) == SQLITE_OK &&
         gone != 0;
}

Result<void> Database::run(const char* sql) {
  if (sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK)
    return failed(handle_.get());
  return {};
}

bool Database::is_damaged() const {
  switch (sqlite3_errcode(handle_.get())) {
    case SQLITE_PERM:
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_NOMEM:
    case SQLITE_READONLY:
    case SQLITE_INTERRUPT:
    case SQLITE_IOERR:
    case SQLITE_FULL:
    case SQLITE_CANTOPEN:
    case SQLITE_PROTOCOL:
    case SQLITE_NOLFS:
    case SQLITE_AUTH:
      return false;
    default:
      return true;
  }
}

Result<void> Database::atomically(const std::function<Result<void>()>& write) {
  auto done = run("BEGIN IMMEDIATE");
  if (done) done = write();
  if (done) done = run("COMMIT");
  // Some failures have already ended the transaction.
  if (!done && sqlite3_get_autocommit(handle_.get()) == 0) (void)run("ROLLBACK");
  return done;
}

Result<std::int64_t> Database::number(const char* sql) {
  auto statement = Statement::prepare(*this, sql);
  if (!statement) return tl::unexpected(std::move(statement.error()));
  auto row = statement->start();
  if (!row) return tl::unexpected(std::move(row.error()));
  return *row ? static_cast<std::int64_t>(statement->number(0)) : 0;
}

Result<std::string> Database::text(const char* sql) {
  auto statement = Statement::prepare(*this, sql);
  if (!statement) return tl::unexpected(std::move(statement.error()));
  auto row = statement->start();
  if (!row) return tl::unexpected(std::move(row.error()));
  return *row ? statement->text(0) : std::string();
}

Result<Statement> Statement::prepare(const Database& database, const char* sql) {
  sqlite3_stmt* handle = nullptr;
  if (sqlite3_prepare_v3(database.get(), sql, -1, SQLITE_PREPARE_PERSISTENT, &handle, nullptr) !=
      SQLITE_OK) {
    return failed(database.get());
  }
  Statement statement;
  statement.handle_.reset(handle);
  return statement;
}

Result<bool> Statement::next() {
  const int status = sqlite3_step(handle_.get());
  if (status == SQLITE_ROW) return true;
  if (status == SQLITE_DONE) return false;
  return failed(sqlite3_db_handle(handle_.get()));
}

Result<void> Statement::check_types(std::initializer_list<int> types) const {
  int column = 0;
  for (const int type : types) {
    if (sqlite3_column_type(handle_.get(), column) != type) {
      return fail(Errc::kState, std::string("a value of another type in column ") +
                                    sqlite3_column_name(handle_.get(), column));
    }
    ++column;
  }
  return {};
}

std::string Statement::text(int column) const {
  const auto* text = static_cast<const char*>(sqlite3_column_blob(handle_.get(), column));
  const int size = sqlite3_column_bytes(handle_.get(), column);
  return text != nullptr ? std::string(text, static_cast<std::size_t>(size)) : std::string();
}

double Statement::real(int column) const { return sqlite3_column_double(handle_.get(), column); }

std::uint64_t Statement::number(int column) const {
  return static_cast<std::uint64_t>(sqlite3_column_int64(handle_.get(), column));
}

Result<Transform> Statement::transform(int column) const {
  Flat flat{};
  const void* blob = sqlite3_column_blob(handle_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(handle_.get(), column));
  if (blob == nullptr || (size != sizeof flat && size != kPoseBytes)) {
    return fail(Errc::kState, "a transform of " + std::to_string(size) + " bytes");
  }
  std::memcpy(flat.data(), blob, size);
  auto X = computed_from(flat);
  if (X) X->covariance.set_complete(size == sizeof flat);
  return X;
}

void Statement::bind(int at, const std::string& text) {
  sqlite3_bind_text(handle_.get(), at, text.data(), static_cast<int>(text.size()),
                    SQLITE_TRANSIENT);
}

void Statement::bind(int at, std::uint64_t number) {
  sqlite3_bind_int64(handle_.get(), at, static_cast<sqlite3_int64>(number));
}

void Statement::bind(int at, double number) { sqlite3_bind_double(handle_.get(), at, number); }

void Statement::bind(int at, const Transform& X) {
  const Flat flat = to_flat(X);
  const std::size_t size = X.covariance.complete() ? sizeof flat : kPoseBytes;
  sqlite3_bind_blob(handle_.get(), at, flat.data(), static_cast<int>(size), SQLITE_TRANSIENT);
}

void Statement::bind(int at, const Blob& blob) {
  // An empty blob must not become NULL.
  const char* bytes = blob.bytes.empty() ? "" : blob.bytes.data();
  sqlite3_bind_blob(handle_.get(), at, bytes, static_cast<int>(blob.bytes.size()),
                    SQLITE_TRANSIENT);
}

}  // namespace tfdude::sqlite
