#include "simulation/operation.hpp"

#include <algorithm>
#include <utility>

#include "partition/requests.hpp"
#include "runtime/requests.hpp"
#include "simulation/process.hpp"

namespace tfdude::simulation {
namespace {

constexpr Instant kPoll = milliseconds(10);

}  // namespace

Operation::Operation(Process& caller, Route route, Then then)
    : caller_(caller), route_(std::move(route)), then_(std::move(then)) {}

Instant Operation::now() const { return caller_.world().timeline.now(); }

void Operation::start() {
  deadline_ = now() + kTimeout;
  caller_.later("deadline", kTimeout, [self = shared_from_this()] {
    if (self->over_) return;
    if (self->phase_ == Phase::kPlan) {
      self->finish(fail(Errc::kTimeout, "not all is known"));
    } else if (self->phase_ == Phase::kAsk) {
      for (auto& answer : self->answers_) {
        if (!answer) answer = Answer{{0, 0, Error{Errc::kTimeout, "no answer"}}};
      }
      self->take_if_answered();
    } else {
      self->look_again();
    }
  });
  plan();
}

std::uint32_t Operation::first_sequence() const {
  std::uint32_t first = ~0U;
  for (const Part& part : parts_) {
    if (part.owner != kHeldHere) first = std::min(first, part.request.sequence);
  }
  return phase_ == Phase::kAsk ? first : ~0U;
}

void Operation::plan() {
  phase_ = Phase::kPlan;
  version_ = caller_.forest().structure_version();
  const bool certain = caller_.discovered();
  auto parts = route_();
  if (parts) return ask(*std::move(parts));
  if (certain || !Discovery::may_appear(parts.error().code))
    return finish(tl::unexpected(parts.error()));
  caller_.later("plan", kPoll, [self = shared_from_this()] {
    if (!self->over_ && self->phase_ == Phase::kPlan) self->plan();
  });
}

void Operation::ask(std::vector<Part> parts) {
  phase_ = Phase::kAsk;
  parts_ = std::move(parts);
  answers_.assign(parts_.size(), std::nullopt);
  stored_ = true;
  ++round_;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].owner == kHeldHere) {
      answers_[i] = Answer{caller_.answer(parts_[i].request), caller_.id()};
    } else {
      parts_[i].request.sequence = caller_.next_sequence();
    }
  }
  send(milliseconds(2), round_);
  take_if_answered();
}

void Operation::send(Instant pause, int round) {
  if (over_ || phase_ != Phase::kAsk || round != round_) return;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (!answers_[i]) caller_.send(parts_[i].partition, parts_[i].request);
  }
  caller_.later("repeat", pause, [self = shared_from_this(), pause, round] {
    self->send(std::min<Instant>(2 * pause, milliseconds(160)), round);
  });
}

void Operation::on_reply(std::uint64_t from, const Reply& reply) {
  if (over_ || phase_ != Phase::kAsk) return;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const bool mine = parts_[i].owner != kHeldHere && parts_[i].request.sequence == reply.sequence;
    if (mine && !answers_[i]) answers_[i] = Answer{reply, from};
  }
  take_if_answered();
}

void Operation::on_lost(const std::string& partition) {
  if (over_ || phase_ != Phase::kAsk) return;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (answers_[i] || parts_[i].partition != partition) continue;
    answers_[i] = Answer{{0, 0, Error{Errc::kUnreachable, "it left before it replied"}}};
  }
  take_if_answered();
}

void Operation::take_if_answered() {
  const bool all = std::all_of(answers_.begin(), answers_.end(),
                               [](const auto& answer) { return answer.has_value(); });
  if (!over_ && phase_ == Phase::kAsk && all) answered();
}

void Operation::answered() {
  phase_ = Phase::kConfirm;
  outcome_ = {};
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const auto* error = std::get_if<Error>(&answers_[i]->reply.body);
    if (error != nullptr && (outcome_ || error->code == Errc::kState)) {
      outcome_ = tl::unexpected(*error);
    }
    if (error != nullptr || parts_[i].owner != kHeldHere) continue;
    if (!is_of_structure(parts_[i].request)) continue;
    stored_ = false;
    caller_.when_stored([self = shared_from_this()](const Result<void>& stored) {
      if (!stored && self->outcome_) self->outcome_ = stored;
      self->stored_ = true;
      self->look_again();
    });
  }
  look_again();
}

void Operation::look_again() {
  if (over_ || phase_ != Phase::kConfirm) return;
  Directory& directory = caller_.directory();
  bool confirmed = stored_;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Reply& reply = answers_[i]->reply;
    const bool done = !std::holds_alternative<Error>(reply.body);
    const Owner owner = parts_[i].owner;
    if (done && owner != kHeldHere) directory.saw_lamport_time(reply.lamport_time);
    const bool reads = std::holds_alternative<LookupRequest>(parts_[i].request.body);
    if (!done || owner == kHeldHere || reads) continue;
    const bool here = directory.epoch(owner) >= reply.epoch || !directory.reachable(owner);
    confirmed = confirmed && here;
    if (here || now() >= deadline_) directory.note_announced_epoch(owner, reply.epoch);
  }
  if (!confirmed && now() < deadline_) return;
  if (!stored_ && outcome_) outcome_ = fail(Errc::kTimeout, "changed, but not stored in time");
  const auto code = outcome_ ? std::optional<Errc>() : outcome_.error().code;
  if (code == Errc::kNotOwner && ++attempts_ < Requests::kAttempts && now() < deadline_) {
    retry(Requests::kStructureDelay);
  } else if (code && Requests::denies_plan(*code) && now() + pause_ < deadline_) {
    retry(pause_);
    pause_ *= 2;
  } else {
    finish(outcome_);
  }
}

// Retries after a while; if the route was stale, as soon as the structure has changed.
void Operation::retry(Instant pause) {
  phase_ = Phase::kPlan;
  await_change(std::min(now() + pause, deadline_), pause == Requests::kStructureDelay);
}

void Operation::await_change(Instant until, bool stale) {
  if (over_ || phase_ != Phase::kPlan) return;
  const bool changed = stale && caller_.forest().structure_version() != version_;
  if (changed || now() >= until) return plan();
  caller_.later("retry", milliseconds(1),
                [self = shared_from_this(), until, stale] { self->await_change(until, stale); });
}

void Operation::finish(Result<void> outcome) {
  over_ = true;
  std::vector<Answer> answers;
  for (auto& answer : answers_) answers.push_back(answer ? std::move(*answer) : Answer{});
  // The callback may own the process that owns this.
  std::exchange(then_, nullptr)(outcome, answers);
}

}  // namespace tfdude::simulation
