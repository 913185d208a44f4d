#include "calls/waiting_lookup.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace tfdude {
namespace {

// Owners are asked again after a quarter of the time waited so far, within these bounds.
constexpr std::chrono::nanoseconds kAskSoonest = Milliseconds(1);
constexpr std::chrono::nanoseconds kAskLatest = Milliseconds(50);
// Minimum interval of requests, for all waiting lookups together.
constexpr std::chrono::microseconds kAskEvery{250};
// Owners are asked for the last time so long before the time limit, and longer for each that waits.
constexpr std::chrono::nanoseconds kLastAsked = Milliseconds(10);
constexpr std::chrono::microseconds kLastAskedEach{25};

}  // namespace

bool may_return(Errc code) {
  return may_appear(code) || code == Errc::kUnreachable || code == Errc::kTimeout ||
         code == Errc::kNotOwner || code == Errc::kNotYet;
}

bool is_worth_waiting(const Error& error, const Query& query) {
  // What was believed then stays as it is.
  const bool of_time = error.code == Errc::kTooOld || error.code == Errc::kNotYet;
  if (query.believed_at && of_time) return false;
  // For the latest common time: one edge is ahead of the data of another.
  if (error.code == Errc::kTooOld) return !query.at;
  return may_return(error.code);
}

WaitingLookup::Answer WaitingLookup::attend(const Shared& shared, const News& news,
                                            Clock::time_point now) {
  if (asking_) return go_on_asking(shared, news, now);
  if (news.written && far_) hurry(shared, now);
  const bool may_be_here = version_ != news.version || (news.written && !far_);
  if (now < next_ && !may_be_here && !limit_.over(now)) return std::nullopt;
  return attempt(shared, news, now);
}

WaitingLookup::Answer WaitingLookup::attempt(const Shared& shared, const News& news,
                                             Clock::time_point now) {
  version_ = news.version;
  auto here = shared.forest.lookup(wanted_.a, wanted_.b, wanted_.query);
  const bool all_held =
      here || here.error().code == Errc::kNotYet || here.error().code == Errc::kTooOld;
  if (all_held) return judge(shared, news, std::move(here), false, now);
  auto plan = shared.host.plan(wanted_);
  if (!plan) {
    const bool far = shared.host.asks_for_frames();
    return judge(shared, news, tl::unexpected(std::move(plan.error())), far, now);
  }
  if (limit_.over(now)) return judge(shared, news, tl::unexpected(last_), true, now);
  plan_.emplace(*std::move(plan));
  const TimeLimit until(shared.timeout, now);
  until_ = until.at() < limit_.at() ? until : limit_;
  return ask(shared, news, false, now);
}

WaitingLookup::Answer WaitingLookup::ask(const Shared& shared, const News& news, bool again,
                                         Clock::time_point now) {
  asking_.emplace(shared.replies, plan_->parts(), until_, shared.listener);
  if (const Error* lacking = asking_->answer(shared.link)) {
    // No other owner is asked in vain. If another one determined the instant, its data is missing.
    Error error = *lacking;
    asking_.reset();
    return judge(shared, news, tl::unexpected(std::move(error)), again, now);
  }
  return go_on_asking(shared, news, now);
}

WaitingLookup::Answer WaitingLookup::go_on_asking(const Shared& shared, const News& news,
                                                  Clock::time_point now) {
  if (!asking_->complete() && !until_.over(now)) {
    next_ = std::min(asking_->send_due(now, shared.link), until_.at());
  }
  if (!asking_->complete()) {
    if (!until_.over(now)) return std::nullopt;
    asking_->give_up();
    // Their last answer is more informative than the fact that they had no time to repeat it.
    if (limit_.over(now) && last_.code != Errc::kTimeout) {
      asking_.reset();
      return judge(shared, news, tl::unexpected(last_), true, now);
    }
  }
  auto found = plan_->take(asking_->take_replies(), shared.hints, now);
  asking_.reset();
  if (found && *found) shared.host.asked(plan_->parts());
  return found ? judge(shared, news, *std::move(found), true, now) : ask(shared, news, true, now);
}

WaitingLookup::Answer WaitingLookup::judge(const Shared& shared, const News& news, Found found,
                                           bool far, Clock::time_point now) {
  if (found || !is_worth_waiting(shared, found.error())) return found;
  last_ = std::move(found.error());
  if (limit_.over(now)) return Found(tl::unexpected(shared.host.last_word(last_, limit_)));
  // Nothing tells that all is known.
  far_ = far || wanted_.once;
  // What plan() would find may have changed during the request, and the data may have come.
  const bool again = forward_ == Forward::kAfterThis || version_ != news.version;
  if (forward_ == Forward::kAfterThis) {
    forward_ = Forward::kNext;
  } else {
    forward_ = forward_ == Forward::kNext ? Forward::kInVain : Forward::kNo;
  }
  next_ = again ? now : next_attempt(shared, news, now);
  if (far) hurry(shared, now);
  return std::nullopt;
}

bool WaitingLookup::is_worth_waiting(const Shared& shared, const Error& error) const {
  if (wanted_.once) return may_appear(error.code) && !shared.host.knows_all();
  return tfdude::is_worth_waiting(error, wanted_.query);
}

/// Owners that have pushed the wanted data are asked again at once.
void WaitingLookup::hurry(const Shared& shared, Clock::time_point now) {
  if (hurried_ || !shared.host.was_pushed(wanted_)) return;
  hurried_ = true;
  next_ = now;
}

bool WaitingLookup::put_forward(std::optional<Time> stamp, Clock::time_point when) {
  const auto at = wanted_.query.at;
  const bool is_later = at && stamp && *at > *stamp;
  if (is_later || forward_ != Forward::kNo || !(far_ || asking_)) return false;
  forward_ = asking_ ? Forward::kAfterThis : Forward::kNext;
  if (!asking_) next_ = std::min(next_, when);
  return true;
}

// Missing local data wakes the thread when it comes.
WaitingLookup::Clock::time_point WaitingLookup::next_attempt(const Shared& shared, const News& news,
                                                             Clock::time_point now) const {
  if (!far_) return limit_.at();
  const std::chrono::nanoseconds waited = now - began_;
  std::chrono::nanoseconds pause = waited / 4;
  const auto today = shared.host.clock();
  if (const auto at = wanted_.query.at; at && today) {
    // Most sources use stamps of a clock that agrees with this one.
    if (*at > *today) {
      pause = *at - *today;
    } else if (*at > *today - waited) {
      pause = (*today - *at) / 4;
    }
  }
  pause = std::clamp(pause, kAskSoonest, kAskLatest);
  const auto next = now + std::max<std::chrono::nanoseconds>(pause, news.waiting * kAskEvery);
  const auto last =
      limit_.at() - std::max<std::chrono::nanoseconds>(kLastAsked, news.waiting * kLastAskedEach);
  return now < last ? std::min(next, last) : next;
}

}  // namespace tfdude
