#include "faults/model.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include <Eigen/Core>

#include "support/oracle.hpp"
#include "support/pose_diff.hpp"

namespace tfdude::faults {
namespace {

constexpr double kTolerance = 1e-9;
constexpr std::size_t kHistoryKept = 30;
constexpr std::size_t kStatesJudged = 256;

bool same(const std::optional<Place>& a, const std::optional<Place>& b) {
  if (!a || !b) return !a && !b;
  return a->parent == b->parent && a->X_PC.pose.matrix() == b->X_PC.pose.matrix();
}

void insert(std::vector<std::optional<Place>>& places, const std::optional<Place>& place) {
  const auto known = std::any_of(places.begin(), places.end(),
                                 [&](const auto& other) { return same(other, place); });
  if (!known) places.push_back(place);
}

// The frame and all above it, the topmost first; one whose parent does not exist is as a root.
// Empty if the frame does not exist.
template <class State>
std::vector<std::string> way_down(const State& state, const std::string& id) {
  std::vector<std::string> way;
  for (std::string at = id; !at.empty();) {
    const auto frame = state.find(at);
    if (way.size() > state.size()) return {};
    if (frame == state.end() || !*frame->second) break;
    way.insert(way.begin(), at);
    at = (*frame->second)->parent;
  }
  return way;
}

// Empty: not both exist and are connected.
template <class State>
std::optional<Transform> between(const State& state, const std::string& a, const std::string& b) {
  const auto to_a = way_down(state, a);
  const auto to_b = way_down(state, b);
  if (to_a.empty() || to_b.empty() || to_a.front() != to_b.front()) return std::nullopt;
  testing::Oracle oracle;
  for (const auto* way : {&to_a, &to_b}) {
    for (const std::string& id : *way) {
      const Place& place = **state.at(id);
      oracle.add(id, id == way->front() ? "" : place.parent, place.X_PC);
    }
  }
  return oracle.between(a, b);
}

bool agree(const std::optional<Transform>& actual, const std::optional<Transform>& expected) {
  if (!actual || !expected) return !actual && !expected;
  // Usually they are far apart, and a description of the difference takes long.
  const Eigen::Vector3d apart = actual->pose.translation() - expected->pose.translation();
  return !(apart.norm() > kTolerance * 10) &&
         testing::transform_diff(*actual, *expected, kTolerance).empty();
}

std::string differences(const std::optional<Transform>& actual,
                        const std::vector<std::optional<Transform>>& expected) {
  std::string text;
  for (const auto& one : expected) {
    text += "\n  possible: ";
    if (one && actual) {
      text += testing::transform_diff(*actual, *one, kTolerance);
    } else {
      text += one ? "both are there and connected" : "not both are there and connected";
    }
  }
  return text;
}

}  // namespace

bool Model::Frame::may_be_there() const {
  return std::any_of(possible.begin(), possible.end(),
                     [](const auto& place) { return place.has_value(); });
}

bool Model::Frame::may_be_gone() const {
  return std::any_of(possible.begin(), possible.end(), [](const auto& place) { return !place; });
}

void Model::fix(const std::string& id, const std::string& partition, const Place& place) {
  Frame& frame = frames_[id];
  frame.partition = partition;
  frame.possible.assign(1, place);
}

void Model::add(const std::string& id, const std::string& partition, const Place& place,
                bool done) {
  Frame& frame = frames_[id];
  frame.partition = partition;
  frame.possible.assign(1, place);
  if (!done) frame.possible.emplace_back();
  frame.may_change_late = !done;
}

void Model::update(const std::string& id, const Transform& X_PC, bool done) {
  Frame& frame = frames_.at(id);
  std::vector<std::optional<Place>> after;
  if (!done) after = frame.possible;
  for (const auto& place : frame.possible) {
    if (place) insert(after, Place{place->parent, X_PC});
  }
  if (frame.doomed) insert(after, std::nullopt);
  if (done) frame.may_move_late = frame.unsaved = false;
  frame.may_change_late = !done;
  frame.possible = std::move(after);
}

void Model::move(const std::string& id, const std::string& parent,
                 const std::optional<Transform>& X_PC, bool done) {
  Frame& frame = frames_.at(id);
  std::vector<std::optional<Place>> after;
  if (!done) after = frame.possible;
  for (const auto& place : frame.possible) {
    if (place) insert(after, Place{parent, X_PC ? *X_PC : place->X_PC});
  }
  frame.may_move_late = frame.may_change_late = !done;
  if (done) frame.unsaved = false;
  frame.possible = std::move(after);
  // What the frame is below now may have been undone while the move was on its way.
  if (may_be_below(parent, id)) allow_cycles();
}

void Model::remove(const std::string& id, bool done) {
  std::map<std::string, std::set<std::string>> removers;
  std::vector<std::string> sure;
  std::vector<std::string> unsure;
  for (const auto& [below, frame] : frames_) {
    const auto ways = ways_up(below, id);
    if (ways.count(id) == 0) continue;
    (done && goes_with(below, id) ? sure : unsure).push_back(below);
    for (const std::string& at : ways) removers[below].insert(frames_.at(at).partition);
  }
  for (auto& [below, by] : removers) frames_.at(below).removed_by.merge(by);
  for (const std::string& below : sure) {
    insert(frames_.at(below).possible, std::nullopt);
    gone(below);
  }
  for (const std::string& below : unsure) {
    insert(frames_.at(below).possible, std::nullopt);
    frames_.at(below).doomed = true;
  }
}

void Model::may_be_as_in(const Model& earlier, const std::string& partition) {
  for (const auto& [id, before] : earlier.frames_) {
    if (before.partition != partition) continue;
    auto now = frames_.find(id);
    if (now == frames_.end()) {
      now = frames_.insert(removed_.extract(id)).position;
      // Others may know that a frame above it was removed.
      now->second.doomed = true;
    }
    Frame& frame = now->second;
    for (const auto& place : before.possible) insert(frame.possible, place);
    frame.doomed = frame.doomed || before.doomed;
    frame.may_move_late = frame.may_move_late || before.may_move_late;
    frame.may_change_late = frame.may_change_late || before.may_change_late;
  }
  for (auto& [id, frame] : frames_) {
    const bool later = earlier.frames_.count(id) == 0 && earlier.removed_.count(id) == 0;
    if (frame.partition == partition && later) insert(frame.possible, std::nullopt);
  }
  allow_cycles();
  allow_removals();
}

// A frame may be below one again that was removed, or may have been, after it was moved away: it is
// removed, too, with all below it.
void Model::allow_removals() {
  std::vector<std::string> doomed;
  for (const auto& [id, frame] : frames_) {
    const bool orphan = std::any_of(
        frame.possible.begin(), frame.possible.end(),
        [this](const auto& place) { return place && removed_.count(place->parent) > 0; });
    if (orphan || (frame.doomed && frame.may_be_gone())) doomed.push_back(id);
  }
  for (const std::string& top : doomed) {
    const std::set<std::string> removed_by = frames_.at(top).removed_by;
    for (auto& [id, frame] : frames_) {
      const auto ways = ways_up(id, top);
      if (ways.count(top) == 0) continue;
      insert(frame.possible, std::nullopt);
      frame.doomed = true;
      frame.removed_by.insert(removed_by.begin(), removed_by.end());
      for (const std::string& at : ways) frame.removed_by.insert(frames_.at(at).partition);
    }
  }
}

// A move that was made after one that is lost may be a part of a cycle, and be undone.
void Model::allow_cycles() {
  std::vector<std::pair<std::string, Transform>> roots;
  for (const auto& [id, frame] : frames_) {
    for (const auto& place : frame.possible) {
      const bool cycle = place && may_be_below(place->parent, id);
      if (cycle) roots.emplace_back(id, place->X_PC);
    }
  }
  for (const auto& [id, X_PC] : roots) insert(frames_.at(id).possible, Place{"", X_PC});
}

void Model::doubt(const std::string& id) {
  for (auto& [below, frame] : frames_) {
    if (frame.may_be_there() && may_be_below(below, id)) frame.unsaved = true;
  }
}

void Model::gone(const std::string& id) {
  const auto found = frames_.find(id);
  if (found == frames_.end() || !found->second.may_be_gone()) return;
  found->second.possible.assign(1, std::nullopt);
  removed_.insert(frames_.extract(found));
}

const Model::Frame& Model::frame(const std::string& id) const {
  const auto found = frames_.find(id);
  return found != frames_.end() ? found->second : removed_.at(id);
}

void Model::note(const std::string& id, const std::string& line) {
  const auto found = frames_.find(id);
  auto& history = (found != frames_.end() ? found->second : removed_.at(id)).history;
  history.push_back(line);
  if (history.size() > kHistoryKept) history.erase(history.begin());
}

std::vector<std::string> Model::ids(const std::string& prefix, bool anchored) const {
  std::vector<std::string> ids;
  for (const auto& [id, frame] : frames_) {
    if (id.compare(0, prefix.size(), prefix) != 0) continue;
    if (anchored ? this->anchored(id) : frame.may_be_there()) ids.push_back(id);
  }
  return ids;
}

bool Model::anchored(const std::string& id) const {
  std::size_t steps = 0;
  for (std::string at = id; !at.empty(); ++steps) {
    const auto found = frames_.find(at);
    if (found == frames_.end() || !found->second.certain()) return false;
    const auto& place = found->second.possible.front();
    if (!place || steps > frames_.size()) return false;
    at = place->parent;
  }
  return true;
}

bool Model::may_be_below(const std::string& id, const std::string& ancestor) const {
  return ways_up(id, ancestor).count(ancestor) != 0;
}

std::set<std::string> Model::ways_up(const std::string& id, const std::string& ancestor) const {
  std::vector<std::string> look{id};
  std::set<std::string> seen;
  while (!look.empty()) {
    const std::string at = look.back();
    look.pop_back();
    const auto found = frames_.find(at);
    if (found == frames_.end() || !seen.insert(at).second || at == ancestor) continue;
    for (const auto& place : found->second.possible) {
      if (place) look.push_back(place->parent);
    }
  }
  return seen;
}

// An add or move without an answer may be made after the removal of what it names: that frame
// stays, without its parent.
bool Model::goes_with(const std::string& id, const std::string& ancestor) const {
  std::string at = id;
  for (std::size_t steps = 0; at != ancestor; ++steps) {
    const auto found = frames_.find(at);
    if (found == frames_.end() || found->second.may_be_gone() || steps > frames_.size()) {
      return false;
    }
    if (found->second.may_move_late) return false;
    const auto& possible = found->second.possible;
    const std::string& parent = possible.front()->parent;
    if (std::any_of(possible.begin(), possible.end(),
                    [&](const auto& place) { return place->parent != parent; })) {
      return false;
    }
    at = parent;
  }
  return true;
}

std::vector<std::string> Model::closure(const std::string& a, const std::string& b) const {
  std::vector<std::string> look{a, b};
  std::set<std::string> seen;
  while (!look.empty()) {
    const std::string at = look.back();
    look.pop_back();
    const auto found = frames_.find(at);
    if (found == frames_.end() || !seen.insert(at).second) continue;
    for (const auto& place : found->second.possible) {
      if (place) look.push_back(place->parent);
    }
  }
  return {seen.begin(), seen.end()};
}

void Model::each_state(const std::vector<std::string>& ids,
                       const std::function<void(const State&)>& see) const {
  std::vector<std::size_t> chosen(ids.size(), 0);
  State state;
  while (true) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      state[ids[i]] = &frames_.at(ids[i]).possible[chosen[i]];
    }
    see(state);
    std::size_t digit = 0;
    while (digit < ids.size() && ++chosen[digit] == frames_.at(ids[digit]).possible.size()) {
      chosen[digit++] = 0;
    }
    if (digit == ids.size()) return;
  }
}

std::string Model::judge(const std::string& a, const std::string& b,
                         const std::optional<Transform>& X_AB, bool quiet) {
  const auto ids = closure(a, b);
  std::size_t states = 1;
  for (const std::string& id : ids) states *= frames_.at(id).possible.size();
  if (states > kStatesJudged) return "";
  std::map<std::string, std::vector<std::optional<Place>>> left;
  std::vector<std::optional<Transform>> expected;
  bool agrees = false;
  each_state(ids, [&](const State& state) {
    auto possible = between(state, a, b);
    if (!agree(X_AB, possible)) return expected.push_back(std::move(possible));
    agrees = true;
    for (const std::string& id : ids) insert(left[id], *state.at(id));
  });
  if (!agrees) return "lookup of " + b + " in " + a + differences(X_AB, expected);
  // A denial may come from a replica that is not up to date; an answer comes from the owners.
  if (X_AB) {
    for (auto& [id, places] : left) {
      Frame& frame = frames_.at(id);
      if (frame.unsaved || (frame.may_change_late && !quiet)) continue;
      frame.possible = std::move(places);
      frame.may_change_late = false;
      if (quiet) frame.doomed = false;
      if (frame.doomed) insert(frame.possible, std::nullopt);
    }
  }
  return "";
}

}  // namespace tfdude::faults
