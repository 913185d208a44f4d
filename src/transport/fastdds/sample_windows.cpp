#include "transport/fastdds/sample_windows.hpp"

#include <algorithm>

namespace tfdude::fastdds {

void SampleWindows::follow(const PeerId& peer, const Entity& writer) {
  const Lock lock(mutex_);
  complete_.try_emplace({peer, writer});
  any_ = true;
}

void SampleWindows::forget(const PeerId& peer, const Entity& writer) {
  const Lock lock(mutex_);
  complete_.erase({peer, writer});
  any_ = !complete_.empty();
}

class SampleWindows::Claims final : public NumberClaims {
 public:
  Claims(SampleWindows& windows, bool own) : windows_(windows), own_(own) {}

  [[nodiscard]] bool admit_participant(const NumberClaim::Prefix&) override { return true; }
  [[nodiscard]] bool admit(const NumberClaim& claim) override {
    // What others acknowledge is of writers of this participant.
    if (!own_ && claim.kind == NumberClaim::Kind::kAcknowledgement) return true;
    const Lock lock(windows_.mutex_);
    const auto known = windows_.complete_.find({claim.sender, claim.writer});
    if (known == windows_.complete_.end()) return true;
    std::optional<std::uint64_t>& complete = known->second;
    // The first that is missing, or may exist.
    const std::uint64_t before = std::max<std::uint64_t>(claim.first, 1) - 1;
    switch (claim.kind) {
      case NumberClaim::Kind::kAcknowledgement:
        complete = std::max(complete.value_or(0), before);
        return true;
      case NumberClaim::Kind::kHeartbeat:
        if (complete) complete = std::max(*complete, before);
        return true;
      default:
        if (complete && before <= *complete) complete = std::max(*complete, claim.last);
        return !complete || claim.kind == NumberClaim::Kind::kGap ||
               claim.last <= *complete + kAhead;
    }
  }

 private:
  SampleWindows& windows_;
  const bool own_;  // a datagram that this participant sends
};

bool SampleWindows::admits(const std::uint8_t* datagram, std::size_t size) {
  if (!any_.load(std::memory_order_relaxed)) return true;
  Claims claims(*this, false);
  return check_datagram(datagram, size, false, claims) != DatagramFlaw::kJump;
}

void SampleWindows::sent(const std::uint8_t* datagram, std::size_t size) {
  if (!any_.load(std::memory_order_relaxed)) return;
  Claims claims(*this, true);
  for_each_acknowledgement(datagram, size, claims);
}

}  // namespace tfdude::fastdds
