#include "calls/hand_over_task.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

namespace tfdude {
namespace {

// What was waited for has not happened in time.
Error late(Error error) {
  if (error.code == Errc::kNotYet) error.code = Errc::kTimeout;
  return error;
}

}  // namespace

std::vector<std::string> HandOverTask::frames() const {
  std::vector<std::string> all{id_};
  if (parent_ && !parent_->empty()) all.push_back(*parent_);
  return all;
}

Result<void> HandOverTask::check_parent() const {
  if (!parent_ && !X_PC_.empty()) {
    return fail(Errc::kInvalidInput,
                "frame " + quote(id_) + ": a value can only be given with a new parent");
  }
  if (auto ok = check_parts({id_, X_PC_}); !ok) return ok;
  if (!parent_ || parent_->empty()) return {};
  auto above = forest_.info(*parent_);
  if (!above) {
    return fail(Errc::kUnknownParent,
                "no frame " + quote(*parent_) + " to be the parent of " + quote(id_));
  }
  for (; above; above = forest_.info(above->parent)) {
    if (above->id != id_) continue;
    return fail(Errc::kCycle, "frame " + quote(id_) + " cannot be moved under " + quote(*parent_) +
                                  ", which lies below it");
  }
  return {};
}

Result<void> HandOverTask::plan(const Directory& directory, Clock::time_point) {
  // The same question after a pause, in which the owners may have heard of each other's claims.
  if (state_ == State::kEnd || state_ == State::kGive) {
    pause_ = std::min(2 * pause_, kLongest);
    return {};
  }
  const auto frame = forest_.info(id_);
  if (!frame) return fail_about_frame(Errc::kUnknownFrame, "no frame " + quote(id_), id_);
  if (auto ok = check_parent(); !ok) return ok;
  auto new_owner = Result<Part>();
  if (to_ == directory.name(kHeldHere)) {
    new_owner = Part{kHeldHere, to_, Request{0, id_, {}}};
  } else {
    new_owner = route_to_partition(directory, Request{0, to_, {}});
  }
  if (!new_owner) return tl::unexpected(std::move(new_owner.error()));
  auto owner = route_to(directory, frame->owner, Request{0, id_, {}});
  if (!owner) return tl::unexpected(std::move(owner.error()));
  const bool has_it = owner->owner == new_owner->owner;
  owner_ = *std::move(owner);
  new_owner_ = *std::move(new_owner);
  // As far as is known here: it may have handed it over since, and its claim stays for a while.
  if (has_it) {
    ask_owner(State::kConfirm, {Step::kEnd, to_});
    return {};
  }
  new_owner_.request.id = id_;
  lamport_time_ = directory.latest_lamport_time();
  next_ = {Step::kRead, to_};
  ask_owner(State::kBegin, {Step::kBegin, to_});
  return {};
}

void HandOverTask::ask_owner(State state, HandOverRequest body) {
  state_ = state;
  parts_.assign(1, owner_);
  parts_.front().request.body = std::move(body);
}

Result<Task::Next> HandOverTask::give(HandedPart part) {
  if (part.edges.empty()) return cancel({Errc::kInvalidInput, "nothing is handed over"});
  const HandedEdge& last = part.edges.back();
  const auto count = static_cast<std::uint32_t>(part.edges.size());
  pause_ = kShortest;
  next_ = {Step::kRead, to_, part.first + count};
  if (last.continues) {
    --next_.edge;
    next_.after = last.samples.empty() ? std::nullopt : std::optional(last.samples.back().stamp);
  }
  is_last_ = part.is_last;
  state_ = State::kGive;
  parts_.assign(1, new_owner_);
  parts_.front().request.body =
      AdoptRequest{owner_.partition, parent_, X_PC_, std::move(part), lamport_time_};
  return Next::kAsk;
}

Result<Task::Next> HandOverTask::cancel(Error why) {
  why_ = std::move(why);
  ask_owner(State::kCancel, {Step::kCancel, to_});
  return Next::kAsk;
}

// The owner in this process answers even if the time is over.
bool HandOverTask::waits(const Error* error, Clock::time_point now) const {
  return error != nullptr && error->code == Errc::kNotYet && now < until_;
}

Result<Task::Next> HandOverTask::take(std::vector<Reply> replies, Clock::time_point now) {
  auto& body = replies.front().body;
  const auto* error = std::get_if<Error>(&body);
  switch (state_) {
    case State::kBegin:
      if (error != nullptr) return tl::unexpected(*error);
      ask_owner(State::kRead, next_);
      return Next::kAsk;
    case State::kRead:
      if (error != nullptr) return cancel(*error);
      if (auto* part = std::get_if<HandedPart>(&body)) return give(std::move(*part));
      return cancel({Errc::kUnsupported,
                     "partition " + quote(owner_.partition) + " does not hand over frames"});
    case State::kGive:
      if (waits(error, now)) return Next::kPlan;
      if (error != nullptr) return cancel(late(*error));
      ask_owner(is_last_ ? State::kEnd : State::kRead,
                is_last_ ? HandOverRequest{Step::kEnd, to_} : next_);
      return Next::kAsk;
    case State::kConfirm:
      had_it_ = error == nullptr;
      if (had_it_) return Next::kDone;
      return fail(error->code == Errc::kChangedMeanwhile ? Errc::kNotOwner : error->code,
                  error->message);
    case State::kEnd:
      if (error == nullptr) return Next::kDone;
      if (waits(error, now)) return Next::kPlan;
      return tl::unexpected(late(*error));
    case State::kCancel:
      // The other one has it all the same.
      if (error != nullptr && error->code == Errc::kAlreadyExists) {
        ask_owner(State::kEnd, {Step::kEnd, to_});
        return Next::kAsk;
      }
      state_ = State::kBegin;
      return tl::unexpected(why_);
  }
  return tl::unexpected(why_);
}

}  // namespace tfdude
