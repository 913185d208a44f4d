#include "calls/call.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/requests.hpp"

namespace tfdude {
namespace {

// Before a call that was denied is planned again; then twice as long.
constexpr Milliseconds kFirstPause{5};

// So long an error about something missing waits for a partition that tells just now what it has.
constexpr Milliseconds kArrivesWithin{1000};

// An owner that hangs has the request, and cannot know that nobody waits for its answer any more.
void say_what_may_follow(const Part& part, Reply& reply) {
  auto* error = std::get_if<Error>(&reply.body);
  if (error == nullptr || error->code != Errc::kUnreachable || !is_change(part.request)) return;
  error->message += "; if it only hangs, it may still apply the change";
}

}  // namespace

bool may_appear(Errc code) { return is_unknown(code) || code == Errc::kNotConnected; }

bool Call::denies_plan(Errc code) {
  return code == Errc::kAlreadyExists || code == Errc::kUnknownParent || code == Errc::kCycle;
}

Call::Call(ReplyTable& table, Task& task, const TimeLimit& limit, bool asks_for_frames)
    : table_(table),
      task_(task),
      limit_(limit),
      keeps_all_(!asks_for_frames),
      asks_(asks_for_frames && !task.frames().empty()),
      state_(asks_ ? State::kKnow : State::kPlan),
      max_age_(task.max_age()),
      pause_(kFirstPause) {}

void Call::known(Result<bool> fresh) {
  if (!fresh) return fail(std::move(fresh.error()));
  fresh_ = *fresh || max_age_ == Task::kFresh;
  // Whatever failed with an earlier answer may succeed with a fresh one.
  max_age_ = Task::kFresh;
  state_ = State::kPlan;
}

void Call::plan(const Directory& directory, std::uint64_t version, bool certain,
                Clock::time_point now) {
  changed_ = attempts_ > 0 && (changed_ || version != version_);
  version_ = version;
  find_restarted(directory);
  auto planned = task_.plan(directory, now);
  if (planned) {
    note_processes(directory);
    return ask();
  }
  const Errc code = planned.error().code;
  const bool may_exist = may_appear(code);
  // The answer of others is certain about frames, but not about partitions.
  const bool known = !may_exist || (certain && !awaits_arrival(directory, now)) ||
                     (asks_ && code != Errc::kUnknownPartition);
  if (!known && !limit_.over(now)) {
    state_ = State::kDiscover;
  } else if (asks_ && !fresh_ && !limit_.over(now)) {
    state_ = State::kKnow;
  } else {
    finish(std::move(planned), !may_exist ? Certainty::kFinal
                               : known    ? Certainty::kKnown
                                          : Certainty::kUndecided);
  }
}

bool Call::awaits_arrival(const Directory& directory, Clock::time_point now) {
  if (!directory.arriving()) return false;
  if (!arrives_by_) arrives_by_ = now + kArrivesWithin;
  return now < *arrives_by_;
}

void Call::note_processes(const Directory& directory) {
  if (!task_.changes() || !asked_.empty()) return;
  for (const Part& part : task_.parts()) {
    if (part.owner != kHeldHere) asked_.emplace_back(part.owner, directory.process(part.owner));
  }
}

void Call::find_restarted(const Directory& directory) {
  for (const auto& [owner, process] : asked_) {
    if (directory.process(owner) != process) restarted_ = directory.name(owner);
  }
}

void Call::ask() {
  requests_.emplace(table_, task_.parts(), limit_);
  state_ = State::kAsk;
}

void Call::replied(Clock::time_point now) {
  std::vector<Reply> replies = requests_->take_replies();
  requests_.reset();
  for (std::size_t i = 0; i < replies.size(); ++i)
    say_what_may_follow(task_.parts()[i], replies[i]);
  if (task_.changes()) note_changes(replies);
  taken_ = task_.take(std::move(replies), now);
  if (!changes_.empty()) {
    state_ = State::kConfirm;
    until_ = limit_.at();
  } else {
    stored_or_none(now);
  }
}

void Call::note_changes(const std::vector<Reply>& replies) {
  const std::vector<Part>& parts = task_.parts();
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Reply& reply = replies[i];
    if (std::holds_alternative<Error>(reply.body)) continue;
    if (parts[i].owner != kHeldHere) {
      // What changes no structure is not waited for here.
      if (std::holds_alternative<ReviseRequest>(parts[i].request.body)) continue;
      changes_.push_back({parts[i].owner, parts[i].partition, reply.epoch, reply.lamport_time});
    } else if (is_stored_first(parts[i].request)) {
      own_ = true;
    }
  }
}

bool Call::confirm(Directory& directory, Clock::time_point now) {
  bool all_here = true;
  late_.clear();
  outdates_ = false;
  const auto is_here = [&](const Change& change) {
    return directory.epoch(change.owner) >= change.epoch || !directory.reachable(change.owner);
  };
  for (const Change& change : changes_) {
    directory.saw_lamport_time(change.lamport_time);
    all_here = all_here && is_here(change);
  }
  if (keeps_all_ && !all_here && !limit_.over(now)) return false;
  for (const Change& change : changes_) {
    if (keeps_all_ && !is_here(change)) late_.push_back(change.partition);
    if (directory.note_announced_epoch(change.owner, change.epoch)) outdates_ = true;
  }
  changes_.clear();
  stored_or_none(now);
  return true;
}

void Call::stored_or_none(Clock::time_point now) {
  // An observation stores its part here once all owners have theirs, or none.
  if (!own_ || (taken_ && *taken_ == Task::Next::kAsk)) return judge(now);
  state_ = State::kStore;
  until_ = limit_.at();
}

void Call::stored(Result<void> stored, Clock::time_point now) {
  own_ = false;
  if (!stored && taken_) taken_ = tl::unexpected(std::move(stored.error()));
  judge(now);
}

void Call::judge(Clock::time_point now) {
  if (!taken_) return retry(std::move(taken_.error()), now);
  switch (*taken_) {
    case Task::Next::kDone:
      return finish({});
    case Task::Next::kAsk:
      return ask();
    case Task::Next::kPlan:
      attempts_ = 0;
      pause_ = kFirstPause;
      max_age_ = task_.max_age();
      return pause(std::min(now + task_.pause(), limit_.at()), {});
  }
}

void Call::retry(Error error, Clock::time_point now) {
  if (!task_.may_plan_again()) return fail(std::move(error));
  const bool denies = denies_plan(error.code);
  const bool in_time = !limit_.over(now + pause_);
  const int most = changed_ ? kAttemptsInChange : kAttempts;
  if (asks_) {
    const bool outdated = error.code == Errc::kNotOwner && pause_ <= kStructureDelay;
    if (!(outdated || denies) || !in_time) return fail(std::move(error));
    if (!fresh_) {
      state_ = State::kKnow;
      return;
    }
  } else if (error.code == Errc::kNotOwner && ++attempts_ < most && !limit_.over(now)) {
    return pause(std::min(now + kStructureDelay, limit_.at()), version_);
  } else if (!denies || !in_time) {
    return fail(std::move(error));
  }
  pause(now + pause_, {});
  pause_ *= 2;
}

void Call::pause(Clock::time_point until, std::optional<std::uint64_t> awaits) {
  until_ = until;
  awaits_ = awaits;
  state_ = State::kPause;
}

void Call::finish(Result<void> outcome, Certainty certainty) {
  outcome_ = std::move(outcome);
  // What is there already may have been made by this call.
  if (!outcome_ && outcome_.error().code == Errc::kAlreadyExists && !restarted_.empty()) {
    outcome_ = fail_about_partition(Errc::kUnreachable,
                                    "partition " + quote(restarted_) +
                                        " was restarted before it answered; it may have " +
                                        "applied the change: " + outcome_.error().message,
                                    restarted_);
  }
  certainty_ = certainty;
  requests_.reset();
  state_ = State::kOver;
}

}  // namespace tfdude
