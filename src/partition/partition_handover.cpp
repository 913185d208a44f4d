#include <algorithm>

#include "partition/partition.hpp"

// Frames go to another owner, with all that is known of them. FrameClaims says how all participants
// find out which owner has a frame: it is a matter of claims, whatever the requests say.
namespace tfdude {

bool Partition::settle_handovers() {
  if (handovers_.empty() && !directory_.contested()) return false;
  bool changed = settle_offered();
  changed = settle_adopted() || changed;
  changed = settle_passed() || changed;
  if (changed) pages_.close_epoch();
  return changed;
}

// A new owner may have adopted what was kept, without that being known here: its claim would be the
// older one.
std::uint64_t Partition::time_of_move(const std::string& id, Time now) {
  constexpr std::uint64_t kAWhile = 60'000'000'000;  // [ns]
  const std::uint64_t next = directory_.next_lamport_time(now);
  const auto there = forest_.info(id);
  if (!there) return next;
  const std::uint64_t own = there->lamport_time;
  const bool just_kept = is_offer(own + kKept) && next - own < kAWhile;
  return just_kept || directory_.handovers().is_just_handed(id) ? own : next;
}

// A yield waits until it is known who has the frame. What is offered is not yielded: its owner
// keeps it, or lets go. What was adopted is not yielded to the one that offers it: that one will
// change its claim in any case.
bool Partition::must_wait(const PendingYield& pending) const {
  const auto there = forest_.info(pending.frame);
  if (!there) return false;
  if (pending.kind != PendingYield::Kind::kRelease) {
    if (handovers_.all.empty() && handovers_.adopted.empty()) return false;
    const auto below = forest_.subtree(pending.frame);
    return std::any_of(below.begin(), below.end(),
                       [&](const FrameInfo& frame) { return forest_.is_frozen(frame.id); });
  }
  const auto theirs = directory_.handovers().claim_of(pending.frame, pending.rival);
  return is_offer(there->lamport_time) ||
         (theirs && is_adopted(theirs->lamport_time, there->lamport_time));
}

std::set<PendingYield> Partition::pending_yields() const {
  std::set<PendingYield> all = directory_.pending_yields();
  for (auto one = all.begin(); one != all.end();) {
    one = must_wait(*one) ? all.erase(one) : std::next(one);
  }
  return all;
}

bool Partition::on_time(Handovers::Steady now) {
  bool changed = false;
  for (auto one = handovers_.all.begin(); one != handovers_.all.end();) {
    Handovers::Handover& handover = one->second;
    const bool idle = Handovers::is_over(handover.until, now, Handovers::kLease);
    const bool late = Handovers::is_over(handover.end, now, Handovers::kLongest);
    const bool over = (idle || late) && !handover.decided;
    if (over) keep(handover);
    changed = changed || over;
    one = over ? handovers_.all.erase(one) : std::next(one);
  }
  for (auto one = handovers_.passed.begin(); one != handovers_.passed.end();) {
    const bool over = Handovers::is_over(one->second.until, now, Handovers::kStay);
    if (over) pages_.erase(one->first);
    changed = changed || over;
    one = over ? handovers_.passed.erase(one) : std::next(one);
  }
  if (changed) pages_.close_epoch();
  return changed;
}

}  // namespace tfdude
