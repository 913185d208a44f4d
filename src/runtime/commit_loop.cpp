#include "runtime/commit_loop.hpp"

#include <algorithm>
#include <utility>

#include "base/log.hpp"
#include "base/mutex.hpp"

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

CommitLoop::CommitLoop(std::unique_ptr<StateStore> store, Effects& effects, Periods periods)
    : store_(std::move(store)),
      effects_(effects),
      periods_(periods),
      rounds_(loop_, [this] { return run(); }) {}

Result<void> CommitLoop::start() {
  const Ready ready = effects_.take(false);
  Result<void> stored = store(ready);
  tell(ready, stored);
  if (!stored) return stored;
  {
    const Lock lock(mutex_);
    next_values_ = Clock::now() + periods_.values;
    started_ = true;
  }
  rounds_.ask();
  return {};
}

void CommitLoop::stop() {
  rounds_.stop();
  const Lock lock(mutex_);
  if (!started_ || ended_) return;
  next_values_ = {};
  round();
  ended_ = true;
  done_.notify_all();
}

void CommitLoop::hurry() {
  {
    const Lock lock(mutex_);
    hurried_ = true;
  }
  rounds_.ask();
}

Result<void> CommitLoop::flush(Clock::time_point deadline) {
  Lock lock(mutex_);
  const std::uint64_t mine = ++wanted_;
  lock.unlock();
  rounds_.ask();
  lock.lock();
  const bool in_time = done_.wait_until(
      lock, deadline, [&]() TFDUDE_REQUIRES(mutex_) { return ended_ || done_up_to_ >= mine; });
  if (stored_up_to_ >= mine) return {};
  if (!in_time) return fail(Errc::kTimeout, "changed, but not stored in time");
  if (failure_) return tl::unexpected(unsaved(Reply{}, *failure_));
  return fail(Errc::kState, "changed, but not stored: this process ends");
}

std::optional<Error> CommitLoop::failure() const {
  if (!failing_.load(std::memory_order_relaxed)) return std::nullopt;
  const Lock lock(mutex_);
  return failure_;
}

CommitLoop::Clock::time_point CommitLoop::run() {
  const Lock lock(mutex_);
  if (!started_) return Loop::kNever;
  if (next_round() <= Clock::now()) round();
  return next_round();
}

CommitLoop::Clock::time_point CommitLoop::next_round() const {
  if (hurried_ || wanted_ > done_up_to_) return Clock::time_point::min();
  auto next = Loop::kNever;
  if (asked_.load() || failure_) next = next_commit_;
  if (store_ != nullptr) next = std::min(next, next_values_);
  return next;
}

void CommitLoop::round() {
  // Before anything is taken: flush() calls up to here wait for earlier changes.
  hurried_ = false;
  const std::uint64_t wanted = wanted_;
  const bool failed = failure_.has_value();
  mutex_.unlock();
  asked_.store(false);
  const bool values_due = failed || Clock::now() >= next_values_;
  const Ready ready = effects_.take(values_due);
  const Result<void> stored = store(ready);
  if (!stored) note(stored);
  tell(ready, stored);
  if (stored) note(stored);
  if (values_due) next_values_ = Clock::now() + periods_.values;
  mutex_.lock();
  next_commit_ = Clock::now() + (failure_ ? periods_.retry : periods_.publish);
  done_up_to_ = wanted;
  if (stored) stored_up_to_ = wanted;
  done_.notify_all();
}

Result<void> CommitLoop::store(const Ready& ready) {
  if (ready.refused) return tl::unexpected(*ready.refused);
  if (store_ == nullptr || ready.rows.empty()) return {};
  return store_->save(ready.rows);
}

// Nobody hears of changes that could be lost.
void CommitLoop::tell(const Ready& ready, const Result<void>& stored) {
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
void CommitLoop::note(const Result<void>& stored) {
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
  if (stored && before) log().warn("pending changes are stored again");
}

}  // namespace tfdude
