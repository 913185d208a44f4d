#include "tfdude/partition/reconfigure.hpp"

#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "tfdude/base/id.hpp"
#include "tfdude/partition/joints.hpp"

namespace tfdude {
namespace {

using Kind = ConfiguredChange::Kind;

// A rotation that was stored is made a unit quaternion anew as it is read, which may change its last digit.
constexpr double kSameRotation = 1e-14;

bool same_edge(const FrameSpec& a, const FrameSpec& b) {
  const Transform X = value_of(a);
  const Transform Y = value_of(b);
  return a.parent == b.parent && X.covariance.upper() == Y.covariance.upper() &&
         X.pose.translation() == Y.pose.translation() &&
         X.pose.rotation().coeffs().isApprox(Y.pose.rotation().coeffs(), kSameRotation);
}

// @param was  the entry when the configuration was taken last; null: there was none
std::optional<Kind> effect(const FrameSpec& entry, const FrameSpec* was, bool is_there) {
  if (was == nullptr || !same_edge(*was, entry)) return is_there ? Kind::kReplace : Kind::kAdd;
  if (is_there && !(was->correlation == entry.correlation)) return Kind::kCorrelate;
  return std::nullopt;
}

}  // namespace

std::vector<ConfiguredChange> configured_changes(const StoredState& state,
                                                 const std::vector<FrameSpec>& configured) {
  std::vector<ConfiguredChange> changes;
  if (configured.empty()) return changes;
  std::map<std::string_view, const FrameSpec*> before;
  for (const FrameSpec& frame : state.configured) before.emplace(frame.id, &frame);
  std::map<std::string_view, std::string_view> parents;  // of those that are there
  for (const StoredFrame& frame : state.frames) parents.emplace(frame.id, frame.parent);
  for (const FrameSpec& entry : configured) {
    const auto was = before.find(entry.id);
    const bool is_there = parents.count(entry.id) != 0;
    const auto kind = effect(entry, was != before.end() ? was->second : nullptr, is_there);
    if (was != before.end()) before.erase(was);
    if (!kind) continue;
    if (*kind != Kind::kCorrelate) parents[entry.id] = entry.parent;
    changes.push_back({*kind, entry.id, *kind == Kind::kCorrelate ? "" : entry.parent});
  }
  std::set<std::string_view> removed;  // of the entries that are gone
  for (const auto& [id, entry] : before) {
    if (parents.erase(id) == 0) continue;
    removed.insert(id);
    changes.push_back({Kind::kRemove, std::string(id), {}});
  }
  for (const auto& [id, parent] : parents) {
    if (removed.count(parent) == 0) continue;
    changes.push_back({Kind::kOrphan, std::string(id), std::string(parent)});
  }
  return changes;
}

std::string describe(const ConfiguredChange& change) {
  const std::string frame = "frame " + quote(change.frame);
  const std::string under =
      change.parent.empty() ? " as a root" : " under " + quote(change.parent);
  switch (change.kind) {
    case Kind::kAdd:
      return frame + ": added" + under;
    case Kind::kReplace:
      return frame + ": as its entry says now," + under;
    case Kind::kCorrelate:
      return frame + ": its correlation is as its entry says now";
    case Kind::kRemove:
      return frame + ": removed, as its entry is gone";
    case Kind::kOrphan:
      return frame + ": waits for its parent " + quote(change.parent) + ", which is removed";
  }
  return frame;
}

}  // namespace tfdude
