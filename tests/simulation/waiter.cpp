#include "simulation/waiter.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "faults/frames.hpp"
#include "simulation/cast.hpp"

namespace tfdude::simulation {
namespace {

using faults::base_edge;
using faults::base_of;

// How much later than its time a lookup may end.
constexpr Instant kWaitEndsWithin = milliseconds(20);
// How long after the faults each frame that is known can be looked up.
constexpr Instant kCalmAfter = milliseconds(5000);

}  // namespace

Waiter::Waiter(std::shared_ptr<Process> process, std::size_t actor, std::size_t owners)
    : Actor(std::move(process), "waiter", actor, owners, milliseconds(200)) {}

void Waiter::start() {
  Planned::begin();
  process_->keep_planned(std::static_pointer_cast<Waiter>(shared_from_this()));
  next();
}

void Waiter::step() {
  Surroundings& world = process_->world();
  if (may_remove()) return remove();
  base_ = random_.index(world.plan.owners);
  frame_ = random_.index(3) == 0 ? extra_of(base_) : base_of(base_);
  limit_.emplace(milliseconds(500 + random_.index(8000)), now());
  had_to_ = false;
  Planned::begin();
  if (random_.index(2) == 0) return wait({Errc::kTimeout, "not asked yet"});
  const auto task = process_->lookup("world", frame_);
  process_->begin("lookup of " + frame_ + ", which may wait", task,
                  [this, self = shared_from_this(), task](const Result<void>& outcome) {
                    const bool waits =
                        !outcome && is_worth_waiting(outcome.error(), {}) && !limit_->over(now());
                    if (waits) return wait(outcome.error());
                    end(outcome.map([&] { return task->X_AB(); }));
                  });
}

bool Waiter::may_remove() const {
  const auto handed = process_->forest().info(kHanded);
  return handed && process_->directory().name(handed->owner) == faults::partition_name(0);
}

void Waiter::remove() {
  process_->begin(
      "remove what a deputy has",
      [this] { return route_remove(process_->forest(), process_->directory(), kHanded); },
      [this, self = shared_from_this()](const Result<void>& removed) {
        if (removed) process_->world().handed_removed = true;
        ++outcomes_[removed ? "a deputy's frame was removed" : "a deputy's frame was not removed"];
        next();
      });
}

Result<LookupPlan> Waiter::route() const {
  return route_lookup(process_->forest(), process_->directory(), "world", frame_);
}

Result<LookupInProgress> Waiter::plan(const WantedLookup& wanted) {
  return LookupInProgress::plan(process_->forest(), process_->directory(), ClockKind::kSystem,
                                wanted, process_->hints(), now());
}

std::string Waiter::plan() const {
  if (lookup_ == nullptr) return "none";
  const auto planned = route();
  if (!planned) return std::string(to_string(planned.error().code));
  std::string text = "asks";
  for (const Part& part : planned->parts) text += " " + part.partition;
  return text;
}

TimeLimit::Clock::time_point Waiter::now() const { return process_->world().timeline.steady(); }

void Waiter::renew() {
  ++told_;
  attend(true);
}

void Waiter::all_replied() {
  process_->later("lookup replies", Instant(0), [this, self = shared_from_this()] {
    if (lookup_ != nullptr) attend(false);
  });
}

// What is sent for the first time has just been planned.
Result<void> Waiter::send(const std::string& partition, const Request& request,
                          TimeLimit::Clock::time_point until) {
  const auto& segments = std::get<LookupRequest>(request.body).segments;
  const auto planned = route();
  const auto asks = [&](const Part& part) {
    const auto& all = std::get<LookupRequest>(part.request.body).segments;
    return part.partition == partition &&
           std::equal(all.begin(), all.end(), segments.begin(), segments.end(),
                      [](const PathEnds& a, const PathEnds& b) {
                        return a.from == b.from && a.to == b.to;
                      });
  };
  const bool current = planned && std::any_of(planned->parts.begin(), planned->parts.end(), asks);
  if (sent_.insert(request.sequence).second && !current) {
    process_->world().violation("a route is kept too long", frame_ + ": asks " + partition);
  }
  return process_->send(partition, request, until);
}

void Waiter::wait(Error last) {
  sent_.clear();
  lookup_ = std::make_shared<WaitingLookup>(wanted(), *limit_, std::move(last), now());
  Planned::begin();
  Surroundings& world = process_->world();
  world.invariants.called(
      process_, [weak = std::weak_ptr(lookup_)] { return weak.expired(); },
      "lookup of " + frame_ + ", which waits",
      world.timeline.now() + (limit_->at() - now()) + kWaitEndsWithin);
  attend(false);
}

void Waiter::attend(bool written) {
  WaitingLookup::Shared shared{process_->forest(),
                               process_->replies(),
                               static_cast<RequestLink&>(*this),
                               process_->hints(),
                               static_cast<LookupHost&>(*this),
                               static_cast<ReplyListener*>(this),
                               RunningCall::kTimeout};
  const WaitingLookup::News news{process_->forest().structure_version() + told_, written, 1};
  if (auto found = lookup_->attend(shared, news, now())) {
    lookup_.reset();
    return end(*found);
  }
  had_to_ = had_to_ || lookup_->last().message != "not asked yet";
  const auto next = lookup_->next();
  if (std::exchange(wakes_, next) == next) return;
  process_->later("lookup", next - now(), [this, self = shared_from_this(), next] {
    if (lookup_ == nullptr || wakes_ != next) return;
    wakes_ = {};  // it may be due again at once
    attend(false);
  });
}

void Waiter::end(const Result<StampedTransform>& X_WB) {
  Surroundings& world = process_->world();
  const bool right = !X_WB || frame_ != base_of(base_) ||
                     (X_WB->pose.translation() - base_edge(base_).pose.translation()).norm() < 1e-9;
  if (!right) world.violation("a wrong answer", "a lookup that waited, of " + frame_);
  const bool calm =
      world.plan.lasting.empty() && world.timeline.now() > world.plan.storm + kCalmAfter;
  if (!X_WB && calm && route()) world.violation("a lookup waits for nothing", frame_);
  const std::string how = !X_WB ? "timeout" : had_to_ ? "done after a while" : "done";
  Planned::begin();
  ++outcomes_["waiting lookup " + how];
  world.trace("a waiting lookup of " + frame_ + ": " + how);
  next();
}

}  // namespace tfdude::simulation
