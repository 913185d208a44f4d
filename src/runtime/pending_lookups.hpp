#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/types/query.hpp"

#include "base/mutex.hpp"
#include "runtime/asking.hpp"
#include "runtime/context.hpp"
#include "runtime/deadline.hpp"
#include "runtime/gathering.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Whether data that a lookup lacks may still come.
[[nodiscard]] bool is_worth_waiting(const Error& error, const Query& query);

/// The lookups of a participant that wait for their data. One job attends to all of them. It
/// sleeps until the local forest is written, or the structure changes. Owners of missing data are
/// polled at growing intervals, and asked again as soon as they have pushed sufficient data. The
/// job never waits for others, and runs no user code.
/// @par Thread safety  All functions are thread-safe.
class PendingLookups {
 public:
  using Clock = Deadline::Clock;
  using Found = Result<StampedTransform>;
  using Callback = std::function<void(Found)>;

  struct Wanted {
    std::string a;
    std::string b;
    Query query;
  };

  /// What it needs of the participant. None of these functions may wait, except as stated.
  struct Links {
    /// The owners to ask, according to the current structure. @return as Client::lookup()
    std::function<Result<Gathering>(const Wanted&)> plan;
    /// Sends a request once. @return kNotYet if its partition cannot be reached yet.
    Asking::Send send;
    std::function<Reply(const Request&)> answer_here;
    /// Whether the values pushed here would suffice: then their owners have them, too.
    std::function<bool(const Wanted&)> was_pushed;
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

  PendingLookups(Forest& forest, Calls& calls, SharedHints& hints, Threads& threads, Links links);
  ~PendingLookups() { stop(); }
  PendingLookups(const PendingLookups&) = delete;
  PendingLookups& operator=(const PendingLookups&) = delete;

  /// Waiting lookups get kTimeout; their callbacks are not called.
  void stop();

  /// @param last  why there was no answer so far
  [[nodiscard]] std::future<Found> add(Wanted wanted, const Deadline& deadline, Error last);
  /// @return what calls the callback; closing it cancels the lookup
  [[nodiscard]] std::shared_ptr<Callbacks::Line> add(Wanted wanted, const Deadline& deadline,
                                                     Error last, Callback callback);

  /// What plan() would find has changed.
  void look_again();

  /// Others have pushed values.
  void pushed() {
    if (waiting_.load()) wake(written_);
  }

 private:
  struct Lookup {
    Lookup(Wanted what, const Deadline& by, Error why)
        : wanted(std::move(what)), deadline(by), last(std::move(why)) {}

    const Wanted wanted;
    const Deadline deadline;
    Error last;
    // One of the two gets the answer.
    std::promise<Found> promise;
    std::shared_ptr<Callbacks::Line> callback;  // prepared to be called
    std::shared_ptr<Found> found;               // with this

    // The following belong to the job.
    const Clock::time_point began = Clock::now();
    Clock::time_point next = Clock::time_point::min();  // attempt, or check of requests in progress
    std::uint64_t version = 0;                          // of the structure at the last attempt
    bool far = false;                                   // others lacked data then
    bool hurried = false;                               // was asked again for pushed values
    std::optional<Gathering> gathering;                 // in progress,
    std::optional<Deadline> until;                      // until this deadline
    std::optional<Asking> asking;
  };
  using All = std::vector<std::unique_ptr<Lookup>>;

  void add(std::unique_ptr<Lookup> lookup);
  /// May be called with the forest's lock held.
  void wake(std::atomic<bool>& why) {
    if (!why.exchange(true)) attends_.ask();
  }
  [[nodiscard]] Clock::time_point run();
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
  Calls& calls_;
  SharedHints& hints_;
  const Links links_;
  Callbacks& callbacks_;
  std::atomic<std::uint64_t> routes_{0};  // how often what plan() would find has changed
  std::atomic<bool> written_{false};      // new data may have arrived
  std::atomic<bool> urgent_{false};       // a new lookup or a reply has arrived
  std::atomic<bool> waiting_{false};      // there are lookups
  Mutex mutex_;
  All added_ TFDUDE_GUARDED_BY(mutex_);  // not yet taken by the job
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  // The following belong to the job.
  All all_;
  std::size_t count_ = 0;
  bool listens_ = false;  // to commits
  Clock::time_point next_ = Clock::time_point::max();
  Clock::time_point rests_until_ = Clock::time_point::min();
  Loop::Job attends_;  // last: it uses the other members
};

}  // namespace tfdude
