#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude {

/// Told that all replies of a call have come, by the thread that brought the last one, which holds
/// no lock; must not block. Must outlive the calls and the threads that bring replies.
class ReplyListener {
 public:
  virtual ~ReplyListener() = default;
  virtual void all_replied() = 0;
};

/// Requests that wait for their replies. A call asks several partitions at once and waits for all.
/// @par Thread safety  All functions are thread-safe; a Call belongs to the thread that waits for
///   it.
class ReplyTable {
 public:
  using Clock = std::chrono::steady_clock;

  struct Entry {
    std::string partition;
    std::uint32_t sequence = 0;
    /// The lowest number for which anybody here awaited a reply of the partition when the call
    /// started.
    std::uint64_t awaits_from = 0;
    std::optional<Reply> reply;
  };

  /// Registered with the table until its replies have come, or its destruction.
  class Call {
   public:
    /// @param listener  null: the call is waited for. It may be told after the destruction of this.
    Call(ReplyTable& table, const std::vector<std::string>& partitions,
         ReplyListener* listener = nullptr);
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;

    [[nodiscard]] const std::vector<Entry>& entries() const { return entries_; }

    /// Waits until all replies have come; false at the deadline.
    [[nodiscard]] bool wait_until(Clock::time_point deadline);

    /// Whether this entry still lacks its reply.
    [[nodiscard]] bool waits(std::size_t entry) const;

    /// Ends the wait for one entry without a reply.
    void give_up(std::size_t entry, Error error);

   private:
    friend class ReplyTable;
    [[nodiscard]] bool complete() const;

    ReplyTable& table_;
    std::vector<Entry> entries_;
    Condition* arrived_;
    ReplyListener* const listener_;
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
  // Without a reply, by partition, whose name is the entry's, and number. So the first of a
  // partition is the one that it must still be able to answer, whatever others have to.
  std::map<std::pair<std::string_view, Number>, Waiting> waiting_ TFDUDE_GUARDED_BY(mutex_);
  // Signals outlive their calls, so that they can be notified without the mutex. Otherwise the
  // woken thread finds it locked and sleeps again, 2 us on one processor. A call may get another
  // call's signal: it checks again.
  std::vector<std::unique_ptr<Signal>> signals_ TFDUDE_GUARDED_BY(mutex_);
  std::vector<Signal*> idle_signals_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude
