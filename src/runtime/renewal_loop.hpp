#pragma once

#include <chrono>
#include <functional>
#include <thread>

#include "tfdude/base/time.hpp"

#include "base/mutex.hpp"

namespace tfdude {

/// The thread of those who watch: it attends to what is watched periodically, when asked, and soon
/// again while something is missing.
/// @par Thread safety  All functions are thread-safe, for callers that hold no lock.
class RenewalLoop {
 public:
  /// Attends to everything that is watched now. @param renew  whether the period has passed
  /// @return whether nothing is missing
  using Round = std::function<bool(bool renew)>;

  /// @param retry_after  interval of rounds while something is missing
  RenewalLoop(Milliseconds renew_every, Milliseconds retry_after, Round round);
  ~RenewalLoop() { stop(); }
  RenewalLoop(const RenewalLoop&) = delete;
  RenewalLoop& operator=(const RenewalLoop&) = delete;

  /// Another round, now.
  void ask();
  /// Something is missing.
  void lack();
  /// After it has returned there is no round.
  void stop();

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  void wait(Lock& lock, Clock::time_point renew_at) TFDUDE_REQUIRES(mutex_);

  const Milliseconds renew_every_;
  const Milliseconds retry_after_;
  const Round round_;
  Mutex mutex_{LockRank::kParts};
  Condition changed_;
  bool asked_ TFDUDE_GUARDED_BY(mutex_) = false;
  bool lacking_ TFDUDE_GUARDED_BY(mutex_) = false;
  Clock::time_point last_round_ TFDUDE_GUARDED_BY(mutex_){};
  bool stopping_ TFDUDE_GUARDED_BY(mutex_) = false;
  std::thread thread_;  // last: it uses the other members
};

}  // namespace tfdude
