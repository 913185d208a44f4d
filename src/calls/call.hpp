#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calls/pending_requests.hpp"
#include "calls/time_limit.hpp"
#include "partition/directory.hpp"
#include "partition/routing.hpp"

namespace tfdude {

/// Whether what is missing according to this error may still be discovered.
[[nodiscard]] bool may_appear(Errc code);

/// What a call asks owners for, and what it makes of their replies.
class Task {
 public:
  using Clock = TimeLimit::Clock;

  enum class Next {
    kDone,
    kAsk,   ///< send parts(), which have changed
    kPlan,  ///< plan again, after pause()
  };

  /// An answer of any age will do, or none.
  static constexpr Milliseconds kAnyAge = Milliseconds::max();
  static constexpr Milliseconds kFresh{0};

  virtual ~Task() = default;

  /// The frames that it concerns: a participant that does not keep all asks for them first.
  [[nodiscard]] virtual std::vector<std::string> frames() const { return {}; }
  /// The maximum age of what such a participant knows of them already.
  [[nodiscard]] virtual Milliseconds max_age() const { return kAnyAge; }

  /// Plans parts(), with the lock of the structure held.
  [[nodiscard]] virtual Result<void> plan(const Directory& directory, Clock::time_point now) = 0;

  /// The requests of the plan.
  [[nodiscard]] virtual std::vector<Part>& parts() = 0;

  /// Whether the replies acknowledge changes, which are to be known here afterwards.
  [[nodiscard]] virtual bool changes() const { return false; }

  /// Evaluates the replies to parts(). @return as the owners; kNotOwner if the plan is outdated
  [[nodiscard]] virtual Result<Next> take(std::vector<Reply> replies, Clock::time_point now) = 0;

  [[nodiscard]] virtual Milliseconds pause() const { return Milliseconds(0); }

  /// Whether another plan may follow an error; not if something may have been applied.
  [[nodiscard]] virtual bool may_plan_again() const { return true; }
};

/// One call of a participant, in steps: it is planned according to the known structure, sent until
/// it is answered, confirmed if it is a change, and planned again if the structure has changed
/// meanwhile. One time limit covers all of this. The caller does what state() says, on its thread;
/// no step waits.
class Call {
 public:
  using Clock = TimeLimit::Clock;

  /// How often to ask a partition that may no longer be the owner.
  static constexpr int kAttempts = 3;
  /// The same if the structure has changed meanwhile: a handover changes it three times, and after
  /// each change that partition is asked again.
  static constexpr int kAttemptsInChange = 6;
  /// How long a structure change may take to arrive if a reply says that the known structure is
  /// outdated.
  static constexpr Milliseconds kStructureDelay{100};
  /// Whether an owner denies what the plan has checked before: it has not yet heard of a change
  /// that is known here.
  [[nodiscard]] static bool denies_plan(Errc code);

  enum class State {
    kKnow,      ///< ask for the frames, then known()
    kPlan,      ///< plan()
    kDiscover,  ///< wait for news, a moment at most, then resume()
    kAsk,       ///< step requests() until they are complete, then replied()
    kConfirm,   ///< confirm(), with each change of the structure, until it returns true
    kStore,     ///< wait until the changes made here are stored, then stored()
    kPause,     ///< wait until(), or until awaits() is no longer the version, then resume()
    kOver,      ///< outcome()
  };

  /// @param asks_for_frames  the participant does not keep all frames
  Call(ReplyTable& table, Task& task, const TimeLimit& limit, bool asks_for_frames);

  [[nodiscard]] State state() const { return state_; }

  /// Ends it, in any state.
  void fail(Error error) { finish(tl::unexpected(std::move(error))); }

  // ---- kKnow
  [[nodiscard]] Milliseconds max_age() const { return max_age_; }
  /// @param fresh  whether all frames have just been asked for
  void known(Result<bool> fresh);

  // ---- kPlan
  /// With the lock of the structure held.
  /// @param version  of the structure
  /// @param certain  whether before this everything was known that existed
  void plan(const Directory& directory, std::uint64_t version, bool certain, Clock::time_point now);

  // ---- kAsk
  [[nodiscard]] PendingRequests& requests() { return *requests_; }
  void replied(Clock::time_point now);

  // ---- kConfirm
  /// Notes what others have acknowledged, with the lock of the structure held. @return whether it
  /// has come, or its time is over
  [[nodiscard]] bool confirm(Directory& directory, Clock::time_point now);
  /// The partitions whose acknowledged changes have not come in time.
  [[nodiscard]] const std::vector<std::string>& late() const { return late_; }
  /// Whether such a change outdates what was asked for.
  [[nodiscard]] bool outdates() const { return outdates_; }

  // ---- kStore
  void stored(Result<void> stored, Clock::time_point now);

  // ---- kPause
  [[nodiscard]] Clock::time_point until() const { return until_; }
  /// The version of the structure of which it waits for the next one; empty: it only waits.
  [[nodiscard]] std::optional<std::uint64_t> awaits() const { return awaits_; }
  /// Also of kDiscover.
  void resume() { state_ = asks_ && state_ == State::kPause ? State::kKnow : State::kPlan; }

  // ---- kOver
  [[nodiscard]] const Result<void>& outcome() const { return outcome_; }
  /// What an error about something missing is worth.
  enum class Certainty {
    kFinal,      ///< it is certain
    kKnown,      ///< as far as is known, which may have to be explained
    kUndecided,  ///< more may be discovered than was in time
  };
  [[nodiscard]] Certainty certainty() const { return certainty_; }

 private:
  /// Whether a partition tells just now what it has, and that is not awaited for too long.
  [[nodiscard]] bool awaits_arrival(const Directory& directory, Clock::time_point now);
  /// Which processes are asked for a change; another one cannot know what the former has applied.
  void note_processes(const Directory& directory);
  void find_restarted(const Directory& directory);

  struct Change {  // that an owner has acknowledged
    Owner owner;
    std::string partition;
    std::uint64_t epoch;
    std::uint64_t lamport_time;
  };

  void ask();
  void note_changes(const std::vector<Reply>& replies);
  void stored_or_none(Clock::time_point now);
  void judge(Clock::time_point now);
  void retry(Error error, Clock::time_point now);
  void pause(Clock::time_point until, std::optional<std::uint64_t> awaits);
  void finish(Result<void> outcome, Certainty certainty = Certainty::kFinal);

  ReplyTable& table_;
  Task& task_;
  const TimeLimit limit_;
  const bool keeps_all_;
  const bool asks_;  // for frames
  State state_;
  Milliseconds max_age_;
  bool fresh_ = false;         // what is known of the frames
  std::uint64_t version_ = 0;  // of the structure, when it was planned
  std::optional<PendingRequests> requests_;
  Result<Task::Next> taken_ = Task::Next::kDone;
  std::vector<Change> changes_;
  bool own_ = false;  // a change was made here that must be stored
  std::vector<std::string> late_;
  bool outdates_ = false;
  std::optional<Clock::time_point> arrives_by_;
  std::vector<std::pair<Owner, std::uint64_t>> asked_;  // for a change, at first: the processes
  std::string restarted_;  // one of them that has another process now; empty: none
  int attempts_ = 0;
  bool changed_ = false;  // the structure, since the first of them
  Milliseconds pause_;
  Clock::time_point until_{};
  std::optional<std::uint64_t> awaits_;
  Result<void> outcome_;
  Certainty certainty_ = Certainty::kFinal;
};

}  // namespace tfdude
