#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/types/query.hpp"

#include "base/mutex.hpp"
#include "calls/waiting_lookup.hpp"
#include "runtime/context.hpp"
#include "runtime/deadline.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// The lookups of a participant that wait for their data. One job attends to all of them. It
/// sleeps until the local forest is written, or the structure changes. Owners of missing data are
/// polled at growing intervals, and asked again as soon as they have pushed sufficient data. The
/// job never waits for others, and runs no user code.
/// @par Thread safety  All functions are thread-safe.
class PendingLookups final : private ReplyListener {
 public:
  using Clock = Deadline::Clock;
  using Found = Result<StampedTransform>;
  using Callback = std::function<void(Found)>;

  /// @param timeout  maximum wait for the owners, for each request
  PendingLookups(Forest& forest, ReplyTable& replies, RequestLink& link, SharedHints& hints,
                 LookupHost& host, Threads& threads, Milliseconds timeout);
  ~PendingLookups() override { stop(); }
  PendingLookups(const PendingLookups&) = delete;
  PendingLookups& operator=(const PendingLookups&) = delete;

  /// Waiting lookups get kTimeout; their callbacks are not called.
  void stop();

  /// For calls that look up in rounds: waits until this time. @return false, at once, after stop()
  [[nodiscard]] bool pause(Clock::time_point until);

  /// @param last  why there was no answer so far
  [[nodiscard]] std::future<Found> add(WantedLookup wanted, const Deadline& deadline, Error last);
  /// @return what calls the callback; closing it cancels the lookup
  [[nodiscard]] std::shared_ptr<Callbacks::Line> add(WantedLookup wanted, const Deadline& deadline,
                                                     Error last, Callback callback);

  /// What plan() would find has changed.
  void look_again();

  /// Others have pushed values.
  void pushed() {
    if (waiting_.load()) wake(written_);
  }

 private:
  struct Lookup {
    Lookup(WantedLookup wanted, const Deadline& by, Error why)
        : waiting(std::move(wanted), by, std::move(why), Clock::now()) {}

    WaitingLookup waiting;
    // One of the two gets the answer.
    std::promise<Found> promise;
    std::shared_ptr<Callbacks::Line> callback;  // prepared to be called
    std::shared_ptr<Found> found;               // with this
  };
  using All = std::vector<std::unique_ptr<Lookup>>;
  /// The frames of lookups that were answered, and the latest instant of an answer.
  using Arrived = std::map<std::pair<std::string, std::string>, std::optional<Time>>;

  void add(std::unique_ptr<Lookup> lookup);
  void all_replied() override { wake(urgent_); }
  /// May be called with the forest's lock held.
  void wake(std::atomic<bool>& why) {
    if (!why.exchange(true)) attends_.ask();
  }
  [[nodiscard]] Clock::time_point run();
  [[nodiscard]] Clock::time_point attend(All& all, bool written);
  static void note(Arrived& arrived, const WantedLookup& wanted, std::optional<Time> stamp);
  /// Asks again for those that wait for what has just come for others.
  /// @return when there is more to do
  [[nodiscard]] static Clock::time_point put_forward(const All& all, const Arrived& arrived);
  static void finish(Lookup& lookup, Found found);
  static void give_up(Lookup& lookup);
  [[nodiscard]] std::uint64_t version() const;

  const WaitingLookup::Shared shared_;
  Callbacks& callbacks_;
  std::atomic<std::uint64_t> routes_{0};  // how often what plan() would find has changed
  std::atomic<bool> written_{false};      // new data may have arrived
  std::atomic<bool> urgent_{false};       // a new lookup or a reply has arrived
  std::atomic<bool> waiting_{false};      // there are lookups
  Mutex mutex_;
  Condition stopped_;
  All added_ TFDUDE_GUARDED_BY(mutex_);  // not yet taken by the job
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  // The following belong to the job.
  All all_;
  bool listens_ = false;  // to commits
  Clock::time_point next_ = Clock::time_point::max();
  Clock::time_point rests_until_ = Clock::time_point::min();
  Loop::Job attends_;  // last: it uses the other members
};

}  // namespace tfdude
