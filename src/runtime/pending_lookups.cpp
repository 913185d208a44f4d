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

}  // namespace

PendingLookups::PendingLookups(Forest& forest, ReplyTable& replies, RequestLink& link,
                               SharedHints& hints, LookupHost& host, Milliseconds timeout)
    : shared_{forest, replies, link, hints, host, static_cast<ReplyListener*>(this), timeout} {}

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
    lookup.promise.set_value(fail(
        Errc::kTimeout,
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
  return shared_.forest.structure_version() + routes_.load();
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
      shared_.forest.on_commit(listens ? [this] { wake(written_); } : std::function<void()>(),
                               this);
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
  shared_.forest.on_commit(nullptr, this);
}

/// @return when there is more to do
PendingLookups::Clock::time_point PendingLookups::attend(All& all, bool written) {
  auto next = Clock::time_point::max();
  const std::size_t waiting = all.size();
  const auto over = [&](const std::unique_ptr<Lookup>& lookup) {
    if (lookup->callback != nullptr && !lookup->callback->waits()) return true;
    const WaitingLookup::News news{version(), written, waiting};
    if (auto found = lookup->waiting.attend(shared_, news, Clock::now())) {
      finish(*lookup, *std::move(found));
      return true;
    }
    next = std::min(next, lookup->waiting.next());
    return false;
  };
  all.erase(std::remove_if(all.begin(), all.end(), over), all.end());
  if (const auto look = callbacks_.look_after(Clock::now())) next = std::min(next, *look);
  return next;
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
