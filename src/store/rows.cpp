#include "store/rows.hpp"

#include "tfdude/base/id.hpp"

#include "partition/counters.hpp"
#include "partition/joints.hpp"
#include "store/correlation_blob.hpp"
#include "store/schema.hpp"

namespace tfdude {
Result<std::uint64_t> read_count(const sqlite::Statement& row, int column) {
  const std::uint64_t count = row.number(column);
  if (count > kLastCounter) return fail(Errc::kState, "a time of " + std::to_string(count));
  return count;
}

// Reads a frame from a row and checks it. Rows come in the order of their ids.
Result<FrameSpec> read_frame(const sqlite::Statement& row, const std::string& before) {
  FrameSpec frame{row.text(0), row.text(1), {}};
  if (auto ok = check_id(frame.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  if (frame.id <= before) return fail(Errc::kState, "frame " + quote(frame.id) + " out of order");
  if (!frame.parent.empty()) {
    if (auto ok = check_id(frame.parent, "parent"); !ok) return tl::unexpected(ok.error());
  }
  const auto X_PC = row.transform(2);
  if (!X_PC) return fail_at("frame " + quote(frame.id), X_PC.error());
  frame.X_PC = *X_PC;
  return frame;
}

Result<Tombstone> read_tombstone(const sqlite::Statement& row, const std::string& before) {
  const std::uint64_t kind = row.number(2);
  const auto lamport_time = read_count(row, 1);
  if (!lamport_time) return tl::unexpected(lamport_time.error());
  Tombstone tombstone{row.text(0), *lamport_time, static_cast<Tombstone::Kind>(kind), row.text(3)};
  if (auto ok = check_id(tombstone.id, "id"); !ok) return tl::unexpected(ok.error());
  if (tombstone.id <= before)
    return fail(Errc::kState, "tombstone of " + quote(tombstone.id) + " out of order");
  if (kind < 1 || kind > static_cast<std::uint64_t>(Tombstone::Kind::kDropped)) {
    return fail(Errc::kState, "a tombstone of kind " + std::to_string(kind));
  }
  if (!tombstone.rival.empty()) {
    if (auto ok = check_partition_name(tombstone.rival); !ok) return tl::unexpected(ok.error());
  }
  return tombstone;
}

Result<Correlation> read_said(const sqlite::Statement& row) {
  auto ok = row.check_types({SQLITE_TEXT, SQLITE_BLOB});
  if (ok) ok = check_id(row.text(0), "id");
  if (!ok) return tl::unexpected(std::move(ok.error()));
  auto said = correlation_from(row.bytes(1));
  if (!said) return fail_at("correlation of " + quote(row.text(0)), said.error());
  return said;
}

Result<PageJoint> read_entry_joint(const sqlite::Statement& row) {
  auto ok = row.check_types({SQLITE_TEXT, SQLITE_TEXT, SQLITE_TEXT});
  PageJoint joint{row.text(1), row.text(2)};
  if (ok) ok = check_id(row.text(0), "id");
  if (ok && !joint.name.empty()) ok = check_id(joint.name, "joint");
  if (ok && !joint.follows.empty()) ok = check_id(joint.follows, "joint");
  if (!ok) return tl::unexpected(std::move(ok.error()));
  return joint;
}

Result<StoredCorrelation> read_stored_correlation(const sqlite::Statement& row) {
  if (auto ok = row.check_types({SQLITE_TEXT, SQLITE_BLOB, SQLITE_BLOB}); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  auto said = read_said(row);
  if (!said) return tl::unexpected(std::move(said.error()));
  StoredCorrelation correlation{*std::move(said), {}};
  if (const std::string bytes = row.bytes(2); !bytes.empty()) {
    auto ok = read_observed(bytes, correlation);
    if (!ok) return fail_at("correlation of " + quote(row.text(0)), ok.error());
  }
  return correlation;
}

Result<StoredJoint> read_joint(const sqlite::Statement& row) {
  if (auto ok = row.check_types({SQLITE_TEXT, SQLITE_FLOAT, SQLITE_FLOAT, SQLITE_INTEGER}); !ok) {
    return tl::unexpected(std::move(ok.error()));
  }
  StoredJoint joint{row.text(0), row.real(1), row.real(2)};
  if (*joint.variance == kUnspecifiedVariance) joint.variance.reset();
  auto ok = check_id(joint.name, "joint");
  if (ok) ok = check_value({joint.name, joint.position, joint.variance});
  if (!ok) return tl::unexpected(std::move(ok.error()));
  const auto type = row.number(3);
  if (type == kNoType) return joint;
  if (type > static_cast<std::uint64_t>(JointType::kPrismatic)) {
    return fail(Errc::kState, "joint " + quote(joint.name) + " of type " + std::to_string(type));
  }
  joint.type = static_cast<JointType>(type);
  return joint;
}

Result<StoredTime> read_time(const sqlite::Statement& row) {
  auto ok = row.check_types({SQLITE_TEXT, SQLITE_INTEGER});
  if (ok) ok = check_id(row.text(0), "id");
  if (!ok) return tl::unexpected(std::move(ok.error()));
  const auto stamp = static_cast<std::int64_t>(row.number(1));
  if (stamp == kClearedStamp) return StoredTime{std::nullopt, true};
  if (stamp >= 0) return StoredTime{time_of(stamp), false};
  return fail(Errc::kState,
              "frame " + quote(row.text(0)) + ": a stamp of " + std::to_string(stamp) + " ns");
}

Result<Absent> read_absent(const sqlite::Statement& row) {
  auto ok = row.check_types({SQLITE_TEXT, SQLITE_INTEGER, SQLITE_INTEGER, SQLITE_INTEGER});
  const std::string partition = row.text(0);
  if (ok) ok = check_partition_name(partition);
  if (!ok) return tl::unexpected(std::move(ok.error()));
  const std::uint64_t kind = row.number(2);
  if (kind < 1 || kind > static_cast<std::uint64_t>(Absent::Kind::kForgotten)) {
    return fail(Errc::kState, "an absence of kind " + std::to_string(kind));
  }
  const auto incarnation = read_count(row, 3);
  if (!incarnation) return tl::unexpected(incarnation.error());
  const auto since = static_cast<std::int64_t>(row.number(1));
  return Absent{partition, since, static_cast<Absent::Kind>(kind), *incarnation};
}

}  // namespace tfdude
