#include "runtime/pending_lookups.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "base/mutex.hpp"

namespace tfdude {
namespace {

// If a thread writes continuously, waiting lookups are checked at most at this interval, and take
// at most a quarter of a processor: the writer wakes the thread, which costs the writer some
// microseconds.
constexpr int kRest = 3;
constexpr std::chrono::nanoseconds kShortestRest = std::chrono::microseconds(100);
constexpr std::chrono::nanoseconds kLongestRest = Milliseconds(10);

// Interval of requests for what has just come for others: it is there, but as many as wait must not
// be sent at once.
constexpr std::chrono::microseconds kAskForwardEvery{25};

}  // namespace

PendingLookups::PendingLookups(Forest& forest, ReplyTable& replies, RequestLink& link,
                               SharedHints& hints, LookupHost& host, Threads& threads,
                               Milliseconds timeout)
    : shared_{forest, replies, link, hints, host, static_cast<ReplyListener*>(this), timeout},
      callbacks_(threads.callbacks),
      attends_(threads.calls, [this] { return run(); }) {}

void PendingLookups::stop() {
  {
    const Lock lock(mutex_);
    stopping_ = true;
  }
  stopped_.notify_all();
  attends_.stop();
  shared_.forest.on_commit(nullptr, this);
  All left;
  {
    // Several threads may stop it.
    const Lock lock(mutex_);
    left = std::exchange(all_, {});
    std::move(added_.begin(), added_.end(), std::back_inserter(left));
    added_.clear();
  }
  // Here, since objects that callbacks own are destroyed with them.
  for (const auto& lookup : left) give_up(*lookup);
}

bool PendingLookups::pause(Clock::time_point until) {
  Lock lock(mutex_);
  return !stopped_.wait_until(lock, until, [this]() TFDUDE_REQUIRES(mutex_) { return stopping_; });
}

void PendingLookups::give_up(Lookup& lookup) {
  if (lookup.callback != nullptr) {
    lookup.callback->close();
  } else {
    lookup.promise.set_value(fail(
        Errc::kTransport,
        "the lookup was cancelled, as its client is closed: " + lookup.waiting.last().message));
  }
}

std::future<PendingLookups::Found> PendingLookups::add(WantedLookup wanted,
                                                       const Deadline& deadline, Error last) {
  auto lookup = std::make_unique<Lookup>(std::move(wanted), deadline, std::move(last));
  auto future = lookup->promise.get_future();
  add(std::move(lookup));
  return future;
}

std::shared_ptr<Callbacks::Line> PendingLookups::add(WantedLookup wanted, const Deadline& deadline,
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
  if (lookup != nullptr) {  // NOLINT(bugprone-use-after-move): null if it was moved
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
  return shared_.forest.structure_version() + routes_.load();
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
    shared_.forest.on_commit(listens_ ? [this] { wake(written_); } : std::function<void()>(), this);
  }
  next_ = attend(all_, written);
  const auto end = Clock::now();
  rests_until_ = end + std::clamp<std::chrono::nanoseconds>(kRest * (end - begin), kShortestRest,
                                                            kLongestRest);
  return next_;
}

/// @return when there is more to do
PendingLookups::Clock::time_point PendingLookups::attend(All& all, bool written) {
  auto next = Clock::time_point::max();
  const std::size_t waiting = all.size();
  Arrived arrived;
  const auto over = [&](const std::unique_ptr<Lookup>& lookup) {
    if (lookup->callback != nullptr && lookup->callback->closed()) return true;
    const WaitingLookup::News news{version(), written, waiting};
    if (auto found = lookup->waiting.attend(shared_, news, Clock::now())) {
      if (*found && waiting > 1) note(arrived, lookup->waiting.wanted(), (*found)->stamp);
      finish(*lookup, *std::move(found));
      return true;
    }
    next = std::min(next, lookup->waiting.next());
    return false;
  };
  all.erase(std::remove_if(all.begin(), all.end(), over), all.end());
  return std::min(next, put_forward(all, arrived));
}

void PendingLookups::note(Arrived& arrived, const WantedLookup& wanted, std::optional<Time> stamp) {
  const auto [at, is_new] = arrived.emplace(std::pair(wanted.a, wanted.b), stamp);
  if (!is_new && at->second) at->second = stamp ? std::max(*at->second, *stamp) : stamp;
}

PendingLookups::Clock::time_point PendingLookups::put_forward(const All& all,
                                                              const Arrived& arrived) {
  auto next = Clock::time_point::max();
  if (arrived.empty()) return next;
  auto when = Clock::now();
  for (const auto& lookup : all) {
    const WantedLookup& wanted = lookup->waiting.wanted();
    const auto came = arrived.find({wanted.a, wanted.b});
    if (came == arrived.end() || !lookup->waiting.put_forward(came->second, when)) continue;
    next = std::min(next, when);
    when += kAskForwardEvery;
  }
  return next;
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
