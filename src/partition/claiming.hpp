#pragma once

#include <chrono>

#include "partition/name_claim.hpp"

namespace tfdude {

/// When a process that wants a partition's name takes each of the steps of NameClaim. Not thread-safe.
class Claiming {
 public:
  using Clock = std::chrono::steady_clock;

  /// How long participants need to meet is the transport's to say.
  struct Patience {
    std::chrono::milliseconds meeting{0};
    /// How much longer somebody who was met may take to say which partition it serves.
    std::chrono::milliseconds presence{3000};
    /// How long the participant of a killed predecessor may still seem alive.
    std::chrono::milliseconds predecessor{1500};
    /// How long one who claimed the name earlier may take to decide.
    std::chrono::milliseconds decision{3000};
  };

  enum class Step {
    kWait,
    kTake,   ///< say that the name is taken; the next step is asked for after that
    kServe,  ///< the name is this process's
    kLeave,  ///< another one has it
  };

  /// @param claim  as which the own presence was announced just now
  Claiming(const NameClaim& claim, Patience patience, Clock::time_point now)
      : claim_(claim), patience_(patience), until_(now + patience.meeting) {}

  /// What to do now.
  /// @param awaits_presence  whether somebody was met who has not said what it serves
  [[nodiscard]] Step next(Clock::time_point now, bool awaits_presence);

 private:
  enum class Phase { kMeeting, kHearing, kPredecessor, kDeciding };

  void enter(Phase phase, Clock::time_point until) {
    phase_ = phase;
    until_ = until;
  }

  const NameClaim& claim_;
  const Patience patience_;
  Phase phase_ = Phase::kMeeting;
  Clock::time_point until_;  // the phase is over by then
};

}  // namespace tfdude
