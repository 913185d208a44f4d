#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "calls/pending_requests.hpp"
#include "runtime/open_groups.hpp"
#include "runtime/watched.hpp"

namespace tfdude {

/// What rounds of watches need of their participant.
class WatchLink {
 public:
  virtual ~WatchLink() = default;

  /// Watched::plan(), with the structure.
  [[nodiscard]] virtual Result<void> plan(Watched& watched) = 0;
  /// From now on pushed values of the group come.
  [[nodiscard]] virtual Result<void> open(const std::string& partition, std::uint64_t group) = 0;
  virtual void close(std::uint64_t group) = 0;
};

/// What a participant watches. Rounds renew it at the owners periodically, so an owner that has
/// restarted learns of it, and lost values are sent again. Time comes from outside, and no function
/// waits: step() says for which replies to wait.
/// @par Thread safety  All functions are thread-safe, for callers that hold no lock; those of
///   rounds are for one thread.
class WatchRounds {
 public:
  using Clock = Watched::Clock;
  static constexpr Clock::time_point kNever = Clock::time_point::max();

  /// @param timeout  of the requests of a round
  WatchRounds(ReplyTable& replies, Milliseconds timeout) : replies_(replies), timeout_(timeout) {}

  /// Nobody waits for what is watched any more, or will be.
  void end_waits();
  /// What is watched reports that nothing new comes. Not while a round runs.
  void end();

  /// Watched while it has another holder. A round must follow.
  void add(std::shared_ptr<Watched> watched);

  /// Applies pushed values. @return when a round must follow at the latest
  [[nodiscard]] Clock::time_point on_pushed(const PushedValues& pushed, Clock::time_point now);

  /// Whether pushed values suffice for this lookup.
  [[nodiscard]] bool can_answer(const std::string& a, const std::string& b,
                                const Query& query) const;

  /// Lets all look at the memory that they are read from.
  Watched::Looked look(Clock::time_point now) const;
  /// The owners of that memory.
  [[nodiscard]] std::set<Owner> owners_in_memory() const;

  /// What a plan would find has changed. @return whether a round must follow
  [[nodiscard]] bool look_again();

  // --- a round

  void begin(Clock::time_point now);
  /// Attends to what needs it, up to the next requests, or goes on after these. @return requests,
  ///   of which all must be complete before the next step; null: the round is over
  [[nodiscard]] PendingRequests* step(Clock::time_point now, WatchLink& link);
  /// When the next round is due, once one is over.
  [[nodiscard]] Clock::time_point next() const { return next_; }

 private:
  struct Entry {
    explicit Entry(std::shared_ptr<Watched> one) : watched(std::move(one)) {}
    const std::shared_ptr<Watched> watched;
    std::atomic<bool> lacking{true};  // must be attended to soon
    // Is to be asked for, though its plan may be known. Of the rounds.
    bool due = false;
  };
  using Entries = std::vector<std::shared_ptr<Entry>>;

  [[nodiscard]] Entries entries() const;
  /// Forgets what nobody needs any more. @return the others
  [[nodiscard]] Entries drop_unused();
  [[nodiscard]] Watched& current() { return *turns_[turn_]->watched; }
  void attend(Clock::time_point now, WatchLink& link);
  /// Requests all values from the owners, or samples from an instant on.
  void ask(std::optional<Time> from, Clock::time_point now);
  void answered(Clock::time_point now);
  /// @param settled  it is up to date, or needs nothing until the next renewal; otherwise it must
  ///   be retried soon
  void finish_turn(bool settled);
  void close_unused(Clock::time_point now, WatchLink& link);

  ReplyTable& replies_;
  const Milliseconds timeout_;
  mutable Mutex mutex_{LockRank::kParts};
  Entries entries_ TFDUDE_GUARDED_BY(mutex_);
  bool waits_ended_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::atomic<bool> watches_{false};  // or has watched before
  std::atomic<bool> replan_{false};
  std::atomic<Clock::time_point> begun_{Clock::time_point::min()};  // the last round
  // The following belong to the rounds.
  OpenGroups open_;
  Clock::time_point renew_at_ = Clock::time_point::min();
  Clock::time_point next_ = kNever;
  std::uint64_t period_ = 0;
  Entries all_;
  Entries turns_;
  std::size_t turn_ = 0;              // the current one
  std::set<std::uint64_t> attended_;  // groups of the round
  // Of the current turn:
  std::vector<Watched::Group> groups_;
  std::vector<Part> parts_;
  std::optional<PendingRequests> asked_;
  std::optional<Time> from_;
  bool hears_all_ = true;
  bool asked_again_ = false;
};

}  // namespace tfdude
