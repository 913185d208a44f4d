#include "partition/reconfigure.hpp"

#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "tfdude/base/id.hpp"

#include "partition/joints.hpp"

namespace tfdude {
namespace {

using Kind = ConfiguredChange::Kind;

// A stored rotation is normalized again when read, which may change its last digit.
constexpr double kSameRotation = 1e-14;

// @param omitted_was_exact  see StoredState
bool same_edge(const FrameSpec& was, const FrameSpec& entry, bool omitted_was_exact) {
  const Transform X = value_of(was);
  const Transform Y = value_of(entry);
  const bool omitted = omitted_was_exact && X.covariance == StatedCovariance::exact() &&
                       Y.covariance == StatedCovariance::unspecified();
  return was.parent == entry.parent && (omitted || X.covariance == Y.covariance) &&
         X.pose.translation() == Y.pose.translation() &&
         X.pose.rotation().coeffs().isApprox(Y.pose.rotation().coeffs(), kSameRotation);
}

// Whether an entry that existed before has the joint that it had, by its name.
bool same_joint(const StoredState& state, const FrameSpec& entry) {
  const auto was = state.configured_joints.find(entry.id);
  if (was == state.configured_joints.end()) return !entry.joint;
  const std::string& name = was->second.name;
  return name.empty() || (entry.joint && entry.joint->name == name);
}

// What an unknown entry says now may be what it said: what was set at run time is kept.
// @param was  the entry of the previous configuration; null: none
std::optional<Kind> effect(const FrameSpec& entry, const FrameSpec* was, const StoredState& state,
                           bool is_there) {
  if (state.unknown_entries.count(entry.id) != 0) return std::nullopt;
  if (was == nullptr || !same_edge(*was, entry, state.omitted_was_exact) ||
      !same_joint(state, entry))
    return is_there ? Kind::kReplace : Kind::kAdd;
  if (is_there && !(was->correlation == entry.correlation)) return Kind::kCorrelate;
  return std::nullopt;
}

bool is_same_unit(JointType a, JointType b) {
  return (a == JointType::kPrismatic) == (b == JointType::kPrismatic);
}

// By the names of joints: whom they followed, if that is known.
using Followed = std::map<std::string_view, std::string_view>;

// Why the stored position of a joint means something else now; empty: it does not.
std::string change_of(const StoredJoint& stored, const JointSpec& now, const Followed& followed) {
  const std::string name = "joint " + quote(now.name);
  if (stored.type && !is_same_unit(*stored.type, now.type)) {
    return name + " is " + to_string(now.type) + ", and was " + to_string(*stored.type);
  }
  const auto before = followed.find(now.name);
  if (!now.mimic || before == followed.end() || before->second == now.mimic->joint) return {};
  return name + " mimics " + quote(now.mimic->joint) + ", and mimicked " +
         (before->second.empty() ? "none" : quote(before->second));
}

// By the names of stored joints that are described: as change_of().
using Meanings = std::map<std::string_view, std::string>;

Meanings meanings_of(const StoredState& state, const std::vector<FrameSpec>& configured) {
  std::map<std::string_view, const JointSpec*> described;
  for (const FrameSpec& frame : configured) {
    if (frame.joint) described.emplace(frame.joint->name, &*frame.joint);
  }
  Followed followed;
  for (const auto& [id, joint] : state.configured_joints) {
    if (!joint.name.empty()) followed.emplace(joint.name, joint.follows);
  }
  Meanings meanings;
  for (const StoredJoint& joint : state.joints) {
    const auto now = described.find(joint.name);
    if (now == described.end()) continue;
    meanings.emplace(joint.name, change_of(joint, *now->second, followed));
  }
  return meanings;
}

// Why the stored position of a frame's joint, see left_of(), is not valid any more; null: it is.
const std::string* why_at_rest(const Meanings& meanings, const FrameSpec& frame) {
  if (!frame.joint) return nullptr;
  auto found = meanings.find(leader_of(*frame.joint));
  if (found == meanings.end()) found = meanings.find(frame.joint->name);
  return found != meanings.end() && !found->second.empty() ? &found->second : nullptr;
}

// Of the frames whose entries are gone, and of those that are left below them.
void add_removals(const std::map<std::string_view, const FrameSpec*>& gone,
                  std::map<std::string_view, std::string_view>& parents,
                  std::vector<ConfiguredChange>& changes) {
  std::set<std::string_view> removed;
  for (const auto& [id, entry] : gone) {
    if (parents.erase(id) == 0) continue;
    removed.insert(id);
    changes.push_back({Kind::kRemove, std::string(id), {}});
  }
  for (const auto& [id, parent] : parents) {
    if (removed.count(parent) == 0) continue;
    changes.push_back({Kind::kOrphan, std::string(id), std::string(parent)});
  }
}

}  // namespace

std::vector<StoredJoint> still_meant(const StoredState& state,
                                     const std::vector<FrameSpec>& configured) {
  if (configured.empty()) return state.joints;
  const Meanings meanings = meanings_of(state, configured);
  std::set<std::string_view> at_rest;
  for (const FrameSpec& frame : configured) {
    if (why_at_rest(meanings, frame) != nullptr) at_rest.insert(frame.joint->name);
  }
  std::vector<StoredJoint> meant;
  for (const StoredJoint& joint : state.joints) {
    const bool described = meanings.count(joint.name) != 0;
    if (described && at_rest.count(joint.name) == 0) meant.push_back(joint);
  }
  return meant;
}

std::vector<ConfiguredChange> configured_changes(const StoredState& state,
                                                 const std::vector<FrameSpec>& configured) {
  std::vector<ConfiguredChange> changes;
  if (configured.empty()) return changes;
  std::map<std::string_view, const FrameSpec*> before;
  for (const FrameSpec& frame : state.configured) before.emplace(frame.id, &frame);
  std::map<std::string_view, std::string_view> parents;  // of the existing frames
  for (const StoredFrame& frame : state.frames) parents.emplace(frame.id, frame.parent);
  const Meanings meanings = meanings_of(state, configured);
  for (const FrameSpec& entry : configured) {
    if (const auto* why = why_at_rest(meanings, entry)) {
      changes.push_back({Kind::kRest, entry.id, {}, *why});
    }
    const auto was = before.find(entry.id);
    const bool is_there = parents.count(entry.id) != 0;
    const auto kind = effect(entry, was != before.end() ? was->second : nullptr, state, is_there);
    if (was != before.end()) before.erase(was);
    if (!kind) continue;
    if (*kind != Kind::kCorrelate) parents[entry.id] = entry.parent;
    changes.push_back({*kind, entry.id, *kind == Kind::kCorrelate ? "" : entry.parent});
  }
  add_removals(before, parents, changes);
  return changes;
}

std::set<std::string> left_static(const StoredState& state,
                                  const std::vector<FrameSpec>& configured) {
  std::map<std::string_view, const FrameSpec*> before;
  for (const FrameSpec& frame : state.configured) before.emplace(frame.id, &frame);
  std::set<std::string> left;
  for (const StoredFrame& frame : state.frames) {
    const auto entry = before.find(frame.id);
    if (entry == before.end() || frame.time.stamp || frame.time.cleared) continue;
    const FrameSpec& was = *entry->second;
    const bool moved = was.parent != frame.parent;
    const FrameSpec now{frame.id, frame.parent, frame.X_PC};
    if (moved || (!was.joint && !same_edge(was, now, state.omitted_was_exact))) {
      left.insert(frame.id);
    }
  }
  for (const ConfiguredChange& change : configured_changes(state, configured)) {
    if (change.kind != Kind::kCorrelate) left.erase(change.frame);
  }
  return left;
}

std::string describe(const ConfiguredChange& change) {
  std::string frame = "frame " + quote(change.frame);
  const std::string under = change.parent.empty() ? " as a root" : " under " + quote(change.parent);
  switch (change.kind) {
    case Kind::kAdd:
      return frame + ": added" + under;
    case Kind::kReplace:
      return frame + ": changed to its new entry," + under;
    case Kind::kCorrelate:
      return frame + ": its correlation changes to that of its entry";
    case Kind::kRemove:
      return frame + ": removed, because its entry was deleted";
    case Kind::kRest:
      return frame + ": starts at its initial position; the stored one is dropped: " + change.why;
    case Kind::kOrphan:
      return frame + ": waits for its parent " + quote(change.parent) + ", which is removed";
  }
  return frame;
}

}  // namespace tfdude
