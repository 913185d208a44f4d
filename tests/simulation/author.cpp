#include "simulation/author.hpp"

#include <algorithm>
#include <utility>

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

}  // namespace

Author::Author(std::shared_ptr<Process> process, std::size_t number, std::size_t owners,
               std::uint64_t seed)
    : process_(std::move(process)),
      prefix_("c" + std::to_string(number) + "_"),
      owners_(owners),
      random_(seed) {
  faults::fix_bases(model_, owners);
}

void Author::start() { next(); }

void Author::next() {
  if (stopped_) return;
  const Instant pause = std::chrono::microseconds(random_.index(40'000));
  process_->later("author", pause, [self = shared_from_this()] {
    if (!self->stopped_) self->step();
  });
}

void Author::step() {
  const auto& plan = process_->world().plan;
  if (!plan.stores || random_.uniform(0, 1) < plan.contest) return contest();
  const std::size_t draw = random_.index(100);
  if (draw < 30) {
    const auto ids = own(random_.index(3) != 0);
    if (ids.empty()) return next();
    return look_up(random_.index(3) == 0 ? "world" : any_anchor(), any(ids), false);
  }
  if (draw < 55) return update();
  if (draw < 75) return add();
  if (draw < 92) return move();
  remove();
}

void Author::begin(const std::string& what, Operation::Route route,
                   std::function<void(const Result<void>&)> then) {
  process_->begin(
      what, std::make_shared<Operation>(
                *process_, std::move(route),
                [self = shared_from_this(), what, then](const Result<void>& outcome, const auto&) {
                  Surroundings& world = self->process_->world();
                  const std::string code =
                      outcome ? "done" : std::string(to_string(outcome.error().code));
                  ++self->outcomes_[what.substr(0, what.find(' ')) + " " + code];
                  world.trace(self->prefix_ + " " + what + ": " + code);
                  then(outcome);
                  self->next();
                }));
}

std::vector<std::string> Author::own(bool anchored) const { return model_.ids(prefix_, anchored); }

std::string Author::any(const std::vector<std::string>& ids) {
  return ids[random_.index(ids.size())];
}

std::string Author::any_anchor() {
  const auto anchored = own(true);
  if (anchored.empty() || random_.index(3) == 0) return base_of(random_.index(owners_));
  return any(anchored);
}

// A client sees its own changes, unless the owner is unreachable or known to be late.
void Author::check_seen(const std::string& id, const std::string& parent) {
  Process& process = *process_;
  const auto frame = process.forest().info(id);
  const auto owner = process.directory().owner(model_.frame(id).partition);
  const bool excused =
      !owner || !process.directory().reachable(*owner) || process.directory().behind() != nullptr;
  if (excused || (frame && frame->parent == parent)) return;
  process.world().violation("an author does not see its change",
                            id + " was hung under " + parent + ", and its author sees it " +
                                (frame ? "under " + frame->parent : "nowhere"));
}

void Author::doubt_unless_stored(const std::string& id, const Result<void>& outcome) {
  if (!outcome && !denies(outcome.error().code)) model_.doubt(id);
}

void Author::add() {
  if (own(false).size() >= kFrames) return remove();
  const std::string id = prefix_ + std::to_string(added_++);
  const Place place{any_anchor(), random_.transform()};
  const std::string partition =
      random_.index(2) == 0 ? partition_name(random_.index(owners_)) : std::string();
  const std::string owner = partition.empty() ? model_.frame(place.parent).partition : partition;
  begin(
      "add " + id + " in " + owner + " under " + place.parent,
      [this, id, place, partition] {
        return route_add(process_->forest(), process_->directory(), id, {place.parent, place.X_PC},
                         partition)
            .map([](Part part) { return std::vector<Part>{std::move(part)}; });
      },
      [this, id, place, owner](const Result<void>& added) {
        // No other client adds it.
        const bool exists = !added && added.error().code == Errc::kAlreadyExists;
        const bool refused = !added && !exists && denies(added.error().code);
        model_.add(id, owner, place, added || exists);
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
  begin(
      "move " + id + " under " + parent,
      [this, id, parent, X_PC] {
        const MoveRequest move{parent, X_PC ? PartialTransform(*X_PC) : PartialTransform()};
        return route_move(process_->forest(), process_->directory(), id, move)
            .map([](Part part) { return std::vector<Part>{std::move(part)}; });
      },
      [this, id, parent, X_PC](const Result<void>& moved) {
        const bool refused = !moved && denies(moved.error().code);
        const bool asked = moved || !never_asked(moved.error());
        if (!refused && asked) model_.move(id, parent, X_PC, moved.has_value());
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
          if (asked) model_.update(edge.id, edge.X_PC, updated.has_value());
          doubt_unless_stored(edge.id, updated);
        }
      });
}

void Author::remove() {
  const auto ids = own(random_.index(4) != 0);
  if (ids.empty()) return next();
  const std::string id = any(ids);
  auto asked_before = std::make_shared<bool>(false);
  begin(
      "remove " + id,
      [this, id, asked_before]() -> Result<std::vector<Part>> {
        if (!process_->discovered()) return fail(Errc::kUnknownFrame, "not all is known");
        auto parts = route_remove(process_->forest(), process_->directory(), id);
        *asked_before = *asked_before || parts.has_value();
        return parts;
      },
      [this, id, asked_before](Result<void> removed) {
        // Gone by the time of a second attempt.
        const bool missing = !removed && (removed.error().code == Errc::kUnknownFrame ||
                                          removed.error().code == Errc::kNotOwner);
        if (missing && *asked_before && !process_->forest().exists(id)) removed = {};
        const bool denial = !removed && denies(removed.error().code);
        const std::string owner = model_.frame(id).partition;
        bool one_owner = true;
        for (const auto& [other, frame] : model_.frames()) {
          const bool below = frame.may_be_there() && model_.may_be_below(other, id);
          if (below && frame.partition != owner) one_owner = false;
        }
        const bool asked = removed || !one_owner || !never_asked(removed.error());
        if (!denial && asked) model_.remove(id, removed.has_value());
        doubt_unless_stored(id, removed);
      });
}

void Author::look_up(const std::string& a, const std::string& b, bool quiet) {
  auto plan = std::make_shared<LookupPlan>();
  process_->begin(
      "lookup of " + b + " in " + a,
      std::make_shared<Operation>(
          *process_,
          [this, a, b, plan]() -> Result<std::vector<Part>> {
            auto planned = route_lookup(process_->forest(), process_->directory(), a, b);
            if (!planned) return tl::unexpected(planned.error());
            *plan = *std::move(planned);
            return plan->parts;
          },
          [self = shared_from_this(), a, b, plan, quiet](const Result<void>& outcome,
                                                         const std::vector<Reply>& replies) {
            Surroundings& world = self->process_->world();
            Result<StampedTransform> X_AB = fail(Errc::kTimeout, "");
            if (outcome) {
              std::vector<SegmentValues> answers;
              for (const Reply& reply : replies)
                answers.push_back(std::get<SegmentValues>(reply.body));
              X_AB = assemble(*plan, answers);
            } else {
              X_AB = tl::unexpected(outcome.error());
            }
            const std::string code = X_AB ? "done" : std::string(to_string(X_AB.error().code));
            ++self->outcomes_["lookup " + code];
            world.trace(self->prefix_ + " lookup " + a + " " + b + ": " + code);
            std::string wrong;
            if (X_AB) wrong = self->model_.judge(a, b, *X_AB, quiet);
            if (quiet && !X_AB && denies(X_AB.error().code)) {
              wrong = self->model_.judge(a, b, std::nullopt, true);
            }
            if (!wrong.empty()) world.violation("a wrong answer", wrong);
            if (!quiet) self->next();
          }));
}

// Any result is allowed, but in the end all must agree on it.
void Author::contest() {
  const std::string id = contested_frame(random_.index(kContested));
  const std::string other = contested_frame(random_.index(kContested));
  const std::size_t owners = process_->world().plan.owners;
  const std::string parent = random_.index(2) == 0 ? other : base_of(random_.index(owners));
  const auto nothing = [](const Result<void>&) {};
  const auto alone = [](Part part) { return std::vector<Part>{std::move(part)}; };
  Forest& forest = process_->forest();
  Directory& directory = process_->directory();
  switch (random_.index(4)) {
    case 0:
      return begin(
          "contested-remove " + id,
          [&forest, &directory, id] { return route_remove(forest, directory, id); }, nothing);
    case 1:
      return begin(
          "contested-move " + id,
          [&forest, &directory, id, parent, alone] {
            return route_move(forest, directory, id, {parent, {}}).map(alone);
          },
          nothing);
    default: {
      const std::string partition = partition_name(random_.index(owners));
      return begin(
          "contested-add " + id,
          [&forest, &directory, id, parent, partition, alone] {
            return route_add(forest, directory, id, {parent, base_edge(0)}, partition).map(alone);
          },
          nothing);
    }
  }
}

}  // namespace tfdude::simulation
