#include "store/sqlite_store.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include "tfdude/base/id.hpp"

#include "base/log.hpp"
#include "partition/incarnation.hpp"
#include "partition/joints.hpp"
#include "store/correlation_blob.hpp"
#include "store/log_check.hpp"
#include "store/log_room.hpp"
#include "store/read_state.hpp"
#include "store/row_sums.hpp"
#include "store/rows.hpp"
#include "store/schema.hpp"
#include "store/sqlite.hpp"

namespace tfdude {
namespace {

using sqlite::Blob;
using sqlite::Database;
using sqlite::each_row;
using sqlite::Statement;

constexpr const char* kKeep =
    "; it was not changed. Keep it, and make the file and its directory readable and writable";

std::string without_spaces(std::string_view text) {
  std::string plain;
  std::copy_if(text.begin(), text.end(), std::back_inserter(plain),
               [](char c) { return c != ' ' && c != '\n' && c != ';'; });
  return plain;
}

class SqliteStore final : public StateStore {
 public:
  SqliteStore(std::string file, StoreSync sync)
      : file_(std::move(file)), sync_(sync), room_(file_ + "-wal") {}

  ~SqliteStore() override;
  SqliteStore(const SqliteStore&) = delete;
  SqliteStore& operator=(const SqliteStore&) = delete;

  Result<void> open(const std::string& partition);
  /// The same, but leaves out the changes of a damaged log.
  Result<void> open_without_damage(const std::string& partition);

  Result<StoredState> load() override;
  Result<void> save(const StateChange& change) override;
  Result<void> make_room() override;

  /// Erases the rows that are wrong. @return each of them
  Result<std::vector<std::string>> drop_wrong_rows();

 private:
  [[nodiscard]] tl::unexpected<Error> unusable(const std::string& why) const;
  [[nodiscard]] tl::unexpected<Error> unreadable(const std::string& why) const;
  Result<void> lock();
  Result<void> check_log();
  Result<void> check(const std::string& partition);
  Result<void> check_tables(std::int64_t format);
  Result<void> bring_up_to_date();
  Result<void> create(const std::string& partition);
  Result<void> prepare();
  Result<void> prepare_newer();
  Result<void> prepare(Statement& statement, const char* sql);
  Result<void> make_ready();
  Result<void> save_frames(const StateChange& change);
  Result<void> save_values(const std::vector<ChangedEdge>& edges);
  Result<void> erase_joints(const std::vector<std::string>& names);
  Result<void> save_joints(const std::vector<StoredJoint>& joints);
  Result<void> save_configured(const std::vector<FrameSpec>& frames);
  Result<void> save_absent(const std::vector<Absent>& absent);
  Result<void> save_correlation(const std::string& id, const StoredCorrelation& correlation);
  Result<void> save_time(const std::string& id, const StoredTime& time);

  const std::string file_;
  const StoreSync sync_;
  LogRoom room_;
  std::string partition_;
  std::optional<Database> database_;
  bool drops_damage_ = false;  // of the log
  std::optional<std::string> dropped_;
  bool ready_ = false;             // to be written to
  bool written_ = false;           // by this process
  std::int64_t format_ = kFormat;  // of the file as it is
  Statement set_epoch_;
  Statement erase_frame_;
  Statement erase_tombstone_;
  Statement put_frame_;
  Statement put_tombstone_;
  Statement set_value_;
  Statement put_configured_;
  // For tables that older formats lack.
  Statement erase_joint_;
  Statement erase_joint_type_;
  Statement put_joint_;
  Statement put_joint_type_;
  Statement erase_correlation_;
  Statement put_correlation_;
  Statement put_configured_correlation_;
  Statement put_configured_joint_;
  Statement clear_absent_;
  Statement put_absent_;
  Statement erase_sample_;
  Statement put_sample_;
  RowSums sums_;
};

tl::unexpected<Error> SqliteStore::unusable(const std::string& why) const {
  return fail(Errc::kState, "state file " + quote(file_) + " " + why);
}

// Advises to move the file away only if it is known to be damaged.
tl::unexpected<Error> SqliteStore::unreadable(const std::string& why) const {
  if (!database_->is_damaged()) {
    return unusable("cannot be used: " + printable(why) + kKeep);
  }
  return unusable("is damaged (" + printable(why) +
                  "): move it away to start from the configuration, or put a copy of it back");
}

// The log of another file that is there now is not removed.
SqliteStore::~SqliteStore() {
  if (ready_ && database_->is_gone()) database_->tidy_up_at_close(false);
}

Result<void> SqliteStore::open_without_damage(const std::string& partition) {
  drops_damage_ = true;
  return open(partition);
}

Result<void> SqliteStore::open(const std::string& partition) {
  partition_ = partition;
  std::error_code error;
  std::filesystem::create_directories(std::filesystem::path(file_).parent_path(), error);
  std::error_code none;
  if (std::filesystem::file_size(file_, none) == 0 && !none) {
    log().warn("state file {} is empty: the partition starts from its configuration", quote(file_));
  }
  auto opened = error ? fail(Errc::kState, error.message()) : Database::open(file_);
  if (!opened) return unusable("cannot be opened: " + opened.error().message);
  database_ = std::move(*opened);
  if (auto installed = RowSums::install(*database_); !installed) return installed;
  if (database_->is_read_only()) {
    return unusable(std::string("can only be read (SQLite code 8)") + kKeep);
  }
  if (auto checked = check(partition); !checked) return checked;
  if (auto prepared = prepare(); !prepared) return unreadable(prepared.error().message);
  return {};
}

// Only one process at a time opens the file, so the log needs no shared memory.
Result<void> SqliteStore::lock() {
  auto locked = database_->run("PRAGMA busy_timeout = 200; PRAGMA locking_mode = EXCLUSIVE;");
  if (locked) locked = database_->run("BEGIN IMMEDIATE; ROLLBACK;");
  if (locked) return {};
  const bool busy = database_->code() == SQLITE_BUSY;
  return busy ? unusable("is in use by another process: is the partition served already?")
              : unreadable(locked.error().message);
}

// Nobody else writes the log now.
Result<void> SqliteStore::check_log() {
  const std::string log = file_ + "-wal";
  const auto damaged = find_damage(log);
  if (!damaged) return {};
  if (drops_damage_) {
    dropped_ = to_string(*damaged, log);
    return {};
  }
  return unusable("is damaged (a checksum is wrong: " + to_string(*damaged, log) +
                  "): put a copy of both files back, move both away to start from the "
                  "configuration, or leave these changes out with tfduded --drop-damaged");
}

// Writes nothing before it is known that the file belongs to this partition or is new. Reads no
// table before it is known that they are plain tables.
Result<void> SqliteStore::check(const std::string& partition) {
  if (auto locked = lock(); !locked) return locked;
  if (auto whole = check_log(); !whole) return whole;
  const auto application = database_->number("PRAGMA application_id");
  const auto format = database_->number("PRAGMA user_version");
  const auto tables = database_->number("SELECT count(*) FROM sqlite_master");
  if (!application) return unreadable(application.error().message);
  if (!format) return unreadable(format.error().message);
  if (!tables) return unreadable(tables.error().message);
  if (*tables == 0 && *application == 0 && *format == 0) return create(partition);
  if (*application != kApplication) {
    return unusable("belongs to another program: name another directory, or move it away");
  }
  if (*format < 1 || *format > kFormat) {
    return unusable("has format " + std::to_string(*format) + "; this version reads formats 1 to " +
                    std::to_string(kFormat) +
                    ": use the version that wrote it, or move it away to start from the "
                    "configuration");
  }
  if (auto checked = check_tables(*format); !checked) return unreadable(checked.error().message);
  const auto of = database_->text("SELECT partition FROM about");
  if (!of) return unreadable(of.error().message);
  format_ = *format;
  if (*of == partition) return {};
  return unusable("is of partition " + quote(*of) + ", not of " + quote(partition) +
                  ": move it away, or put the right one back");
}

// The file must contain exactly the tables of its format: no trigger, view or check that would run.
Result<void> SqliteStore::check_tables(std::int64_t format) {
  std::string schema;
  const char* sql = "SELECT type, sql FROM sqlite_master ORDER BY rowid";
  auto read = each_row(*database_, sql, [&](const Statement& row) -> Result<void> {
    schema += row.text(1);
    return row.check_types({SQLITE_TEXT, SQLITE_TEXT});
  });
  if (!read) return read;
  if (without_spaces(schema) != without_spaces(schema_of(format))) {
    return fail(Errc::kState, "its tables are not those of a state");
  }
  const auto sound = database_->text("PRAGMA quick_check(1)");
  if (!sound) return tl::unexpected(sound.error());
  const auto rows = database_->number("SELECT count(*) FROM about");
  if (!rows) return tl::unexpected(rows.error());
  if (*sound != "ok") return fail(Errc::kState, *sound);
  if (*rows != 1) return fail(Errc::kState, "it contains " + std::to_string(*rows) + " partitions");
  return {};
}

Result<void> SqliteStore::bring_up_to_date() {
  const std::string schema = schema_of(kFormat, format_);
  const std::string mark = "PRAGMA user_version = " + std::to_string(kFormat);
  auto done = database_->atomically([&] {
    auto made = database_->run(schema.c_str());
    if (made && format_ < kEntryJointsFormat) {
      // Their joints are not known.
      made = database_->run("INSERT INTO configured_joints SELECT id, '', '' FROM configured");
    }
    if (made) made = database_->run(mark.c_str());
    if (made) made = prepare_newer();
    if (!made) return made;
    // A row that is damaged must not get the checksum of what it says now.
    return format_ < kSumsFormat ? sums_.put_all() : sums_.put_all("configured_joints");
  });
  if (done) format_ = kFormat;
  return done;
}

Result<void> SqliteStore::create(const std::string& partition) {
  auto done = make_ready();
  if (done) {
    done = database_->atomically([&] {
      auto made = database_->run(schema_of(kFormat).c_str());
      if (!made) return made;
      auto about = Statement::prepare(*database_, "INSERT INTO about VALUES(?1, 0)");
      if (!about) return Result<void>(tl::unexpected(about.error()));
      made = about->run(partition);
      if (made) made = sums_.prepare(*database_);
      if (made) made = sums_.put_all();
      const std::string marks = "PRAGMA application_id = " + std::to_string(kApplication) +
                                "; PRAGMA user_version = " + std::to_string(kFormat);
      return made ? database_->run(marks.c_str()) : made;
    });
  }
  if (!done) return unusable("cannot be written: " + done.error().message);
  return {};
}

Result<void> SqliteStore::prepare() {
  const std::pair<Statement*, const char*> all[] = {
      {&set_epoch_, "UPDATE about SET epoch = ?1"},
      {&erase_frame_, "DELETE FROM frames WHERE id = ?1"},
      {&erase_tombstone_, "DELETE FROM notes WHERE id = ?1"},
      {&put_frame_, "INSERT OR REPLACE INTO frames VALUES(?1, ?2, ?3, ?4)"},
      {&put_tombstone_, "INSERT OR REPLACE INTO notes VALUES(?1, ?2, ?3, ?4)"},
      {&set_value_, "UPDATE frames SET x_pc = ?2 WHERE id = ?1"},
      {&put_configured_, "INSERT INTO configured VALUES(?1, ?2, ?3)"},
  };
  Result<void> done;
  for (const auto& [statement, sql] : all) {
    if (done) done = prepare(*statement, sql);
  }
  return done && format_ == kFormat ? prepare_newer() : done;
}

Result<void> SqliteStore::prepare_newer() {
  const std::pair<Statement*, const char*> all[] = {
      {&erase_joint_, "DELETE FROM joints WHERE name = ?1"},
      {&erase_joint_type_, "DELETE FROM joint_types WHERE name = ?1"},
      {&put_joint_, "INSERT OR REPLACE INTO joints VALUES(?1, ?2, ?3)"},
      {&put_joint_type_, "INSERT OR REPLACE INTO joint_types VALUES(?1, ?2)"},
      {&erase_correlation_, "DELETE FROM ties WHERE id = ?1"},
      {&put_correlation_,
       "INSERT INTO ties SELECT ?1, ?2, ?3 WHERE EXISTS(SELECT 1 FROM frames WHERE id = ?1)"},
      {&put_configured_correlation_, "INSERT INTO configured_ties VALUES(?1, ?2)"},
      {&put_configured_joint_, "INSERT INTO configured_joints VALUES(?1, ?2, ?3)"},
      {&clear_absent_, "DELETE FROM absent"},
      {&put_absent_, "INSERT INTO absent VALUES(?1, ?2, ?3, ?4)"},
      {&erase_sample_, "DELETE FROM samples WHERE id = ?1"},
      {&put_sample_,
       "INSERT OR REPLACE INTO samples SELECT ?1, ?2 WHERE EXISTS(SELECT 1 FROM frames WHERE id = "
       "?1)"},
  };
  Result<void> done;
  for (const auto& [statement, sql] : all) {
    if (done) done = prepare(*statement, sql);
  }
  return done ? sums_.prepare(*database_) : done;
}

Result<void> SqliteStore::prepare(Statement& statement, const char* sql) {
  auto prepared = Statement::prepare(*database_, sql);
  if (!prepared) return tl::unexpected(std::move(prepared.error()));
  statement = std::move(*prepared);
  return {};
}

Result<StoredState> SqliteStore::load() {
  auto state = read_state(*database_, format_);
  if (!state) return unreadable(state.error().message);
  if (format_ < kSumsFormat) return state;
  const auto wrong = find_wrong_rows(*database_, format_);
  if (!wrong) return unreadable(wrong.error().message);
  if (wrong->empty()) return state;
  std::string rows;
  for (const WrongRow& row : *wrong) rows += (rows.empty() ? "" : ", ") + to_string(row);
  return unusable(
      "is damaged (the checksum of these rows is wrong: " + rows +
      "): put a copy of it back, move it away to start from the configuration, or leave "
      "them out with tfduded --drop-damaged");
}

Result<std::vector<std::string>> SqliteStore::drop_wrong_rows() {
  std::vector<std::string> dropped;
  if (dropped_) {
    // Merges what is left of the log, and begins another.
    auto done = make_ready();
    if (done) done = database_->run("PRAGMA wal_checkpoint(TRUNCATE)");
    if (!done) return unusable("could not be mended: " + done.error().message);
    dropped.push_back(*dropped_);
  }
  if (format_ < kSumsFormat) return dropped;
  const auto wrong = find_wrong_rows(*database_, format_);
  if (!wrong) return unreadable(wrong.error().message);
  if (wrong->empty()) return dropped;
  auto done = make_ready();
  if (done) done = erase_rows(*database_, *wrong);
  if (!done) return unusable("could not be mended: " + done.error().message);
  for (const WrongRow& row : *wrong) dropped.push_back(to_string(row));
  return dropped;
}

Result<void> SqliteStore::make_ready() {
  if (ready_) return {};
  auto done = database_->run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL;");
  if (done) database_->tidy_up_at_close();
  if (done && format_ != kFormat) done = bring_up_to_date();
  ready_ = done.has_value();
  return done;
}

Result<void> SqliteStore::save(const StateChange& change) {
  if (auto ready = make_ready(); !ready)
    return unusable("cannot be written: " + ready.error().message);
  const bool relaxed = written_ && sync_ == StoreSync::kAtCheckpoints;
  if (relaxed && change.synced) {
    if (auto strict = database_->run("PRAGMA synchronous = FULL;"); !strict)
      return unusable("could not be written: " + strict.error().message);
  }
  auto done = database_->atomically([&]() -> Result<void> {
    Result<void> saved = save_frames(change);
    if (saved && change.absent) saved = save_absent(*change.absent);
    if (saved) saved = save_values(change.values);
    if (saved) saved = erase_joints(change.erased_joints);
    if (saved) saved = save_joints(change.joints);
    return saved && change.configured ? save_configured(*change.configured) : saved;
  });
  // The first change of a process is synced, and each with a new number of it: others will know the
  // number. After a power loss the clock may be behind it.
  if (done && sync_ == StoreSync::kAtCheckpoints && (!written_ || change.synced)) {
    done = database_->run("PRAGMA synchronous = NORMAL;");
  }
  written_ = written_ || done;
  if (!done) return unusable("could not be written: " + done.error().message);
  if (!database_->is_gone()) return {};
  return unusable(
      "was removed, moved or replaced while it was in use, so changes would be lost: put it back, "
      "or restart the process with what is there now");
}

// A log that was merged into the file is written from its beginning again.
Result<void> SqliteStore::make_room() {
  if (!written_ || room_.reserve()) return {};
  const auto blocked = database_->number("PRAGMA wal_checkpoint(RESTART)");
  if (blocked && *blocked == 0 && room_.is_inside()) return {};
  return unusable("has no room on its disk for another change" +
                  (blocked ? "" : ": " + blocked.error().message));
}

Result<void> SqliteStore::save_frames(const StateChange& change) {
  Result<void> done = set_epoch_.run(change.epoch);
  if (done) done = sums_.put("about", partition_);
  for (const std::string& id : change.erased) {
    if (done) done = erase_frame_.run(id);
    if (done) done = erase_correlation_.run(id);
    if (done) done = erase_sample_.run(id);
    if (done) done = erase_tombstone_.run(id);
    for (const char* table : {"frames", "ties", "samples", "notes"}) {
      if (done) done = sums_.erase(table, id);
    }
  }
  for (const StoredFrame& frame : change.frames) {
    if (done) done = put_frame_.run(frame.id, frame.parent, frame.X_PC, frame.lamport_time);
    if (done) done = sums_.put("frames", frame.id);
    if (done) done = save_correlation(frame.id, frame.correlation);
    if (done) done = save_time(frame.id, frame.time);
  }
  for (const Tombstone& tombstone : change.tombstones) {
    const auto kind = static_cast<std::uint64_t>(tombstone.kind);
    if (done)
      done = put_tombstone_.run(tombstone.id, tombstone.lamport_time, kind, tombstone.rival);
    if (done) done = sums_.put("notes", tombstone.id);
  }
  return done;
}

Result<void> SqliteStore::save_absent(const std::vector<Absent>& absent) {
  Result<void> done = clear_absent_.run();
  if (done) done = sums_.clear("absent");
  for (const Absent& one : absent) {
    // Others may have announced a number too large to be read back.
    const std::uint64_t incarnation = std::min(one.incarnation, IncarnationSource::kEnd);
    const auto kind = static_cast<std::uint64_t>(one.kind);
    const auto since = static_cast<std::uint64_t>(one.since);
    if (done) done = put_absent_.run(one.partition, since, kind, incarnation);
    if (done) done = sums_.put("absent", one.partition);
  }
  return done;
}

Result<void> SqliteStore::erase_joints(const std::vector<std::string>& names) {
  Result<void> done;
  for (const std::string& name : names) {
    if (done) done = erase_joint_.run(name);
    if (done) done = erase_joint_type_.run(name);
    if (done) done = sums_.erase("joints", name);
    if (done) done = sums_.erase("joint_types", name);
  }
  return done;
}

Result<void> SqliteStore::save_joints(const std::vector<StoredJoint>& joints) {
  Result<void> done;
  for (const StoredJoint& joint : joints) {
    const auto type = joint.type ? static_cast<std::uint64_t>(*joint.type) : kNoType;
    const double variance = joint.variance.value_or(kUnspecifiedVariance);
    if (done) done = put_joint_.run(joint.name, joint.position, variance);
    if (done) done = put_joint_type_.run(joint.name, type);
    if (done) done = sums_.put("joints", joint.name);
    if (done) done = sums_.put("joint_types", joint.name);
  }
  return done;
}

Result<void> SqliteStore::save_correlation(const std::string& id,
                                           const StoredCorrelation& correlation) {
  auto done = erase_correlation_.run(id);
  if (done) done = sums_.erase("ties", id);
  if (!done || correlation.empty()) return done;
  const Blob observed{observed_blob(correlation)};
  done = put_correlation_.run(id, Blob{to_blob(correlation.said)}, observed);
  return done ? sums_.put("ties", id) : done;
}

Result<void> SqliteStore::save_time(const std::string& id, const StoredTime& time) {
  if (!time.stamp && !time.cleared) {
    auto done = erase_sample_.run(id);
    return done ? sums_.erase("samples", id) : done;
  }
  const std::int64_t stamp = time.stamp ? nanoseconds(*time.stamp) : kClearedStamp;
  auto done = put_sample_.run(id, static_cast<std::uint64_t>(stamp));
  return done ? sums_.put("samples", id) : done;
}

Result<void> SqliteStore::save_values(const std::vector<ChangedEdge>& edges) {
  Result<void> done;
  for (const ChangedEdge& edge : edges) {
    if (done) done = set_value_.run(edge.id, edge.X_PC);
    if (done) done = sums_.put("frames", edge.id);
    if (done) done = save_correlation(edge.id, edge.correlation);
    if (done) done = save_time(edge.id, edge.time);
  }
  return done;
}

Result<void> SqliteStore::save_configured(const std::vector<FrameSpec>& frames) {
  Result<void> done = database_->run(
      "DELETE FROM configured; DELETE FROM configured_ties; DELETE FROM configured_joints;");
  for (const char* table : {"configured", "configured_ties", "configured_joints"}) {
    if (done) done = sums_.clear(table);
  }
  for (const FrameSpec& frame : frames) {
    if (done) done = put_configured_.run(frame.id, frame.parent, value_of(frame));
    if (done) done = sums_.put("configured", frame.id);
    if (!done || frame.correlation.empty()) continue;
    done = put_configured_correlation_.run(frame.id, Blob{to_blob(frame.correlation)});
    if (done) done = sums_.put("configured_ties", frame.id);
  }
  for (const auto& [id, joint] : joints_of(frames)) {
    if (done) done = put_configured_joint_.run(id, joint.name, joint.follows);
    if (done) done = sums_.put("configured_joints", id);
  }
  return done;
}

}  // namespace

Result<std::unique_ptr<StateStore>> open_sqlite_store(const std::string& file,
                                                      const std::string& partition,
                                                      StoreSync sync) {
  auto store = std::make_unique<SqliteStore>(file, sync);
  if (auto opened = store->open(partition); !opened) return tl::unexpected(opened.error());
  return store;
}

Result<std::vector<std::string>> drop_wrong_rows(const std::string& file,
                                                 const std::string& partition) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return std::vector<std::string>();
  SqliteStore store(file, StoreSync::kEachChange);
  if (auto opened = store.open_without_damage(partition); !opened) {
    return tl::unexpected(opened.error());
  }
  return store.drop_wrong_rows();
}

}  // namespace tfdude
