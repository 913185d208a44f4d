#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude {

/// Requests that wait for their replies. A call asks several partitions at once and waits for all.
/// @par Thread safety  All functions are thread-safe; a Call belongs to the thread that waits for
///   it.
class Calls {
 public:
  using Clock = std::chrono::steady_clock;

  struct Entry {
    std::string partition;
    std::uint32_t sequence = 0;
    std::optional<Reply> reply;
  };

  /// Registered with Calls from its construction until its destruction.
  class Call {
   public:
    /// @param arrived  called once all replies have come, by the thread that brought the last one,
    ///   without a lock; possibly also after the destruction of this
    Call(Calls& calls, const std::vector<std::string>& partitions,
         std::function<void()> arrived = {});
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    [[nodiscard]] const std::vector<Entry>& entries() const { return entries_; }

    /// The lowest number for which anybody here awaited a reply when this call started.
    [[nodiscard]] std::uint64_t awaits_from() const { return awaits_from_; }

    /// Waits until all replies have come; false at the deadline.
    [[nodiscard]] bool wait_until(Clock::time_point deadline);

    /// Whether this entry still lacks its reply.
    [[nodiscard]] bool waits(std::size_t entry) const;

    /// Ends the wait for one entry without a reply.
    void give_up(std::size_t entry, Error error);

   private:
    friend class Calls;
    [[nodiscard]] bool complete() const;

    Calls& calls_;
    std::vector<Entry> entries_;
    std::uint64_t awaits_from_ = 0;
    Condition* arrived_;
    const std::function<void()> tell_;
  };

  /// A reply has come. Dropped if it is unknown, repeated, or of another partition than was asked.
  void on_reply(const std::string& from, const Reply& reply);

  /// A partition is lost: calls that wait for it fail now.
  void on_lost(const std::string& partition);

 private:
  struct Waiting {
    Call* call;
    std::size_t entry;
  };
  using Signal = Condition;

  mutable Mutex mutex_;
  // Extended beyond the overflow of the number in messages, so that the lowest is the oldest.
  using Number = std::uint64_t;
  [[nodiscard]] Number number_of(std::uint32_t sequence) const TFDUDE_REQUIRES(mutex_) {
    return last_ - (static_cast<std::uint32_t>(last_) - sequence);
  }

  Number last_ TFDUDE_GUARDED_BY(mutex_) = 0;
  std::map<Number, Waiting> waiting_ TFDUDE_GUARDED_BY(mutex_);
  // Signals outlive their calls, so that they can be notified without the mutex. Otherwise the
  // woken thread finds it locked and sleeps again, 2 us on one processor. A call may get another
  // call's signal: it checks again.
  std::vector<std::unique_ptr<Signal>> signals_ TFDUDE_GUARDED_BY(mutex_);
  std::vector<Signal*> idle_signals_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude
