#include "partition/change_log.hpp"

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

std::string under(std::string_view parent) {
  return parent.empty() ? " as a root" : " under " + quote(parent);
}

}  // namespace

std::string_view to_string(ChangeKind kind) {
  switch (kind) {
    case ChangeKind::kPartitionUp:
      return "partition_up";
    case ChangeKind::kPartitionDown:
      return "partition_down";
    case ChangeKind::kFrameAdded:
      return "frame_added";
    case ChangeKind::kFrameRemoved:
      return "frame_removed";
    case ChangeKind::kFrameMoved:
      return "frame_moved";
    case ChangeKind::kConflict:
      return "conflict";
    case ChangeKind::kHistoryRestarted:
      return "history_restarted";
    case ChangeKind::kFrameOrphaned:
      return "frame_orphaned";
    case ChangeKind::kFrameTakenOver:
      return "frame_taken_over";
    case ChangeKind::kMissed:
      return "missed";
    case ChangeKind::kJointConflict:
      return "joint_conflict";
  }
  return "unknown";
}

Change conflict_of(const Tombstone& tombstone, const std::string& partition) {
  Change change{ChangeKind::kConflict, partition, tombstone.id, {}, tombstone.rival, {}, {}};
  change.message = "frame " + quote(tombstone.id) + ": ";
  if (tombstone.kind == Tombstone::Kind::kYielded) {
    change.message += "claimed by partition " + quote(tombstone.rival) +
                      ", which keeps it, and by " + quote(partition) + ", which yields";
  } else {
    change.message += "its move by partition " + quote(partition) +
                      " forms a cycle with a move by " + quote(tombstone.rival) +
                      "; it is undone, and the frame becomes a root";
  }
  return change;
}

Change restarted(const HistoryRestart& restart, const std::string& partition) {
  return {ChangeKind::kHistoryRestarted,
          partition,
          restart.id,
          {},
          {},
          "frame " + quote(restart.id) + " of partition " + quote(partition) +
              ": history restarted at " + to_string(restart.stamp) +
              ": the clock of its source jumped back from " + to_string(restart.newest),
          {}};
}

Change orphan_of(const FrameInfo& frame, const std::string& partition,
                 const std::string& dropped_by) {
  return {ChangeKind::kFrameOrphaned,
          partition,
          frame.id,
          frame.parent,
          dropped_by,
          "frame " + quote(frame.id) + " of partition " + quote(partition) +
              " waits for its parent " + quote(frame.parent) +
              ", which the configuration of partition " + quote(dropped_by) + " no longer contains",
          {}};
}

void ChangeLog::partition_up(const std::string& partition, const std::string& host,
                             std::uint32_t pid) {
  if (!watched_) return;
  add({ChangeKind::kPartitionUp,
       partition,
       {},
       {},
       {},
       "partition " + quote(partition) + " is reachable (host " + host + ", pid " +
           std::to_string(pid) + ")",
       {}});
}

void ChangeLog::partition_down(const std::string& partition, bool stopped) {
  down(partition, stopped ? " was stopped" : " is lost: it no longer sends", stopped);
}

void ChangeLog::partition_replaced(const std::string& partition) {
  down(partition, " is lost: another process has taken its place", false);
}

void ChangeLog::down(const std::string& partition, const char* what, bool stopped) {
  if (!watched_) return;
  add({ChangeKind::kPartitionDown,
       partition,
       {},
       {},
       {},
       "partition " + quote(partition) + what,
       {},
       stopped});
}

void ChangeLog::frame_added(std::string_view id, std::string_view parent,
                            const std::string& partition) {
  if (!watched_) return;
  add({ChangeKind::kFrameAdded,
       partition,
       std::string(id),
       std::string(parent),
       {},
       "frame " + quote(id) + " of partition " + quote(partition) + " added" + under(parent),
       {}});
}

void ChangeLog::frame_moved(std::string_view id, std::string_view parent,
                            const std::string& partition) {
  if (!watched_) return;
  add({ChangeKind::kFrameMoved,
       partition,
       std::string(id),
       std::string(parent),
       {},
       "frame " + quote(id) + " of partition " + quote(partition) + " moved" + under(parent),
       {}});
}

void ChangeLog::frame_taken_over(std::string_view id, std::string_view parent,
                                 const std::string& partition, const std::string& before) {
  if (!watched_) return;
  add({ChangeKind::kFrameTakenOver,
       partition,
       std::string(id),
       std::string(parent),
       before,
       "frame " + quote(id) + " of partition " + quote(before) +
           ", which is not reachable, now belongs to " + quote(partition) + under(parent),
       {}});
}

void ChangeLog::frame_removed(std::string_view id, const std::string& partition) {
  if (!watched_) return;
  add({ChangeKind::kFrameRemoved,
       partition,
       std::string(id),
       {},
       {},
       "frame " + quote(id) + " of partition " + quote(partition) + " removed",
       {}});
}

}  // namespace tfdude
