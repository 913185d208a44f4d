#include "partition/claiming.hpp"

namespace tfdude {

Claiming::Step Claiming::next(Clock::time_point now, bool awaits_presence) {
  using Turn = NameClaim::Turn;
  if (phase_ == Phase::kMeeting) {
    if (now < until_ && !claim_.served()) return Step::kWait;
    enter(Phase::kHearing, until_ + patience_.presence);
  }
  if (phase_ == Phase::kHearing) {
    if (now < until_ && awaits_presence) return Step::kWait;
    enter(Phase::kPredecessor, now + patience_.predecessor);
  }
  if (phase_ == Phase::kPredecessor) {
    if (now < until_ && claim_.served()) return Step::kWait;
    if (claim_.to_take() != Turn::kMine) return Step::kLeave;
    enter(Phase::kDeciding, now + patience_.decision);
    return Step::kTake;
  }
  const Turn turn = claim_.to_serve();
  if (now < until_ && turn == Turn::kWait) return Step::kWait;
  return turn == Turn::kOthers ? Step::kLeave : Step::kServe;
}

}  // namespace tfdude
