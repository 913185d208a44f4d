#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/types/query.hpp"

#include "base/mutex.hpp"
#include "calls/lookup_in_progress.hpp"
#include "calls/pending_requests.hpp"
#include "runtime/callbacks.hpp"
#include "runtime/deadline.hpp"
#include "runtime/one_call.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Whether data that a lookup lacks may still come.
[[nodiscard]] bool is_worth_waiting(const Error& error, const Query& query);

/// The lookups of a participant that wait for their data. One thread attends to all of them. It
/// sleeps until the local forest is written, or the structure changes. Owners of missing data are
/// polled at growing intervals, and asked again as soon as they have pushed sufficient data. The
/// thread never waits for others, and runs no user code.
/// @par Thread safety  All functions are thread-safe.
class PendingLookups final : private ReplyListener {
 public:
  using Clock = Deadline::Clock;
  using Found = Result<StampedTransform>;
  using Callback = std::function<void(Found)>;

  /// What it needs of the participant. None of these functions may wait, except as stated.
  struct Links {
    /// The owners to ask, according to the current structure. @return as Client::lookup()
    std::function<Result<LookupInProgress>(const WantedLookup&)> plan;
    /// Whether the values pushed here would suffice: then their owners have them, too.
    std::function<bool(const WantedLookup&)> was_pushed;
    /// The error to return at the deadline: that of the last attempt, or that the result is not
    /// certain.
    std::function<Error(Error last, const Deadline&)> last_word;
    /// The clock of sources that stamp samples; nothing if its time is not known.
    std::function<std::optional<Time>()> clock;
    /// Maximum wait for the owners, for each request.
    Milliseconds timeout;
    /// Whether plan() asks others for frames, and may wait shortly: nothing here tells when missing
    /// ones appear.
    bool plan_asks = false;
  };

  PendingLookups(Forest& forest, ReplyTable& replies, RequestLink& link, SharedHints& hints,
                 Links links);
  ~PendingLookups() override { stop(); }
  PendingLookups(const PendingLookups&) = delete;
  PendingLookups& operator=(const PendingLookups&) = delete;

  /// Waiting lookups get kTimeout; their callbacks are not called. After it has returned no
  /// callback runs, except one that calls this.
  void stop();

  /// @param last  why there was no answer so far
  [[nodiscard]] std::future<Found> add(WantedLookup wanted, const Deadline& deadline, Error last);
  [[nodiscard]] std::shared_ptr<OneCall<Found>> add(WantedLookup wanted, const Deadline& deadline,
                                                    Error last, OneCall<Found>::Function callback);

  /// What plan() would find has changed.
  void look_again();

  /// Others have pushed values. Returns at once if no lookup waits.
  void pushed() { wake(written_); }

 private:
  struct Lookup {
    Lookup(WantedLookup what, const Deadline& by, Error why)
        : wanted(std::move(what)), deadline(by), last(std::move(why)) {}

    const WantedLookup wanted;
    const Deadline deadline;
    Error last;
    // One of the two gets the answer.
    std::promise<Found> promise;
    std::shared_ptr<OneCall<Found>> callback;

    // The following belong to the thread.
    const Clock::time_point began = Clock::now();
    Clock::time_point next = Clock::time_point::min();  // attempt, or check of requests in progress
    std::uint64_t version = 0;                          // of the structure at the last attempt
    bool far = false;                                   // others lacked data then
    bool hurried = false;                               // was asked again for pushed values
    std::optional<LookupInProgress> plan;               // in progress,
    std::optional<Deadline> until;                      // until this deadline
    std::optional<PendingRequests> asking;
  };
  using All = std::vector<std::unique_ptr<Lookup>>;

  void add(std::unique_ptr<Lookup> lookup);
  void all_replied() override { wake(urgent_); }
  void wake(std::atomic<bool>& why);
  void run();
  [[nodiscard]] Clock::time_point attend(All& all, bool written);
  [[nodiscard]] bool attend(Lookup& lookup, bool written);
  [[nodiscard]] bool attempt(Lookup& lookup);
  [[nodiscard]] bool ask(Lookup& lookup);
  [[nodiscard]] bool go_on_asking(Lookup& lookup);
  [[nodiscard]] bool judge(Lookup& lookup, Found found, bool far);
  void hurry(Lookup& lookup);
  [[nodiscard]] Clock::time_point next_attempt(const Lookup& lookup, bool far) const;
  void finish(Lookup& lookup, Found found);
  static void give_up(Lookup& lookup);
  [[nodiscard]] std::uint64_t version() const;

  Forest& forest_;
  ReplyTable& replies_;
  RequestLink& link_;
  SharedHints& hints_;
  const Links links_;
  Callbacks callbacks_;
  std::size_t count_ = 0;                 // number of waiting lookups; belongs to the thread
  std::atomic<std::uint64_t> routes_{0};  // how often what plan() would find has changed
  std::atomic<bool> written_{false};      // new data may have arrived
  std::atomic<bool> urgent_{false};       // a new lookup or a reply has arrived
  Mutex mutex_;                           // guards the following members, and the wait
  Condition changed_;
  All added_
      TFDUDE_GUARDED_BY(mutex_);  // not yet taken by the thread; after its end, the remaining ones
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // from the first lookup on
};

}  // namespace tfdude
