#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <unordered_map>

#include "base/mutex.hpp"

namespace tfdude::fastdds {

/// Keeps one sender from delaying the messages of all others. Fast DDS handles what arrives at a
/// socket one after the other, on one thread, so a sender that floods it fills the socket's queue.
/// When that thread has not been idle for a while, datagrams of senders that took more than their
/// share of its time are dropped before Fast DDS sees them, which takes a fraction of the time.
/// What was to arrive reliably is repeated, when its sender is within its share again.
///
/// A sender owes the time that it took, and pays it back at its share, also while it pauses: who
/// pauses is no new sender. What was taken while nobody else sent, or without making others wait,
/// is owed only up to kMemory. Time comes from outside.
/// @par Thread safety  begin(), end() and admits() are for the thread that handles a datagram; all
///   other functions are thread-safe.
class FairShare {
 public:
  using Clock = std::chrono::steady_clock;
  /// The address from which a datagram came. What it says of its sender may be forged.
  using Sender = std::uint64_t;

  /// A thread that continues within this time, or has not waited, had messages waiting.
  static constexpr std::chrono::microseconds kGap{15};
  /// Overloaded is who has had messages waiting for this long.
  static constexpr std::chrono::microseconds kOverloadedAfter{500};
  /// A sender may owe its share of this time, and no more while messages wait.
  static constexpr std::chrono::milliseconds kMemory{50};
  /// If none wait: who has requests of such a size has seldom.
  static constexpr std::chrono::milliseconds kGrace{250};
  /// What is owed at most.
  static constexpr std::chrono::milliseconds kMostOwed{500};
  /// Of a sender of messages that take less than kCheap, one is handled after such a time in any
  /// case: whoever repeats a request is answered, however many send.
  static constexpr std::chrono::milliseconds kDeafFor{100};
  static constexpr std::chrono::milliseconds kCheap{5};
  /// The share of all heavy senders together. The rest of the time is for the others, and for
  /// dropping.
  static constexpr double kShare = 0.5;
  /// A sender is active for this time after a datagram. A lone sender has no limit.
  static constexpr std::chrono::seconds kActive{2};
  /// But in each kListenEvery of a thread that always has messages waiting, it is dropped for
  /// kListenFor. So the queue is emptied, and others who send are noticed: while it is full, what
  /// they send is lost.
  static constexpr std::chrono::milliseconds kListenEvery{200};
  static constexpr std::chrono::milliseconds kListenFor{5};
  /// Of so many senders the time is known; the one that was silent for longest is dropped.
  static constexpr std::size_t kMost = 256;
  /// The allowance of a sender for datagrams without a message, and its growth in a second [s].
  static constexpr double kAllowance = 1;
  static constexpr double kAllowanceGrowth = 0.1;

  /// The calling thread begins or has ended handling a datagram.
  /// @param waits  how often it has waited until now; a thread whose processor was taken away in
  ///   between has not
  static void begin(Clock::time_point now, long waits);
  static void end(Clock::time_point now, long waits);
  /// The datagram at hand has a request or a streamed value. Other datagrams are what participants
  /// send by themselves, for example the structure to one that comes late: they count only beyond
  /// an allowance.
  static void has_message();

  /// Whether to handle a datagram of this sender; counts it otherwise.
  [[nodiscard]] bool admits(Sender sender, Clock::time_point now);

  /// Handling a datagram of this sender took so long.
  void spent(Sender sender, Clock::duration time, Clock::time_point now);

  [[nodiscard]] std::uint64_t dropped() const;

  /// What is dropped is logged so seldom.
  static constexpr std::chrono::seconds kLogEvery{60};

 private:
  struct Account {
    double seconds = 0;
    Clock::time_point at;
    Clock::duration last{};  // what its last message took
    double allowance = kAllowance;
    Clock::time_point active{};  // when something was charged last
  };

  struct Charged {
    Sender sender = 0;
    Clock::time_point at{};
  };

  /// Whether one is to be handled in any case (kDeafFor).
  [[nodiscard]] static bool is_due(const Account& account, Clock::time_point now);
  /// What it owes now [s].
  [[nodiscard]] double owed(const Account& account, Clock::time_point now) const
      TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool admits_idle(Sender sender, Clock::time_point now);
  /// Whether another sender is active. Counts this one.
  [[nodiscard]] bool is_contended(Sender sender, Clock::time_point now) TFDUDE_REQUIRES(mutex_);

  enum class Reason : std::uint8_t {
    kPaysBack,   ///< it has had costly messages; nobody attacks
    kListening,  ///< it is alone, and the thread listens for others: not worth a line
    kShare,      ///< others wait, and it has had its share
    kCount
  };
  struct Dropped {
    std::atomic<std::uint64_t> count{0};
    std::atomic<std::uint64_t> told{0};  // the count when it was logged
    std::atomic<Clock::rep> logged{0};   // 0: never
  };
  /// Counts it, without the lock. @return false
  bool drop(Reason reason, Sender sender, Clock::time_point now);
  void count(Clock::time_point now) TFDUDE_REQUIRES(mutex_);

  Mutex mutex_;
  std::unordered_map<Sender, Account> accounts_ TFDUDE_GUARDED_BY(mutex_);
  // As of counted_: a datagram that is dropped must not take longer the more senders there are.
  Clock::time_point counted_ TFDUDE_GUARDED_BY(mutex_);
  int heavy_ TFDUDE_GUARDED_BY(mutex_) = 0;
  int active_ TFDUDE_GUARDED_BY(mutex_) = 0;
  Charged last_ TFDUDE_GUARDED_BY(mutex_);        // who was charged last
  Charged last_other_ TFDUDE_GUARDED_BY(mutex_);  // and who before, if it was another one
  std::atomic<Clock::rep> grace_used_until_{0};   // nobody owes more than kGrace after that
  std::array<Dropped, static_cast<std::size_t>(Reason::kCount)> dropped_;
};

}  // namespace tfdude::fastdds
