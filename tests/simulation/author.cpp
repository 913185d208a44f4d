#include "simulation/author.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tfdude::simulation {
namespace {

using faults::base_of;
using faults::denies;
using faults::partition_name;

}  // namespace

Author::Author(std::shared_ptr<Process> process, std::size_t number, std::size_t actor,
               std::size_t owners)
    : Actor(std::move(process), "author", actor, owners, milliseconds(40)),
      prefix_("c" + std::to_string(number) + "_"),
      moved_(frames_moved_by(number, owners)) {
  faults::fix_bases(model_, owners);
  for (const MovedFrame& one : moved_) {
    model_.fix(one.frame, partition_name(one.owner), {base_of(one.owner), one.value(0)});
  }
  remember();
}

OperationKind Author::draw_kind() {
  const auto& weights = process_->world().plan.weights;
  double all = 0;
  for (const double weight : weights) all += weight;
  double draw = random_.uniform(0, all);
  std::size_t kind = 0;
  while (kind + 1 < kOperationKinds && draw >= weights.at(kind)) draw -= weights.at(kind++);
  return static_cast<OperationKind>(kind);
}

void Author::step() {
  const Surroundings& world = process_->world();
  if (!world.plan.stores || random_.uniform(0, 1) < world.plan.contest) return contest();
  const OperationKind kind = draw_kind();
  if (world.plan.weight(kind) <= 0) return next();
  switch (kind) {
    case OperationKind::kLookup: {
      if (random_.index(6) == 0) return look_up(moved_[0].frame, moved_[1].frame, false);
      const auto ids = own(random_.index(3) != 0);
      if (ids.empty()) return next();
      return look_up(random_.index(3) == 0 ? "world" : any_anchor(), any(ids), false);
    }
    case OperationKind::kUpdate:
      return update();
    case OperationKind::kAdd:
      return add();
    case OperationKind::kMove:
      return move();
    case OperationKind::kRemove:
      return remove();
    case OperationKind::kJoint:
      return set_joint();
    case OperationKind::kForget:
      return forget_one();
  }
}

// ---- power losses

void Author::remember() {
  if (!process_->world().plan.may_lose_power()) return;
  known_.emplace_back(process_->world().timeline.now(), model_);
}

// What it is again, was so at that time or later.
void Author::lost_power(const std::string& partition, Instant first) {
  losses_[partition] = process_->world().timeline.now();
  auto then = known_.begin();
  while (std::next(then) != known_.end() && std::next(then)->first < first) ++then;
  for (; then != known_.end(); ++then) model_.may_be_as_in(then->second, partition);
  remember();
}

bool Author::may_be_lost(const std::string& partition, Instant since) const {
  const auto loss = losses_.find(partition);
  return loss != losses_.end() && loss->second >= since;
}

bool Author::may_be_lost(Instant since) const {
  return std::any_of(losses_.begin(), losses_.end(),
                     [since](const auto& loss) { return loss.second >= since; });
}

// ---- calls

// The time alone does not say so: the clock of the process may be ahead.
bool Author::has_heard(Process& node) const {
  const Directory& known = node.directory();
  const auto changes = process_->directory().announced_epochs();
  const bool all = std::all_of(changes.begin(), changes.end(), [&](const SeenEpoch& change) {
    const auto owner = known.owner(change.partition);
    return change.partition == node.partition() || (owner && known.epoch(*owner) >= change.epoch);
  });
  return all && known.latest_lamport_time() >= process_->directory().latest_lamport_time();
}

// Some changes are made by a Node in the process of the owner, once it has heard of the author's
// changes: nothing orders those of two who know nothing of each other.
void Author::change(const std::string& what, const std::string& owner, const RouteOf& route,
                    Then then) {
  if (random_.index(5) == 0) {
    const auto node = process_->world().serving(owner);
    const auto parts = node && has_heard(*node) ? route(*node) : Result<std::vector<Part>>();
    if (parts && parts->size() == 1 && parts->front().owner == kHeldHere) {
      return change_here(node, "node-" + what, parts->front().request, then);
    }
  }
  begin(
      what, [this, route] { return route(*process_); }, std::move(then));
}

// The process sees the change at once. Others learn of it when it is stored.
void Author::change_here(const std::shared_ptr<Process>& node, const std::string& what,
                         const Request& request, const Then& then) {
  began_ = process_->world().timeline.now();
  by_node_ = true;
  auto over = std::make_shared<bool>(false);
  const auto end = [this, self = shared_from_this(), what, then,
                    over](const Result<void>& outcome) {
    if (!std::exchange(*over, true)) conclude(what, outcome, then);
  };
  const Reply reply = node->answer(request);
  // The author knows of the change, so its process has to hear of it before it removes frames.
  Directory& directory = process_->directory();
  directory.saw_lamport_time(node->directory().latest_lamport_time());
  if (const auto owner = directory.owner(node->partition()))
    directory.note_announced_epoch(*owner, reply.epoch);
  if (const auto* error = std::get_if<Error>(&reply.body)) return end(tl::unexpected(*error));
  node->when_stored(end);
  // Its process may end before.
  process_->later("node", RunningCall::kTimeout,
                  [end] { end(fail(Errc::kTimeout, "not stored")); });
}

void Author::begin(const std::string& what, RunningCall::Route route, Then then) {
  began_ = process_->world().timeline.now();
  by_node_ = false;
  process_->begin(what, std::move(route),
                  [this, self = shared_from_this(), what, then = std::move(then)](
                      const Result<void>& outcome) { conclude(what, outcome, then); });
}

void Author::conclude(const std::string& what, const Result<void>& outcome, const Then& then) {
  Surroundings& world = process_->world();
  const std::string code = outcome ? "done" : std::string(to_string(outcome.error().code));
  ++outcomes_[what.substr(0, what.find(' ')) + " " + code];
  world.trace(prefix_ + " " + what + ": " + code);
  then(outcome);
  // What was sent without an answer arrives before what is sent next, or is lost.
  if (!outcome) rest_ = world.network.longest_delay();
  remember();
  next();
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

// A client sees its own changes, unless the owner is unreachable, or another owner's change that
// the client was told of has not come: without it, a move may seem to close a cycle.
void Author::check_seen(const std::string& id, const std::string& parent) {
  Process& process = *process_;
  const auto frame = process.forest().info(id);
  const Directory& directory = process.directory();
  const auto owner = directory.owner(model_.frame(id).partition);
  const auto told = directory.announced_epochs();
  const bool late = std::any_of(told.begin(), told.end(), [&](const SeenEpoch& one) {
    const auto number = directory.owner(one.partition);  // none if it was forgotten
    return number && directory.owes_change(*number);
  });
  const bool excused = by_node_ || !owner || !directory.reachable(*owner) || late ||
                       may_be_lost(model_.frame(id).partition, began_);
  if (excused || (frame && frame->parent == parent)) return;
  process.world().violation("an author does not see its change",
                            id + " was hung under " + parent + ", and its author sees it " +
                                (frame ? "under " + frame->parent : "nowhere"));
}

void Author::doubt_unless_stored(const std::string& id, const Result<void>& outcome) {
  if (!outcome && !denies(outcome.error().code)) model_.doubt(id);
}

}  // namespace tfdude::simulation
