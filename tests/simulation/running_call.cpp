#include "simulation/running_call.hpp"

#include <algorithm>
#include <utility>

#include "simulation/process.hpp"

namespace tfdude::simulation {
namespace {

using SteadyTime = TimeLimit::Clock::time_point;

// How soon it is planned again while not all is known.
constexpr Instant kPoll = milliseconds(10);

}  // namespace

RunningCall::RunningCall(Process& caller, std::shared_ptr<Task> task, Then then)
    : caller_(caller),
      task_(std::move(task)),
      then_(std::move(then)),
      call_(caller.replies(), *task_, TimeLimit(kTimeout, now()), false) {}

std::shared_ptr<Task> RunningCall::change(Route route) {
  const auto planned = [route = std::move(route)](const Directory&) { return route(); };
  return std::make_shared<ChangeTask<decltype(planned)>>(planned);
}

SteadyTime RunningCall::now() const { return caller_.world().timeline.steady(); }

// A step may itself be an input of the process, which then comes here again.
void RunningCall::go_on() {
  if (over() || std::exchange(steps_, true)) return;
  while (step()) {
  }
  steps_ = false;
  if (over()) finish();
}

bool RunningCall::step() {
  switch (call_.state()) {
    case Call::State::kPlan:
      plan();
      return true;
    case Call::State::kDiscover:
      if (wait_until(planned_ + kPoll)) return false;
      call_.resume();
      return true;
    case Call::State::kAsk:
      return ask();
    case Call::State::kConfirm:
      return call_.confirm(caller_.directory(), now()) || !wait_until(call_.until());
    case Call::State::kStore:
      return store();
    case Call::State::kPause: {
      const auto awaits = call_.awaits();
      const bool changed = awaits && caller_.forest().structure_version() != *awaits;
      if (!changed && wait_until(call_.until())) return false;
      call_.resume();
      return true;
    }
    case Call::State::kKnow:
    case Call::State::kOver:
      break;
  }
  return false;
}

void RunningCall::plan() {
  const bool certain = caller_.discovered();
  planned_ = now();
  call_.plan(caller_.directory(), caller_.forest().structure_version(), certain, now());
}

bool RunningCall::ask() {
  if (!call_.requests().complete()) {
    const SteadyTime next = call_.requests().step(now(), caller_);
    if (!call_.requests().complete() && wait_until(next)) return false;
  }
  if (call_.requests().complete()) call_.replied(now());
  return true;
}

bool RunningCall::store() {
  if (!std::exchange(stores_, true)) {
    caller_.when_stored([weak = weak_from_this()](const Result<void>& stored) {
      const auto self = weak.lock();
      if (!self || !std::exchange(self->stores_, false)) return;
      self->call_.stored(stored, self->now());
      self->go_on();
    });
    if (!stores_) return true;
  }
  if (wait_until(call_.until())) return false;
  stores_ = false;
  call_.stored(fail(Errc::kTimeout, "changed, but not stored in time"), now());
  return true;
}

/// @return whether that is later
bool RunningCall::wait_until(SteadyTime until) {
  if (until <= now()) return false;
  if (std::exchange(wakes_, until) == until) return true;
  caller_.later("call", until - now(), [weak = weak_from_this(), until] {
    const auto self = weak.lock();
    if (self && self->wakes_ == until) self->go_on();
  });
  return true;
}

void RunningCall::finish() {
  Result<void> outcome = call_.outcome();
  if (!outcome && call_.certainty() == Call::Certainty::kUndecided) {
    outcome = fail(Errc::kTimeout, "not all is known: " + outcome.error().message);
  }
  // The callback may own the process that owns this.
  std::exchange(then_, nullptr)(outcome);
}

}  // namespace tfdude::simulation
