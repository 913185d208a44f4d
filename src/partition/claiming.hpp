#pragma once

#include <chrono>

#include "partition/name_claim.hpp"

namespace tfdude {

/// The timing of a process that claims a partition's name: when it takes each step of NameClaim.
/// Not thread-safe.
class Claiming {
 public:
  using Clock = std::chrono::steady_clock;

  /// Time limits; the transport knows how long discovery takes.
  struct Patience {
    std::chrono::milliseconds meeting{0};
    /// How much longer a participant that was discovered may take to announce its partition.
    std::chrono::milliseconds presence{3000};
    /// How long the participant of a killed predecessor may still seem alive.
    std::chrono::milliseconds predecessor{1500};
    /// How long an earlier claimant may take to decide.
    std::chrono::milliseconds decision{3000};
  };

  enum class Step {
    kWait,
    kTake,   ///< announce that the name is taken, then ask for the next step
    kServe,  ///< the name belongs to this process
    kLeave,  ///< another process has it
  };

  /// @param claim  the claim with which the own presence was just announced
  Claiming(const NameClaim& claim, Patience patience, Clock::time_point now)
      : claim_(claim), patience_(patience), until_(now + patience.meeting) {}

  /// The step to take now.
  /// @param awaits_presence  whether a participant was discovered that has not announced what it
  ///   serves
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
  Clock::time_point until_;  // end of the phase
};

}  // namespace tfdude
