#include "store/read_state.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include "tfdude/base/id.hpp"

#include "store/rows.hpp"
#include "store/schema.hpp"

namespace tfdude {
namespace {

using sqlite::Database;
using sqlite::each_row;
using sqlite::Statement;

// The frames are sorted by id. @return null if there is no such frame
template <class Frame>
Frame* find_frame(std::vector<Frame>& frames, const std::string& id) {
  const auto at =
      std::lower_bound(frames.begin(), frames.end(), id,
                       [](const Frame& frame, const std::string& to) { return frame.id < to; });
  return at != frames.end() && at->id == id ? &*at : nullptr;
}

Result<void> load_about(const Database& database, std::int64_t /*format*/, StoredState& state) {
  return each_row(database, "SELECT epoch FROM about", [&](const Statement& row) -> Result<void> {
    if (auto ok = row.check_types({SQLITE_INTEGER}); !ok) return ok;
    const auto epoch = read_count(row, 0);
    if (!epoch) return tl::unexpected(epoch.error());
    state.epoch = *epoch;
    return {};
  });
}

Result<void> load_frames(const Database& database, std::int64_t /*format*/, StoredState& state) {
  const char* sql = "SELECT id, parent, x_pc, since FROM frames ORDER BY id";
  return each_row(database, sql, [&](const Statement& row) -> Result<void> {
    auto ok = row.check_types({SQLITE_TEXT, SQLITE_TEXT, SQLITE_BLOB, SQLITE_INTEGER});
    if (!ok) return ok;
    auto frame = read_frame(row, state.frames.empty() ? "" : state.frames.back().id);
    if (!frame) return tl::unexpected(std::move(frame.error()));
    const auto lamport_time = read_count(row, 3);
    if (!lamport_time) return tl::unexpected(lamport_time.error());
    state.frames.push_back({frame->id, frame->parent, frame->X_PC, *lamport_time});
    return {};
  });
}

Result<void> load_tombstones(const Database& database, std::int64_t /*format*/,
                             StoredState& state) {
  const char* sql = "SELECT id, since, kind, rival FROM notes ORDER BY id";
  auto loaded = each_row(database, sql, [&](const Statement& row) -> Result<void> {
    auto ok = row.check_types({SQLITE_TEXT, SQLITE_INTEGER, SQLITE_INTEGER, SQLITE_TEXT});
    if (!ok) return ok;
    auto tombstone =
        read_tombstone(row, state.tombstones.empty() ? "" : state.tombstones.back().id);
    if (!tombstone) return tl::unexpected(std::move(tombstone.error()));
    state.tombstones.push_back(*std::move(tombstone));
    return {};
  });
  // The oldest come first, because they are dropped first.
  std::stable_sort(
      state.tombstones.begin(), state.tombstones.end(),
      [](const Tombstone& a, const Tombstone& b) { return a.lamport_time < b.lamport_time; });
  return loaded;
}

Result<void> load_configured(const Database& database, std::int64_t format, StoredState& state) {
  state.omitted_was_exact = format < kUnspecifiedFormat;
  const char* sql = "SELECT id, parent, x_pc FROM configured ORDER BY id";
  return each_row(database, sql, [&](const Statement& row) -> Result<void> {
    auto ok = row.check_types({SQLITE_TEXT, SQLITE_TEXT, SQLITE_BLOB});
    if (!ok) return ok;
    // One that was damaged, see erase_rows().
    if (row.bytes(2).empty()) {
      state.unknown_entries.insert(row.text(0));
      return check_id(row.text(0), "id");
    }
    auto frame = read_frame(row, state.configured.empty() ? "" : state.configured.back().id);
    if (!frame) return tl::unexpected(std::move(frame.error()));
    state.configured.push_back(*std::move(frame));
    return {};
  });
}

// Each joint must belong to an entry.
Result<void> load_entry_joints(const Database& database, std::int64_t format, StoredState& state) {
  if (format < kEntryJointsFormat) {
    for (const FrameSpec& entry : state.configured) state.configured_joints[entry.id] = {};
    return {};
  }
  const char* sql = "SELECT id, name, follows FROM configured_joints";
  return each_row(database, sql, [&](const Statement& row) -> Result<void> {
    auto joint = read_entry_joint(row);
    if (!joint) return tl::unexpected(std::move(joint.error()));
    if (find_frame(state.configured, row.text(0)) == nullptr) {
      return fail(Errc::kState, "a joint of " + quote(row.text(0)) + ", which does not exist");
    }
    state.configured_joints[row.text(0)] = *std::move(joint);
    return {};
  });
}

Result<void> load_joints(const Database& database, std::int64_t format, StoredState& state) {
  if (format < kJointsFormat) return {};
  const char* sql = format < kCorrelationFormat
                        ? "SELECT name, position, variance, 0 FROM joints ORDER BY name"
                        : "SELECT name, position, variance, coalesce(type, 0) FROM joints "
                          "LEFT JOIN joint_types USING(name) ORDER BY name";
  return each_row(database, sql, [&](const Statement& row) -> Result<void> {
    auto joint = read_joint(row);
    if (!joint) return tl::unexpected(std::move(joint.error()));
    state.joints.push_back(*std::move(joint));
    return {};
  });
}

Result<void> load_absent(const Database& database, std::int64_t format, StoredState& state) {
  if (format < kAbsentFormat) return {};
  const char* sql = "SELECT partition, since, kind, incarnation FROM absent ORDER BY partition";
  return each_row(database, sql, [&](const Statement& row) -> Result<void> {
    auto absent = read_absent(row);
    if (!absent) return tl::unexpected(std::move(absent.error()));
    state.absent.push_back(*std::move(absent));
    return {};
  });
}

// Each stamp must belong to a stored frame.
Result<void> load_times(const Database& database, std::int64_t format, StoredState& state) {
  if (format < kSamplesFormat) return {};
  const char* sql = "SELECT id, stamp FROM samples";
  return each_row(database, sql, [&](const Statement& row) -> Result<void> {
    auto time = read_time(row);
    if (!time) return tl::unexpected(std::move(time.error()));
    StoredFrame* frame = find_frame(state.frames, row.text(0));
    if (frame == nullptr) {
      return fail(Errc::kState, "a sample of " + quote(row.text(0)) + ", which does not exist");
    }
    frame->time = *time;
    return {};
  });
}

// Each correlation must belong to a stored frame or configuration entry.
Result<void> load_correlations(const Database& database, std::int64_t format, StoredState& state) {
  if (format < kCorrelationFormat) return {};
  const auto nobody = [](const Statement& row) {
    return fail(Errc::kState, "correlation of " + quote(row.text(0)) + ", which does not exist");
  };
  const auto of_frame = [&](const Statement& row) -> Result<void> {
    auto correlation = read_stored_correlation(row);
    if (!correlation) return tl::unexpected(std::move(correlation.error()));
    StoredFrame* frame = find_frame(state.frames, row.text(0));
    if (frame == nullptr) return nobody(row);
    frame->correlation = *std::move(correlation);
    return {};
  };
  auto loaded = each_row(database, "SELECT id, said, observed FROM ties", of_frame);
  if (!loaded) return loaded;
  const auto of_entry = [&](const Statement& row) -> Result<void> {
    auto said = read_said(row);
    if (!said) return tl::unexpected(std::move(said.error()));
    FrameSpec* entry = find_frame(state.configured, row.text(0));
    if (entry == nullptr) return nobody(row);
    entry->correlation = *std::move(said);
    return {};
  };
  return each_row(database, "SELECT id, said FROM configured_ties", of_entry);
}

}  // namespace

Result<StoredState> read_state(const Database& database, std::int64_t format) {
  StoredState state;
  for (auto part : {load_about, load_frames, load_tombstones, load_configured, load_entry_joints,
                    load_joints, load_correlations, load_absent, load_times}) {
    if (auto loaded = part(database, format, state); !loaded) {
      return tl::unexpected(std::move(loaded.error()));
    }
  }
  return state;
}

}  // namespace tfdude
