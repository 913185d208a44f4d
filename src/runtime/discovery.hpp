#pragma once

#include <atomic>
#include <chrono>
#include <string>

#include "tfdude/base/result.hpp"

#include "runtime/deadline.hpp"
#include "runtime/structure.hpp"
#include "transport/port.hpp"

namespace tfdude {

/// Whether a new participant has discovered all reachable ones, so that frames it does not know do
/// not exist; and waiting for that.
/// @par Thread safety  All functions are thread-safe, for callers that do not hold the structure's
///   lock.
class Discovery {
 public:
  using Clock = Deadline::Clock;

  /// @param search_time  how long to search while nobody is discovered
  /// @param timeout  of calls; participants that were discovered, but are slow to announce their
  ///   frames, are waited for three times as long
  Discovery(Structure& structure, const Transport& transport, Milliseconds search_time,
            Milliseconds timeout);

  /// Whether everything that existed at the start, and all changes that owners have announced
  /// since, are known; or the client ends, so that no more is learned.
  [[nodiscard]] bool complete();

  /// Whether it ends before everything is known, so that unknown frames may exist.
  [[nodiscard]] bool ended_unaware() const {
    return ended_ && !complete_.load(std::memory_order_relaxed);
  }

  /// A change that an owner announced did not come in time: until it has, unknown frames may exist.
  /// For callers that hold the structure's lock.
  void fell_behind() { complete_.store(false, std::memory_order_relaxed); }

  /// The end of the search while nobody is discovered.
  [[nodiscard]] Clock::time_point met_by() const { return met_by_; }

  /// The deadline of a call that starts now: after the timeout, plus the remaining search time
  /// while others may still be discovered.
  [[nodiscard]] Deadline call_deadline() const;

  /// Waits until complete(). @return kTimeout, naming what was missing; kNotPermitted if keys
  /// exclude all partitions that were discovered.
  [[nodiscard]] Result<void> await(const Deadline& deadline);

  /// As await(), but takes what is known if all that is missing are frames that a partition has
  /// announced, and none has come for kSilentFor, or by the deadline. Then
  /// PartitionInfo::complete is false.
  [[nodiscard]] Result<void> await_known(const Deadline& deadline);
  static constexpr Milliseconds kSilentFor{500};

  /// Waits until a partition of this name is known and reachable, or the client ends.
  void wait_for_partition(const std::string& name, const Deadline& deadline);
  /// The client ends: nobody waits here any more, or will; what is not known is kTransport. Takes
  /// effect within 50 ms.
  void end_waits() { ended_ = true; }

  /// The final error of an operation that failed and is not repeated.
  [[nodiscard]] Error last_word(Error error, const TimeLimit& limit);

  /// Why a result was not certain when the deadline was over: kTimeout.
  [[nodiscard]] Error undecided(const Error& error, const TimeLimit& limit);

  /// Explains an error about something missing, if others know more.
  [[nodiscard]] Error explained(Error error);

  /// Waits until something has changed, or for a short time.
  void wait_for_change(const Deadline& deadline = Deadline(Milliseconds::max()));

 private:
  [[nodiscard]] Result<void> nobody_but_excluded() const;
  [[nodiscard]] Error ended_error(const Error& error) const;
  [[nodiscard]] bool lacks_frames_only(Clock::time_point now, bool over);

  Structure& structure_;
  const Transport& transport_;
  const Milliseconds timeout_;
  const Clock::time_point met_by_;
  // Participants that have not announced their frames by then are not waited for.
  const Clock::time_point told_by_;
  std::atomic<bool> complete_{false};
  std::atomic<bool> ended_{false};
  // Of Directory::progress(); both under the structure's lock.
  std::uint64_t progress_ = 0;
  Clock::time_point progress_at_{};
};

}  // namespace tfdude
