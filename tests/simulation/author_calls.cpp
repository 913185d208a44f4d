#include <algorithm>
#include <memory>
#include <set>
#include <utility>

#include "calls/hand_over_task.hpp"
#include "simulation/author.hpp"

// The calls of an author, and what they mean for its model.
namespace tfdude::simulation {
namespace {

using faults::base_edge;
using faults::base_of;
using faults::contested_frame;
using faults::denies;
using faults::never_asked;
using faults::partition_name;
using faults::Place;

constexpr std::size_t kFrames = 12;  // of one author at the same time

std::vector<Part> alone(Part part) { return {std::move(part)}; }

}  // namespace

void Author::add() {
  if (own(false).size() >= kFrames) return remove();
  const std::string id = prefix_ + std::to_string(added_++);
  const Place place{any_anchor(), random_.transform()};
  const std::string partition =
      random_.index(2) == 0 ? partition_name(random_.index(owners_)) : std::string();
  const std::string owner = partition.empty() ? model_.frame(place.parent).partition : partition;
  change(
      "add " + id + " in " + owner + " under " + place.parent, owner,
      [id, place, partition](Process& caller) {
        return route_add(caller.forest(), caller.directory(), id, {place.parent, place.X_PC},
                         partition)
            .map(alone);
      },
      [this, id, place, owner](const Result<void>& added) {
        // No other client adds it.
        const bool exists = !added && added.error().code == Errc::kAlreadyExists;
        const bool refused = !added && !exists && denies(added.error().code);
        model_.add(id, owner, place, (added || exists) && !may_be_lost(owner, began_));
        if (refused || (!added && never_asked(added.error()))) model_.gone(id);
        doubt_unless_stored(id, added);
        if (added) check_seen(id, place.parent);
      });
}

void Author::move() {
  const auto ids = own(true);
  if (ids.empty()) return next();
  const std::string id = any(ids);
  const std::string parent = any_anchor();
  if (model_.may_be_below(parent, id)) return next();
  std::optional<Transform> X_PC;
  if (random_.index(2) == 0) X_PC = random_.transform();
  change(
      "move " + id + " under " + parent, model_.frame(id).partition,
      [id, parent, X_PC](Process& caller) {
        const MoveRequest move{parent, X_PC ? PartialTransform(*X_PC) : PartialTransform()};
        return route_move(caller.forest(), caller.directory(), id, move).map(alone);
      },
      [this, id, parent, X_PC](const Result<void>& moved) {
        const bool refused = !moved && denies(moved.error().code);
        const bool asked = moved || !never_asked(moved.error());
        if (!refused && asked) {
          const bool lost = may_be_lost(model_.frame(id).partition, began_);
          model_.move(id, parent, X_PC, moved && !lost);
        }
        doubt_unless_stored(id, moved);
        if (moved) check_seen(id, parent);
      });
}

void Author::update() {
  const auto ids = own(random_.index(10) != 0);
  if (ids.empty()) return next();
  std::map<std::string, Transform> values;
  for (std::size_t count = 1 + random_.index(3); count > 0; --count) {
    values[any(ids)] = random_.transform();
  }
  std::vector<EdgeUpdate> edges;
  std::string what = "update";
  for (const auto& [id, X_PC] : values) {
    edges.push_back({id, X_PC});
    what += " " + id + " to " + std::to_string(X_PC.pose.translation().x());
  }
  begin(
      what,
      [this, edges] { return route_update(process_->forest(), process_->directory(), edges); },
      [this, edges](const Result<void>& updated) {
        const bool denial = !updated && denies(updated.error().code);
        for (const EdgeUpdate& edge : edges) {
          const bool asked =
              updated || edges.size() > 1 || !(denial || never_asked(updated.error()));
          const bool lost = may_be_lost(model_.frame(edge.id).partition, began_);
          if (asked) model_.update(edge.id, edge.X_PC, updated && !lost);
          doubt_unless_stored(edge.id, updated);
        }
      });
}

void Author::remove() {
  const auto ids = own(random_.index(4) != 0);
  if (ids.empty()) return next();
  const std::string id = any(ids);
  auto asked_before = std::make_shared<bool>(false);
  change(
      "remove " + id, model_.frame(id).partition,
      [this, id, asked_before](Process& caller) -> Result<std::vector<Part>> {
        if (!caller.discovered()) return fail(Errc::kUnknownFrame, "not all is known");
        auto parts = route_remove(caller.forest(), caller.directory(), id);
        const bool asks = &caller == process_.get();  // else the owner's own process may do it
        *asked_before = *asked_before || (asks && parts.has_value());
        return parts;
      },
      [this, id, asked_before](Result<void> removed) {
        // Gone by the time of a second attempt, unless it was forgotten.
        const bool missing = !removed && (removed.error().code == Errc::kUnknownFrame ||
                                          removed.error().code == Errc::kNotOwner);
        const std::string owner = model_.frame(id).partition;
        const bool gone = missing && *asked_before && !process_->forest().exists(id);
        const bool forgotten = gone && process_->world().forgotten.count(owner) > 0;
        if (gone && !forgotten) removed = {};
        const bool denial = !removed && !forgotten && denies(removed.error().code);
        bool one_owner = true;
        for (const auto& [other, frame] : model_.frames()) {
          const bool below = frame.may_be_there() && model_.may_be_below(other, id);
          if (below && frame.partition != owner) one_owner = false;
        }
        const bool asked = removed || !one_owner || !never_asked(removed.error());
        if (!denial && asked) model_.remove(id, removed && !may_be_lost(began_));
        doubt_unless_stored(id, removed);
      });
}

// All owners of a joint get the update, so all must be known.
void Author::set_joint() {
  const double position = random_.uniform(-5, 5);
  if (random_.index(3) == 0) return stream_joint(position);
  const JointUpdate update{{{moved_[0].joint, position, 0}}, {}};
  auto asked = std::make_shared<std::set<std::string>>();
  begin(
      "joint " + moved_[0].joint + " to " + std::to_string(position),
      [this, update, asked]() -> Result<std::vector<Part>> {
        if (!process_->discovered()) return fail(Errc::kUnknownJoint, "not all is known");
        auto parts = route_joints(process_->directory(), update);
        if (!parts) return parts;
        auto ok = check_reachable(process_->directory(), *parts);
        if (!ok) return tl::unexpected(ok.error());
        asked->clear();
        for (const Part& part : *parts) asked->insert(part.partition);
        return parts;
      },
      [this, position, asked](const Result<void>& set) {
        if (asked->empty()) return;
        // One that is not known to have the joint is not asked.
        for (const MovedFrame& one : moved_) {
          const std::string owner = partition_name(one.owner);
          const bool sure = set && asked->count(owner) > 0 && !may_be_lost(owner, began_);
          model_.update(one.frame, one.value(position), sure);
          doubt_unless_stored(one.frame, set);
        }
      });
}

// Each owner that is known to have the joint is sent the position, and nobody replies.
void Author::stream_joint(double position) {
  const JointUpdate update{{{moved_[0].joint, position, 0}}, {}};
  const auto parts = route_joints(process_->directory(), update);
  process_->world().trace(prefix_ + " streams joint " + std::to_string(position));
  for (const Part& part : parts ? *parts : std::vector<Part>()) {
    process_->stream(part.partition, std::get<JointUpdate>(part.request.body));
    for (const MovedFrame& one : moved_) {
      if (partition_name(one.owner) != part.partition) continue;
      model_.update(one.frame, one.value(position), false);
      model_.doubt(one.frame);
    }
  }
  rest_ = process_->world().network.longest_delay();
  remember();
  next();
}

void Author::forget_one() {
  std::vector<std::string> missed;
  for (const PartitionInfo& one : process_->directory().partitions()) {
    if (!one.reachable) missed.push_back(one.name);
  }
  if (missed.empty()) return next();
  forget(any(missed));
}

void Author::forget(const std::string& partition) {
  Process& process = *process_;
  begin(
      "forget " + partition,
      [&process, partition]() -> Result<std::vector<Part>> {
        const Directory& directory = process.directory();
        const bool known = process.discovered() && directory.owner(partition);
        if (!known) return fail(Errc::kUnknownPartition, "no partition " + partition);
        if (auto ok = directory.check_not_there(partition); !ok) return tl::unexpected(ok.error());
        process.world().forgotten[partition] = process.world().timeline.now();
        const ForgetRequest body{partition, directory.latest_incarnation(partition)};
        std::vector<Part> all;
        for (const Owner one : directory.reachable_owners()) {
          all.push_back({one, directory.name(one), Request{0, directory.name(one), body}});
        }
        if (all.empty()) return fail(Errc::kUnreachable, "nobody could remember it");
        return all;
      },
      [this, partition](const Result<void>& told) {
        if (!told || !process_->forget(partition)) return;
        forgotten_[partition] = process_->world().timeline.now();
      });
}

void Author::look_up(const std::string& a, const std::string& b, bool quiet) {
  const auto task = process_->lookup(a, b);
  process_->begin("lookup of " + b + " in " + a, task,
                  [this, self = shared_from_this(), a, b, task, quiet,
                   began = process_->world().timeline.now()](const Result<void>& outcome) {
                    const auto X_AB = outcome.map([&] { return task->X_AB(); });
                    const std::string code =
                        X_AB ? "done" : std::string(to_string(X_AB.error().code));
                    ++outcomes_["lookup " + code];
                    process_->world().trace(prefix_ + " lookup " + a + " " + b + ": " + code);
                    judge(a, b, X_AB, quiet, began);
                    if (!quiet) next();
                  });
}

// A partition that has lost something since the lookup began may be different by now.
void Author::judge(const std::string& a, const std::string& b, const Result<StampedTransform>& X_AB,
                   bool quiet, Instant began) {
  if (!X_AB && !(quiet && denies(X_AB.error().code))) return;
  const std::optional<Transform> answer = X_AB ? std::optional(X_AB->transform()) : std::nullopt;
  faults::Model before;
  const bool lost = may_be_lost(began);
  if (lost) before = model_;
  const std::string wrong = model_.judge(a, b, answer, quiet);
  if (!wrong.empty()) process_->world().violation("a wrong answer", wrong);
  if (lost) model_ = std::move(before);
  remember();
}

void Author::hand_over(const std::string& id) {
  const std::size_t owners = process_->world().plan.owners;
  const std::string to = partition_name(random_.index(owners));
  std::optional<std::string> parent;
  if (random_.index(3) == 0) parent = base_of(random_.index(owners));
  const std::string what = "hand-over " + id + " to " + to + (parent ? " under " + *parent : "");
  began_ = process_->world().timeline.now();
  by_node_ = false;
  process_->begin(
      what,
      std::make_shared<HandOverTask>(process_->forest(), id, to, parent, PartialTransform(),
                                     process_->world().timeline.steady() + RunningCall::kTimeout),
      [this, self = shared_from_this(), what](const Result<void>& outcome) {
        conclude(what, outcome, [](const Result<void>&) {});
      });
}

// Any result is allowed, but in the end all must agree on it.
void Author::contest() {
  const std::string id = contested_frame(random_.index(kContested));
  const std::string other = contested_frame(random_.index(kContested));
  const std::size_t owners = process_->world().plan.owners;
  const std::string parent = random_.index(2) == 0 ? other : base_of(random_.index(owners));
  const auto nothing = [](const Result<void>&) {};
  Forest& forest = process_->forest();
  Directory& directory = process_->directory();
  // Nothing can be below itself.
  if (parent == id) return hand_over(id);
  switch (random_.index(4)) {
    case 0:
      return begin(
          "contested-remove " + id,
          [&forest, &directory, id] { return route_remove(forest, directory, id); }, nothing);
    case 1:
      return begin(
          "contested-move " + id,
          [&forest, &directory, id, parent] {
            return route_move(forest, directory, id, {parent, {}}).map(alone);
          },
          nothing);
    default: {
      const std::string partition = partition_name(random_.index(owners));
      return begin(
          "contested-add " + id,
          [&forest, &directory, id, parent, partition] {
            return route_add(forest, directory, id, {parent, base_edge(0)}, partition).map(alone);
          },
          nothing);
    }
  }
}

}  // namespace tfdude::simulation
