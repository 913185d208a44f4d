#include "runtime/pending_lookups.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "base/mutex.hpp"
#include "runtime/discovery.hpp"

namespace tfdude {
namespace {

// Owners are asked again after a quarter of the time waited so far, within these bounds.
constexpr std::chrono::nanoseconds kAskSoonest = Milliseconds(1);
constexpr std::chrono::nanoseconds kAskLatest = Milliseconds(50);
// Minimum interval of requests, for all waiting lookups together.
constexpr std::chrono::microseconds kAskEvery{250};

// If a thread writes continuously, waiting lookups are checked at most at this interval, and take
// at most a quarter of a processor: the writer wakes the thread, which costs the writer some
// microseconds.
constexpr int kRest = 3;
constexpr std::chrono::nanoseconds kShortestRest = std::chrono::microseconds(100);
constexpr std::chrono::nanoseconds kLongestRest = Milliseconds(10);

bool is_structural(Errc code) { return Discovery::may_appear(code) || code == Errc::kUnreachable; }

}  // namespace

bool is_worth_waiting(const Error& error, const Query& query) {
  switch (error.code) {
    case Errc::kNotYet:
    case Errc::kTimeout:
    case Errc::kNotOwner:
      return true;
    case Errc::kTooOld:
      // For the latest common time: one edge is ahead of the data of another.
      return !query.at;
    default:
      return is_structural(error.code);
  }
}

PendingLookups::PendingLookups(Forest& forest, Calls& calls, SharedHints& hints, Threads& threads,
                               Links links)
    : forest_(forest),
      calls_(calls),
      hints_(hints),
      links_(std::move(links)),
      callbacks_(threads.callbacks),
      attends_(threads.calls, [this] { return run(); }) {}

void PendingLookups::stop() {
  {
    const Lock lock(mutex_);
    stopping_ = true;
  }
  attends_.stop();
  forest_.on_commit(nullptr, this);
  All left = std::exchange(all_, {});
  {
    const Lock lock(mutex_);
    std::move(added_.begin(), added_.end(), std::back_inserter(left));
    added_.clear();
  }
  // Here, since objects held by callbacks are destroyed with them.
  for (const auto& lookup : left) give_up(*lookup);
}

void PendingLookups::give_up(Lookup& lookup) {
  if (lookup.callback != nullptr) {
    lookup.callback->close();
  } else {
    lookup.promise.set_value(
        fail(Errc::kTimeout,
             "the lookup was cancelled, as its client is closed: " + lookup.last.message));
  }
}

std::future<PendingLookups::Found> PendingLookups::add(Wanted wanted, const Deadline& deadline,
                                                       Error last) {
  auto lookup = std::make_unique<Lookup>(std::move(wanted), deadline, std::move(last));
  auto future = lookup->promise.get_future();
  add(std::move(lookup));
  return future;
}

std::shared_ptr<Callbacks::Line> PendingLookups::add(Wanted wanted, const Deadline& deadline,
                                                     Error last, Callback callback) {
  auto lookup = std::make_unique<Lookup>(std::move(wanted), deadline, std::move(last));
  auto found = lookup->found = std::make_shared<Found>();
  auto call = lookup->callback = callbacks_.line();
  call->prepare([found, callback = std::move(callback)] { callback(std::move(*found)); });
  add(std::move(lookup));
  return call;
}

void PendingLookups::add(std::unique_ptr<Lookup> lookup) {
  {
    const Lock lock(mutex_);
    if (!stopping_) added_.push_back(std::move(lookup));
  }
  waiting_ = true;
  if (lookup != nullptr) {
    give_up(*lookup);
  } else {
    wake(urgent_);
  }
}

void PendingLookups::look_again() {
  ++routes_;
  if (waiting_.load()) wake(written_);
}

std::uint64_t PendingLookups::version() const {
  return forest_.structure_version() + routes_.load();
}

PendingLookups::Clock::time_point PendingLookups::run() {
  const auto begin = Clock::now();
  if (!urgent_.load() && begin < next_) {
    if (!written_.load()) return next_;
    if (begin < rests_until_) return std::min(next_, rests_until_);
  }
  // Before the check, so that events meanwhile are not missed.
  urgent_.store(false);
  const bool written = written_.exchange(false);
  {
    const Lock lock(mutex_);
    std::move(added_.begin(), added_.end(), std::back_inserter(all_));
    added_.clear();
    waiting_ = !all_.empty();
  }
  if (listens_ != !all_.empty()) {
    listens_ = !all_.empty();
    forest_.on_commit(listens_ ? [this] { wake(written_); } : std::function<void()>(), this);
  }
  next_ = attend(all_, written);
  const auto end = Clock::now();
  rests_until_ = end + std::clamp<std::chrono::nanoseconds>(kRest * (end - begin), kShortestRest,
                                                            kLongestRest);
  return next_;
}

/// @return when there is more to do
PendingLookups::Clock::time_point PendingLookups::attend(All& all, bool written) {
  count_ = all.size();
  auto next = Clock::time_point::max();
  const auto over = [&](const std::unique_ptr<Lookup>& lookup) {
    if (attend(*lookup, written)) return true;
    next = std::min({next, lookup->next, lookup->deadline.at()});
    return false;
  };
  all.erase(std::remove_if(all.begin(), all.end(), over), all.end());
  return next;
}

/// Each of the following returns true if the lookup is finished.
bool PendingLookups::attend(Lookup& lookup, bool written) {
  if (lookup.callback != nullptr && lookup.callback->closed()) return true;
  if (lookup.asking) return go_on_asking(lookup);
  if (written && lookup.far) hurry(lookup);
  const auto now = Clock::now();
  const bool may_be_here = lookup.version != version() || (written && !lookup.far);
  if (now < lookup.next && !may_be_here && !lookup.deadline.over(now)) return false;
  return attempt(lookup);
}

bool PendingLookups::attempt(Lookup& lookup) {
  lookup.version = version();
  const Wanted& wanted = lookup.wanted;
  auto here = forest_.lookup(wanted.a, wanted.b, wanted.query);
  const bool all_held =
      here || here.error().code == Errc::kNotYet || here.error().code == Errc::kTooOld;
  if (all_held) return judge(lookup, std::move(here), false);
  auto plan = links_.plan(wanted);
  if (!plan) return judge(lookup, tl::unexpected(std::move(plan.error())), links_.plan_asks);
  if (lookup.deadline.over()) return judge(lookup, tl::unexpected(lookup.last), true);
  lookup.gathering = *std::move(plan);
  lookup.until = lookup.deadline.within(links_.timeout);
  return ask(lookup);
}

bool PendingLookups::ask(Lookup& lookup) {
  lookup.asking.emplace(calls_, lookup.gathering->parts(), [this] { wake(urgent_); });
  if (const Error* lacking = lookup.asking->answer(links_.answer_here)) {
    // No other owner is asked in vain.
    Error error = *lacking;
    lookup.asking.reset();
    return judge(lookup, tl::unexpected(std::move(error)), false);
  }
  return go_on_asking(lookup);
}

bool PendingLookups::go_on_asking(Lookup& lookup) {
  const auto now = Clock::now();
  if (!lookup.asking->complete() && !lookup.until->over(now)) {
    lookup.next = std::min(lookup.asking->send_due(now, links_.send), lookup.until->at());
  }
  if (!lookup.asking->complete()) {
    if (!lookup.until->over(now)) return false;
    lookup.asking->give_up(*lookup.until);
    // Their last answer is more informative than the fact that they had no time to repeat it.
    if (lookup.deadline.over(now) && lookup.last.code != Errc::kTimeout) {
      lookup.asking.reset();
      return judge(lookup, tl::unexpected(lookup.last), true);
    }
  }
  auto found = lookup.gathering->take(lookup.asking->take_replies(), hints_);
  lookup.asking.reset();
  return found ? judge(lookup, *std::move(found), true) : ask(lookup);
}

bool PendingLookups::judge(Lookup& lookup, Found found, bool far) {
  if (found || !is_worth_waiting(found.error(), lookup.wanted.query)) {
    finish(lookup, std::move(found));
    return true;
  }
  lookup.last = std::move(found.error());
  if (lookup.deadline.over()) {
    finish(lookup, tl::unexpected(links_.last_word(lookup.last, lookup.deadline)));
    return true;
  }
  lookup.far = far;
  lookup.next = next_attempt(lookup, far);
  // The data may have come during the request.
  if (far) hurry(lookup);
  return false;
}

/// Owners that have pushed the wanted data are asked again at once.
void PendingLookups::hurry(Lookup& lookup) {
  if (lookup.hurried || !links_.was_pushed(lookup.wanted)) return;
  lookup.hurried = true;
  lookup.next = Clock::now();
}

// Missing local data wakes the thread when it comes.
PendingLookups::Clock::time_point PendingLookups::next_attempt(const Lookup& lookup,
                                                               bool far) const {
  if (!far) return lookup.deadline.at();
  const auto now = Clock::now();
  const std::chrono::nanoseconds waited = now - lookup.began;
  std::chrono::nanoseconds pause = waited / 4;
  const auto today = links_.clock();
  if (const auto at = lookup.wanted.query.at; at && today) {
    // Most sources use stamps of a clock that agrees with this one.
    if (*at > *today) {
      pause = *at - *today;
    } else if (*at > *today - waited) {
      pause = (*today - *at) / 4;
    }
  }
  pause = std::clamp(pause, kAskSoonest, kAskLatest);
  return now + std::max<std::chrono::nanoseconds>(pause, count_ * kAskEvery);
}

void PendingLookups::finish(Lookup& lookup, Found found) {
  if (lookup.callback == nullptr) {
    lookup.promise.set_value(std::move(found));
    return;
  }
  *lookup.found = std::move(found);
  lookup.callback->go();
}

}  // namespace tfdude
