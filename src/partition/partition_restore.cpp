#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/id.hpp"

#include "partition/partition.hpp"
#include "partition/reconfigure.hpp"

// Restores a partition from its stored state, and yields frames that others have taken meanwhile.
namespace tfdude {
namespace {

std::map<std::string, const FrameSpec*> by_id(const std::vector<FrameSpec>& frames) {
  std::map<std::string, const FrameSpec*> all;
  for (const FrameSpec& frame : frames) all.emplace(frame.id, &frame);
  return all;
}

// The frame at the position that its joint was left in.
FrameSpec as_left(FrameSpec frame, const std::vector<StoredJoint>& joints) {
  if (!frame.joint) return frame;
  if (const auto left = left_of(*frame.joint, joints)) {
    frame.joint->position = left->position;
    frame.joint->variance = left->variance;
  }
  return frame;
}

// Of an edge whose joint says its value anew: what was observed before has the same error.
StoredCorrelation with_unknown(const Correlation& said) {
  StoredCorrelation correlation{said, Correlation(), {}};
  correlation.observed->unknown = true;
  return correlation;
}

// Those of these frames that were observed, and are where their joints were left.
std::vector<const FrameSpec*> observed_joints(const std::vector<FrameSpec>& frames,
                                              const StoredState& state,
                                              const std::vector<StoredJoint>& joints) {
  std::set<std::string_view> observed;
  for (const StoredFrame& frame : state.frames) {
    if (frame.correlation.observed) observed.insert(frame.id);
  }
  std::vector<const FrameSpec*> found;
  for (const FrameSpec& frame : frames) {
    if (!frame.joint || observed.count(frame.id) == 0) continue;
    if (left_of(*frame.joint, joints)) found.push_back(&frame);
  }
  return found;
}

// Whether the joint says the pose that it said before the edge was observed.
bool says_as_before(const StoredFrame& frame, const Pose& said) {
  constexpr double kRounding = 1e-9;
  const auto& given = frame.correlation.given;
  return given && (given->matrix() - said.matrix()).cwiseAbs().maxCoeff() <=
                      kRounding * (1 + said.translation().norm());
}

// The stored frames. Frames moved by joints are at the joints' stored positions, computed from the
// current descriptions.
// @param joints  those of the state whose positions are still valid
std::vector<StoredFrame> frames_of(const StoredState& state, const std::vector<StoredJoint>& joints,
                                   const std::vector<FrameSpec>& configured) {
  const auto described = by_id(configured);
  std::vector<StoredFrame> frames = state.frames;
  for (StoredFrame& frame : frames) {
    const auto known = described.find(frame.id);
    if (known == described.end() || !known->second->joint) continue;
    if (known->second->parent != frame.parent) continue;
    if (!left_of(*known->second->joint, state.joints)) continue;
    const Transform X_PC = value_of(as_left(*known->second, joints));
    if (!left_of(*known->second->joint, joints)) {
      frame.time = {};  // its initial position is no sample
      frame.correlation.observed.reset();
    } else if (frame.correlation.observed) {
      if (says_as_before(frame, X_PC.pose)) continue;
      frame.correlation = with_unknown(frame.correlation.said);
    }
    frame.X_PC = X_PC;
  }
  return frames;
}

}  // namespace

Result<void> Partition::restore(const StoredState& state, const std::vector<FrameSpec>& configured,
                                Time now) {
  if (auto ok = check_joints(configured); !ok) return ok;
  const std::vector<StoredJoint> joints = still_meant(state, configured);
  const std::vector<StoredFrame> frames = frames_of(state, joints, configured);
  directory_.restore(state.absent);
  for (const StoredFrame& frame : frames) directory_.saw_lamport_time(frame.lamport_time);
  for (const Tombstone& tombstone : state.tombstones)
    directory_.saw_lamport_time(tombstone.lamport_time);
  // Takes all frames that no reachable partition has, before any of them is connected, so that the
  // order does not matter.
  std::vector<const StoredFrame*> kept;
  std::vector<const StoredFrame*> contested;
  for (const StoredFrame& frame : frames) {
    (directory_.take(frame.id, frame.lamport_time) ? kept : contested).push_back(&frame);
  }
  std::vector<const StoredFrame*> circular;
  for (const StoredFrame* frame : kept) {
    if (!hang_again(*frame)) circular.push_back(frame);
  }
  for (const Tombstone& tombstone : state.tombstones) leave(tombstone);
  pages_.resume(state.epoch);
  // Only later changes are not in the store.
  saved_ = true;
  if (!configured.empty()) configured_ = configured;
  pages_.watch_ids();
  for (const StoredFrame* frame : contested) {
    const Owner holder = directory_.holder(frame->id);
    if (directory_.handovers().has_kept(holder, frame->id, frame->lamport_time)) {
      unsaved_.insert(frame->id);
    } else {
      yield_to(frame->id, holder, now);
    }
  }
  for (const StoredFrame* frame : circular) make_root(*frame, now);
  resume_handovers(kept);
  directory_.moved();
  directory_.find_orphans();
  for (const PendingYield& one : directory_.removed_before()) yield(one, now);
  while (yield(pending_yields(), now)) {
  }
  auto taken = reconfigure(state, joints, configured, now);
  freeze_adopted();
  if (taken) attach_joints(configured, joints);
  // Without a configuration it is not known what they are.
  if (!configured.empty()) joints_.erase_unused(state.joints);
  pages_.close_epoch();
  return taken;
}

// If others have moved the parent below this frame meanwhile, the directory decides whose claim
// does not hold.
bool Partition::hang_again(const StoredFrame& frame) {
  const auto add = [&] {
    return forest_.add(frame.id, frame.parent, frame.X_PC, Forest::MissingParent::kAllow,
                       frame.lamport_time);
  };
  auto added = add();
  if (!added && added.error().code == Errc::kCycle && directory_.make_way(frame.parent)) {
    added = add();
  }
  if (!added) return false;
  (void)forest_.resume(frame.id, frame.correlation, frame.time);
  put(frame.id, frame.parent, frame.lamport_time);
  return true;
}

void Partition::make_root(const StoredFrame& frame, Time now) {
  const std::uint64_t lamport_time = directory_.next_lamport_time(now);
  if (!forest_.add(frame.id, {}, frame.X_PC, Forest::MissingParent::kAllow, lamport_time)) return;
  (void)forest_.resume(frame.id, frame.correlation, frame.time);
  put(frame.id, {}, lamport_time);
  tell_conflict({frame.id, lamport_time, Tombstone::Kind::kUnhung, name_});
}

Result<void> Partition::reconfigure(const StoredState& state,
                                    const std::vector<StoredJoint>& joints,
                                    const std::vector<FrameSpec>& configured, Time now) {
  using Kind = ConfiguredChange::Kind;
  const auto entries = by_id(configured);
  std::vector<FrameSpec> fresh;
  std::vector<std::string> dropped;
  for (const ConfiguredChange& change : configured_changes(state, configured)) {
    const std::string& id = change.frame;
    switch (change.kind) {
      case Kind::kReplace:
        // Another partition has it by now: it was yielded, and that was told.
        if (const auto there = forest_.info(id); there && there->owner != kHeldHere) break;
        // As the one that has not decided yet whether it keeps it knows it.
        if (handovers_.adopted.count(id) != 0) break;
        [[fallthrough]];
      case Kind::kAdd:
        fresh.push_back(as_left(*entries.at(id), joints));
        // The new parent may come later: a missing one is allowed here, as for loaded frames.
        release(id);
        break;
      case Kind::kCorrelate:
        if (!forest_.holds(id)) break;
        if (auto said = forest_.correlate(id, entries.at(id)->correlation); !said) return said;
        break;
      case Kind::kRemove:
        if (release(id, directory_.next_lamport_time(now))) dropped.push_back(id);
        break;
      case Kind::kRest:
      case Kind::kOrphan:
        break;
    }
  }
  if (auto taken = take(fresh, directory_.next_lamport_time(now)); !taken) return taken;
  for (const FrameSpec* frame : observed_joints(fresh, state, joints)) {
    (void)forest_.resume(frame->id, with_unknown(frame->correlation), {});
  }
  for (const std::string& id : dropped) tell_dropped(id);
  return {};
}

// Frames below wait for another frame of that name. If it is dropped, others must not remove them,
// as they do for a tombstone of a removed frame.
bool Partition::release(const std::string& id, std::optional<LamportTime> dropped) {
  if (!forest_.release(id)) return false;
  detach_joint(id);
  pages_.erase(id);
  if (dropped) leave({id, *dropped, Tombstone::Kind::kDropped, {}});
  directory_.released(id);
  return true;
}

Result<void> Partition::release(const std::vector<std::string>& ids, Time now) {
  for (const std::string& id : ids) {
    const auto there = forest_.info(id);
    if (!there) return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id), id);
    if (there->owner == kHeldHere && !forest_.is_frozen(id)) continue;
    if (there->owner == kHeldHere) return being_handed_over(id);
    return fail(Errc::kNotOwner, "frame " + quote(id) + " belongs to partition " +
                                     quote(directory_.name(there->owner)) + ", not to " +
                                     quote(name_));
  }
  for (const std::string& id : ids) {
    if (release(id, directory_.next_lamport_time(now))) tell_dropped(id);
  }
  pages_.close_epoch();
  return {};
}

void Partition::tell_dropped(const std::string& id) {
  directory_.changes().frame_removed(id, name_);
  directory_.report_orphans(id, kHeldHere);
}

bool Partition::yield(const std::set<PendingYield>& due, Time now) {
  using Kind = PendingYield::Kind;
  bool changed = false;
  // A release or removal may open a cycle, but not vice versa.
  for (const Kind kind : {Kind::kRelease, Kind::kRemove, Kind::kConcede, Kind::kUnhang}) {
    for (const PendingYield& one : pending_yields()) {
      if (one.kind == kind && due.count(one) != 0) changed = yield(one, now) || changed;
    }
  }
  if (changed) pages_.close_epoch();
  return changed;
}

bool Partition::yield(const PendingYield& pending, Time now) {
  // An earlier yield may have resolved this one, too, or be the same.
  const auto frame = forest_.info(pending.frame);
  if (!frame) return false;
  if (pending.kind == PendingYield::Kind::kConcede)
    return concede(pending.frame, pending.rival, now);
  if (frame->owner != kHeldHere) return false;
  switch (pending.kind) {
    case PendingYield::Kind::kRelease:
      (void)forest_.release(pending.frame);
      detach_joint(pending.frame);
      pages_.erase(pending.frame);
      yield_to(pending.frame, pending.rival, now);
      directory_.released(pending.frame);
      return true;
    case PendingYield::Kind::kUnhang:
      if (frame->parent.empty()) return false;
      make_root(pending.frame, pending.rival, now);
      return true;
    case PendingYield::Kind::kRemove:
      // As of the rival's removal: it must not end what others have claimed since.
      if (auto removed = forest_.remove(pending.frame, pending.removed_at)) {
        forget(*removed, pending.removed_at);
      }
      return true;
    case PendingYield::Kind::kConcede:
      break;
  }
  return false;
}

// What was only released belongs to whoever claims it: no conflict.
bool Partition::concede(const std::string& id, Owner rival, Time now) {
  const auto removal = pages_.tombstone(id);
  if (!removal) return false;
  if (removal->kind == Tombstone::Kind::kRemoved) {
    yield_to(id, rival, now);
  } else {
    pages_.forget_tombstone(id);
    directory_.forget_own_tombstone(id);
  }
  return true;
}

void Partition::yield_to(const std::string& id, Owner rival, Time now) {
  tell_conflict(
      {id, directory_.next_lamport_time(now), Tombstone::Kind::kYielded, directory_.name(rival)});
}

Result<void> Partition::forget_partition(const ForgetRequest& request, Time now) {
  if (auto ok = check_partition_name(request.partition); !ok) return ok;
  return directory_.forget(request.partition, request.incarnation, now);
}

void Partition::make_root(const std::string& id, Owner rival, Time now) {
  const std::uint64_t lamport_time = time_of_move(id, now);
  if (!forest_.move(id, {}, {}, lamport_time)) return;
  detach_joint(id);
  pages_.put(id, {}, lamport_time);
  directory_.changes().frame_moved(id, {}, name_);
  tell_conflict({id, lamport_time, Tombstone::Kind::kUnhung, directory_.name(rival)});
  directory_.moved();
}

void Partition::tell_conflict(const Tombstone& tombstone) {
  leave(tombstone);
  directory_.changes().add(conflict_of(tombstone, name_));
}

StateChange Partition::take_unsaved(bool values_due) {
  StateChange change;
  change.epoch = pages_.epoch();
  if (!saved_) return change;
  std::set<std::string> ids = pages_.take_touched();
  ids.merge(std::exchange(unsaved_, {}));
  for (const std::string& id : ids) {
    change.erased.push_back(id);
    if (auto tombstone = pages_.tombstone(id)) change.tombstones.push_back(*std::move(tombstone));
    const auto place = pages_.place(id);
    auto edge = forest_.kept(id);
    if (!place || !edge || handovers_.leaving.count(id) != 0) continue;
    change.frames.push_back({id, place->parent, edge->X_PC, place->lamport_time,
                             std::move(edge->correlation), edge->time});
  }
  // The first change of a process stores its incarnation, too, since the epoch is above it.
  auto absent = directory_.absent();
  if (saved_absent_ != absent) {
    saved_absent_ = absent;
    change.absent = std::move(absent);
  }
  change.erased_joints = joints_.take_erased();
  change.synced = std::exchange(overtook_, false);
  change.configured = std::exchange(configured_, std::nullopt);
  const bool values_asked = std::exchange(values_asked_, false);
  change.commits = {saved_commit_, saved_commit_};
  if (change.empty() && !values_due && !values_asked) return change;
  change.joints = joints_.take_changed();
  // After the frames, whose values may be older.
  change.commits.last = saved_commit_ = forest_.newest_commit();
  return change;
}

// Frames that are let go with this change are still held, and not stored any more.
void Partition::add_values(StateChange& change) const {
  if (change.commits.last <= change.commits.after) return;
  change.values = forest_.changed(change.commits);
  std::set<std::string_view> gone(change.erased.begin(), change.erased.end());
  for (const StoredFrame& frame : change.frames) gone.erase(frame.id);
  if (gone.empty()) return;
  auto& values = change.values;
  values.erase(std::remove_if(values.begin(), values.end(),
                              [&](const ChangedEdge& edge) { return gone.count(edge.id) != 0; }),
               values.end());
}

void Partition::still_unsaved(const StateChange& change, const std::vector<Page>& pages) {
  unsaved_.insert(change.erased.begin(), change.erased.end());
  joints_.still_changed(change.joints);
  joints_.still_erased(change.erased_joints);
  overtook_ = overtook_ || change.synced;
  if (change.absent) saved_absent_.reset();
  if (change.configured) configured_ = change.configured;
  values_asked_ = values_asked_ || change.commits.last > change.commits.after;
  saved_commit_ = change.commits.after;
  pages_.still_changed(pages);
}

}  // namespace tfdude
