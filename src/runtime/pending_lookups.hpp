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
#include "runtime/asking.hpp"
#include "runtime/callbacks.hpp"
#include "runtime/deadline.hpp"
#include "runtime/gathering.hpp"
#include "runtime/one_call.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// Whether what a lookup lacks may come yet.
[[nodiscard]] bool is_worth_waiting(const Error& error, const Query& query);

/// The lookups of a participant that wait for their data. One thread attends to all of them: it sleeps until something is
/// written to the forest here, or the structure changes; who owns what is lacking is asked again, ever less often, and once
/// more as soon as it has pushed here what does. It
/// never waits for anybody else, and runs nothing of the user's.
/// @par Thread safety  All functions.
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

  /// What it needs of the participant. None of them may wait.
  struct Links {
    /// Whom to ask, with what is known of the structure now. @return as Client::lookup
    std::function<Result<Gathering>(const Wanted&)> plan;
    /// Sends a request once. @return kNotYet where its partition cannot be reached yet.
    Asking::Send send;
    std::function<Reply(const Request&)> answer_here;
    /// Whether what others have pushed here would do: then they have it, too.
    std::function<bool(const Wanted&)> was_pushed;
    /// What is to be said where the time is over: the error of the last attempt, or that it was too early to know.
    std::function<Error(Error last, const Deadline&)> last_word;
    /// Of the sources that stamp samples.
    std::function<Time()> clock;
    /// How long the owners are waited for at most, each time that they are asked.
    Milliseconds timeout;
  };

  PendingLookups(Forest& forest, Calls& calls, SharedHints& hints, Links links);
  ~PendingLookups() { stop(); }
  PendingLookups(const PendingLookups&) = delete;
  PendingLookups& operator=(const PendingLookups&) = delete;

  /// Those that wait are answered kTimeout; their callbacks are not called. Once this returns none runs, but for one that
  /// calls this.
  void stop();

  /// @param last  why there was no answer up to now
  [[nodiscard]] std::future<Found> add(Wanted wanted, const Deadline& deadline, Error last);
  [[nodiscard]] std::shared_ptr<OneCall<Found>> add(Wanted wanted, const Deadline& deadline,
                                                    Error last, OneCall<Found>::Function callback);

  /// Another partition came or went.
  void look_again();

  /// Others have pushed something. At once, where nobody waits.
  void pushed() { wake(written_); }

 private:
  struct Lookup {
    Lookup(Wanted what, const Deadline& by, Error why)
        : wanted(std::move(what)), deadline(by), last(std::move(why)) {}

    const Wanted wanted;
    const Deadline deadline;
    Error last;
    // Who is to be told: one of both.
    std::promise<Found> promise;
    std::shared_ptr<OneCall<Found>> callback;

    // The thread's.
    const Clock::time_point began = Clock::now();
    Clock::time_point next = Clock::time_point::min();  // attempt, or look at what is under way
    std::uint64_t version = 0;                          // of the structure at the last attempt
    bool far = false;                                   // others lacked something then
    bool hurried = false;                               // was asked anew for what they have pushed
    std::optional<Gathering> gathering;                 // under way,
    std::optional<Deadline> until;                      // as long as this
    std::optional<Asking> asking;
  };
  using All = std::vector<std::unique_ptr<Lookup>>;

  void add(std::unique_ptr<Lookup> lookup);
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
  Calls& calls_;
  SharedHints& hints_;
  const Links links_;
  Callbacks callbacks_;
  std::size_t count_ = 0;                 // that wait; the thread's
  std::atomic<std::uint64_t> others_{0};  // how often others came or went
  std::atomic<bool> written_{false};      // something may be here now,
  std::atomic<bool> urgent_{false};       // or is: a new lookup, a reply
  Mutex mutex_;                           // of the rest, and of the wait
  Condition changed_;
  All added_
      TFDUDE_GUARDED_BY(mutex_);  // not taken by the thread yet; once it has ended, what it had
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // from the first lookup on
};

}  // namespace tfdude
