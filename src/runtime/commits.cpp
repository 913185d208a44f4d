#include "runtime/commits.hpp"

#include <algorithm>
#include <utility>

#include "base/log.hpp"

namespace tfdude {
namespace {

// The reply to a requester if its change, or a change that its rejection depends on, is not stored.
Error unsaved(const Reply& reply, const Error& why) {
  const auto* error = std::get_if<Error>(&reply.body);
  if (error != nullptr) return error->code == Errc::kState ? *error : why;
  if (why.code != Errc::kState) return why;
  return {why.code, "changed, but not stored; others hear of it once it is stored: " + why.message};
}

}  // namespace

void Commits::hurry() {
  const Lock lock(mutex_);
  hurried_ = true;
}

std::uint64_t Commits::want() {
  const Lock lock(mutex_);
  return ++wanted_;
}

std::optional<Result<void>> Commits::known(std::uint64_t number) const {
  if (stored_up_to_ >= number) return Result<void>();
  if (!ended_ && done_up_to_ < number) return std::nullopt;
  if (failure_) return Result<void>(tl::unexpected(unsaved(Reply{}, *failure_)));
  return Result<void>(fail(Errc::kState, "changed, but not stored: this process ends"));
}

std::optional<Result<void>> Commits::outcome(std::uint64_t number) const {
  const Lock lock(mutex_);
  return known(number);
}

Result<void> Commits::wait(std::uint64_t number, Clock::time_point deadline) {
  Lock lock(mutex_);
  done_.wait_until(lock, deadline,
                   [&]() TFDUDE_REQUIRES(mutex_) { return known(number).has_value(); });
  auto outcome = known(number);
  if (outcome) return *std::move(outcome);
  return fail(Errc::kTimeout, "changed, but not stored in time");
}

std::optional<Error> Commits::failure() const {
  if (!failing_.load(std::memory_order_relaxed)) return std::nullopt;
  const Lock lock(mutex_);
  return failure_;
}

bool Commits::started() const {
  const Lock lock(mutex_);
  return started_;
}

Commits::Clock::time_point Commits::next() const {
  const Lock lock(mutex_);
  if (!started_ || ended_) return kNever;
  if (hurried_ || wanted_ > done_up_to_) return Clock::time_point::min();
  const auto commit = asked_.load() || failure_ ? next_commit_ : kNever;
  return stores_ ? std::min(commit, next_values_) : commit;
}

Ready Commits::begin(Clock::time_point now, bool values) {
  bool values_due = false;
  {
    const Lock lock(mutex_);
    // Before anything is taken: want() calls up to here wait for earlier changes.
    hurried_ = false;
    begun_ = wanted_;
    values_due = values_due_ = started_ && (values || failure_ || now >= next_values_);
  }
  asked_.store(false);
  return effects_.take(values_due);
}

void Commits::finish(const Ready& ready, const Result<void>& stored, const Result<void>& room,
                     Clock::time_point now) {
  const bool first = !started();
  const Result<void>& next = stored ? room : stored;
  // Before anybody who is told now asks for more.
  if (!next && (!first || stored)) note(next);
  tell(ready, stored);
  if (next && !first) note(next);
  const Lock lock(mutex_);
  if (first) started_ = stored.has_value();
  if (first || values_due_) next_values_ = now + periods_.values;
  next_commit_ = now + (failure_ ? periods_.retry : periods_.publish);
  done_up_to_ = begun_;
  if (stored) stored_up_to_ = begun_;
  done_.notify_all();
}

void Commits::end() {
  const Lock lock(mutex_);
  ended_ = true;
  done_.notify_all();
}

// Nobody hears of changes that could be lost.
void Commits::tell(const Ready& ready, const Result<void>& stored) {
  if (stored || ready.refused) {
    effects_.publish(ready);
  } else {
    effects_.take_back(ready);
  }
  for (PendingReply reply : ready.replies) {
    if (!stored) reply.reply.body = unsaved(reply.reply, stored.error());
    effects_.reply(reply);
  }
}

// Logs only the start and the end of a failure, not each attempt. A rejected commit says nothing
// about the store.
void Commits::note(const Result<void>& stored) {
  if (!stored && stored.error().code != Errc::kState) return;
  std::optional<Error> before;
  {
    const Lock lock(mutex_);
    before = failure_;
    failure_ = stored ? std::nullopt : std::optional<Error>(stored.error());
    failing_.store(failure_.has_value());
  }
  if (!stored && (!before || before->message != stored.error().message)) {
    log().error("{}", stored.error().message);
  }
  if (stored && before) log().warn("changes are stored again");
}

}  // namespace tfdude
