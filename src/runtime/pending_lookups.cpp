#include "runtime/pending_lookups.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "base/mutex.hpp"

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

bool is_structural(Errc code) { return may_appear(code) || code == Errc::kUnreachable; }

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

PendingLookups::PendingLookups(Forest& forest, ReplyTable& replies, RequestLink& link,
                               SharedHints& hints, Links links)
    : forest_(forest), replies_(replies), link_(link), hints_(hints), links_(std::move(links)) {}

void PendingLookups::stop() {
  {
    const Lock lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  All left;
  {
    const Lock lock(mutex_);
    left = std::exchange(added_, {});
  }
  // Here, since objects held by callbacks are destroyed with them.
  for (const auto& lookup : left) give_up(*lookup);
  callbacks_.stop();
}

void PendingLookups::give_up(Lookup& lookup) {
  if (lookup.callback != nullptr) {
    lookup.callback->cancel();
  } else {
    lookup.promise.set_value(
        fail(Errc::kTimeout,
             "the lookup was cancelled, as its client is closed: " + lookup.last.message));
  }
}

std::future<PendingLookups::Found> PendingLookups::add(WantedLookup wanted,
                                                       const Deadline& deadline, Error last) {
  auto lookup = std::make_unique<Lookup>(std::move(wanted), deadline, std::move(last));
  auto future = lookup->promise.get_future();
  add(std::move(lookup));
  return future;
}

std::shared_ptr<OneCall<PendingLookups::Found>> PendingLookups::add(
    WantedLookup wanted, const Deadline& deadline, Error last, OneCall<Found>::Function callback) {
  auto lookup = std::make_unique<Lookup>(std::move(wanted), deadline, std::move(last));
  auto call = lookup->callback = std::make_shared<OneCall<Found>>(std::move(callback));
  add(std::move(lookup));
  return call;
}

void PendingLookups::add(std::unique_ptr<Lookup> lookup) {
  {
    const Lock lock(mutex_);
    if (!stopping_) {
      if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
      added_.push_back(std::move(lookup));
    }
  }
  if (lookup != nullptr) {
    give_up(*lookup);
  } else {
    wake(urgent_);
  }
}

// May be called with the forest's lock held.
void PendingLookups::wake(std::atomic<bool>& why) {
  if (why.exchange(true)) return;
  // The lock prevents a notification between the thread's check and its sleep.
  { const Lock lock(mutex_); }
  changed_.notify_one();
}

void PendingLookups::look_again() {
  ++routes_;
  wake(written_);
}

std::uint64_t PendingLookups::version() const {
  return forest_.structure_version() + routes_.load();
}

void PendingLookups::run() {
  All all;
  bool listens = false;
  Lock lock(mutex_);
  while (!stopping_) {
    // Before the check, so that events meanwhile are not missed.
    urgent_.store(false);
    const bool written = written_.exchange(false);
    std::move(added_.begin(), added_.end(), std::back_inserter(all));
    added_.clear();
    lock.unlock();
    if (listens != !all.empty()) {
      listens = !all.empty();
      forest_.on_commit(listens ? [this] { wake(written_); } : std::function<void()>(), this);
    }
    const auto begin = Clock::now();
    const auto next = attend(all, written);
    const auto end = Clock::now();
    const auto rested = end + std::clamp<std::chrono::nanoseconds>(kRest * (end - begin),
                                                                   kShortestRest, kLongestRest);
    lock.lock();
    const auto must = [this]() TFDUDE_REQUIRES(mutex_) { return stopping_ || urgent_.load(); };
    changed_.wait_until(lock, std::min(next, rested), must);
    changed_.wait_until(lock, next,
                        [&]() TFDUDE_REQUIRES(mutex_) { return must() || written_.load(); });
  }
  std::move(all.begin(), all.end(), std::back_inserter(added_));
  lock.unlock();
  forest_.on_commit(nullptr, this);
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
  if (const auto look = callbacks_.look_after(Clock::now())) next = std::min(next, *look);
  return next;
}

/// Each of the following returns true if the lookup is finished.
bool PendingLookups::attend(Lookup& lookup, bool written) {
  if (lookup.callback != nullptr && !lookup.callback->waits()) return true;
  if (lookup.asking) return go_on_asking(lookup);
  if (written && lookup.far) hurry(lookup);
  const auto now = Clock::now();
  const bool may_be_here = lookup.version != version() || (written && !lookup.far);
  if (now < lookup.next && !may_be_here && !lookup.deadline.over(now)) return false;
  return attempt(lookup);
}

bool PendingLookups::attempt(Lookup& lookup) {
  lookup.version = version();
  const WantedLookup& wanted = lookup.wanted;
  auto here = forest_.lookup(wanted.a, wanted.b, wanted.query);
  const bool all_held =
      here || here.error().code == Errc::kNotYet || here.error().code == Errc::kTooOld;
  if (all_held) return judge(lookup, std::move(here), false);
  auto plan = links_.plan(wanted);
  if (!plan) return judge(lookup, tl::unexpected(std::move(plan.error())), links_.plan_asks);
  if (lookup.deadline.over()) return judge(lookup, tl::unexpected(lookup.last), true);
  lookup.plan.emplace(*std::move(plan));
  lookup.until = lookup.deadline.within(links_.timeout);
  return ask(lookup);
}

bool PendingLookups::ask(Lookup& lookup) {
  lookup.asking.emplace(replies_, lookup.plan->parts(), *lookup.until,
                        static_cast<ReplyListener*>(this));
  if (const Error* lacking = lookup.asking->answer(link_)) {
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
    lookup.next = std::min(lookup.asking->send_due(now, link_), lookup.until->at());
  }
  if (!lookup.asking->complete()) {
    if (!lookup.until->over(now)) return false;
    lookup.asking->give_up();
    // Their last answer is more informative than the fact that they had no time to repeat it.
    if (lookup.deadline.over(now) && lookup.last.code != Errc::kTimeout) {
      lookup.asking.reset();
      return judge(lookup, tl::unexpected(lookup.last), true);
    }
  }
  auto found = lookup.plan->take(lookup.asking->take_replies(), hints_, now);
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
  // If the job is dropped instead, objects held by its function are destroyed, too.
  const std::shared_ptr<OneCall<Found>> call(lookup.callback.get(),
                                             [owner = lookup.callback](auto*) { owner->cancel(); });
  callbacks_.post([call, found = std::move(found)]() mutable { call->run(std::move(found)); });
}

}  // namespace tfdude
