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

// An owner that has no answer yet is asked again.
constexpr Instant kAskAgain = milliseconds(50);

bool is_structural(Errc code) { return may_appear(code) || code == Errc::kUnreachable; }

}  // namespace

Waiter::Waiter(std::shared_ptr<Process> process, std::size_t actor)
    : process_(std::move(process)), actor_(actor), random_(0) {}

void Waiter::start() {
  begin();
  process_->keep_planned(shared_from_this());
  next();
}

void Waiter::next() {
  if (stopped_) return;
  random_ = testing::Random(process_->world().plan.seed_of(actor_, ++steps_));
  process_->later("waiter", std::chrono::microseconds(random_.index(200'000)),
                  [self = shared_from_this()] {
                    if (!self->stopped_) self->step();
                  });
}

void Waiter::step() {
  Surroundings& world = process_->world();
  if (world.plan.leaves_out(actor_, steps_)) return next();
  world.did(actor_, steps_);
  if (may_remove()) return remove();
  base_ = random_.index(world.plan.owners);
  frame_ = random_.index(3) == 0 ? extra_of(base_) : base_of(base_);
  until_ = world.timeline.now() + milliseconds(500 + random_.index(8000));
  waits_ = true;
  had_to_ = false;
  begin();
  attempt();
}

bool Waiter::may_remove() const {
  const auto handed = process_->forest().info(kHanded);
  return handed && process_->directory().name(handed->owner) == faults::partition_name(0);
}

void Waiter::remove() {
  process_->begin(
      "remove what a deputy has",
      [this] { return route_remove(process_->forest(), process_->directory(), kHanded); },
      [self = shared_from_this()](const Result<void>& removed) {
        if (removed) self->process_->world().handed_removed = true;
        ++self->outcomes_[removed ? "a deputy's frame was removed"
                                  : "a deputy's frame was not removed"];
        self->next();
      });
}

Result<LookupPlan> Waiter::route() const {
  return route_lookup(process_->forest(), process_->directory(), "world", frame_);
}

std::string Waiter::plan() const {
  if (!waits_) return "none";
  const auto planned = route();
  if (!planned) return std::string(to_string(planned.error().code));
  std::string text = "asks";
  for (const Part& part : planned->parts) text += " " + part.partition;
  return text;
}

void Waiter::renew() {
  if (asks_) {
    again_ = true;
  } else {
    attempt();
  }
}

void Waiter::attempt() {
  Surroundings& world = process_->world();
  if (world.timeline.now() >= until_) return finish("timeout");
  asks_ = true;
  again_ = false;
  const auto task = process_->lookup("world", frame_);
  process_->begin("lookup of " + frame_ + ", which waits", task,
                  [self = shared_from_this(), task](const Result<void>& outcome) {
                    self->attempted(outcome.map([&] { return task->X_AB(); }));
                  });
}

void Waiter::attempted(const Result<StampedTransform>& X_WB) {
  asks_ = false;
  Surroundings& world = process_->world();
  if (X_WB) {
    const bool right =
        frame_ != base_of(base_) ||
        (X_WB->pose.translation() - base_edge(base_).pose.translation()).norm() < 1e-9;
    if (!right) world.violation("a wrong answer", "a lookup that waited, of " + frame_);
    return finish(had_to_ ? "done after a while" : "done");
  }
  had_to_ = true;
  if (again_) return attempt();
  if (is_structural(X_WB.error().code)) {
    // Without being told of a change it looks again only to give up.
    const Instant left = until_ - world.timeline.now();
    return process_->later("give up", std::max(left, Instant(0)),
                           [self = shared_from_this(), until = until_] {
                             const bool due = self->waits_ && self->until_ == until;
                             if (due && !self->asks_) self->finish("timeout");
                           });
  }
  process_->later("ask again", kAskAgain, [self = shared_from_this(), until = until_] {
    if (self->waits_ && self->until_ == until && !self->asks_) self->attempt();
  });
}

void Waiter::finish(const std::string& how) {
  waits_ = false;
  begin();
  ++outcomes_["waiting lookup " + how];
  process_->world().trace("a waiting lookup of " + frame_ + ": " + how);
  next();
}

void Waiter::check() {
  if (waits_ && !asks_ && route()) {
    process_->world().violation("a lookup waits for nothing", frame_);
  }
}

}  // namespace tfdude::simulation
