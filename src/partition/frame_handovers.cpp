#include <algorithm>

#include "partition/frame_claims.hpp"

// Claims to frames that one partition hands over to another.
namespace tfdude {
namespace {

constexpr std::uint64_t kNames = 65'536;

// The same in all builds (FNV-1a).
std::uint64_t number_of(const std::string& name) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const char one : name) hash = (hash ^ static_cast<unsigned char>(one)) * 1099511628211ULL;
  return (hash ^ (hash >> 32U)) % kNames;
}

}  // namespace

std::uint64_t time_of_offer(std::uint64_t earliest, const std::string& to) {
  const std::uint64_t step = earliest / kLamportGrid;
  const std::uint64_t more = (number_of(to) + kNames - step % kNames) % kNames;
  return (step + more) * kLamportGrid + kLamportGrid / 2;
}

bool is_offered_to(std::uint64_t offer, const std::string& partition) {
  return is_offer(offer) && offer / kLamportGrid % kNames == number_of(partition);
}

std::optional<FrameClaim> FrameClaims::claim_in_force(const std::string& id) const {
  const auto there = forest_.info(id);
  return there ? std::optional(in_force(*there)) : std::nullopt;
}

void FrameClaims::adopted(const std::vector<std::pair<std::string, FrameClaim>>& before) {
  for (const auto& [id, claim] : before) {
    cut_.erase(id);
    if (removals_.any(id)) doubted_.insert(id);
    shadow(id, claim);
  }
  mend();
}

bool FrameClaims::has_adopted(Owner owner, const std::string& id) const {
  const auto there = forest_.info(id);
  const FrameClaim* theirs = shadowed(id, owner);
  return there && there->owner == kHeldHere && theirs != nullptr &&
         is_adopted(there->lamport_time, theirs->lamport_time);
}

bool FrameClaims::is_contested(const std::string& id) const {
  const auto claims = shadowed_.find(id);
  return claims != shadowed_.end() &&
         std::any_of(claims->second.begin(), claims->second.end(), [this](const FrameClaim& one) {
           return !one.passed_on && !is_gone(one.owner);
         });
}

// A handover that an earlier process of this partition has begun, ended by keeping the frame, or
// taken part in as the new owner.
bool FrameClaims::goes_on(std::uint64_t own, Owner owner, std::uint64_t theirs) const {
  if (is_passed_on(own, theirs)) return true;
  const bool open = is_adopted(own, theirs) || is_kept(own, theirs) || is_adopted(theirs, own);
  return open && !succession_.reported_survivor(owner, kHeldHere);
}

// Participants that have heard of the new owner do not need the former one's claim, and must not
// fall back to it if the new owner removes the frame.
void FrameClaims::note_passed_on(const std::string& id, std::optional<std::uint64_t> held) {
  const auto known = shadowed_.find(id);
  if (known == shadowed_.end()) return;
  const auto there = forest_.info(id);
  if (there && there->owner == kHeldHere) held = there->lamport_time;
  for (FrameClaim& one : known->second) {
    const auto is_next = [&](std::uint64_t other) { return is_passed_on(other, one.lamport_time); };
    const bool by_held = held && is_next(*held);
    one.passed_on =
        one.passed_on || by_held ||
        std::any_of(known->second.begin(), known->second.end(),
                    [&](const FrameClaim& other) { return is_next(other.lamport_time); });
  }
}

bool FrameClaims::is_just_handed(const std::string& id) const {
  const auto there = forest_.info(id);
  const auto claims = shadowed_.find(id);
  if (!there || claims == shadowed_.end()) return false;
  const std::uint64_t own = there->lamport_time;
  return std::any_of(claims->second.begin(), claims->second.end(), [&](const FrameClaim& theirs) {
    // That one may have taken it for its own while it was away from this one.
    if (is_kept(own, theirs.lamport_time)) return true;
    return is_passed_on(own, theirs.lamport_time) && !is_gone(theirs.owner);
  });
}

void FrameClaims::pass_on(Owner owner, const std::vector<std::string>& ids) {
  std::vector<HandedFrame> frames;
  std::vector<FrameClaim> claims;
  for (const std::string& id : ids) {
    const FrameClaim theirs = *shadowed(id, owner);
    auto& others = shadowed_[id];
    others.erase(std::remove_if(others.begin(), others.end(),
                                [&](const FrameClaim& one) { return one.owner == owner; }),
                 others.end());
    if (others.empty()) shadowed_.erase(id);
    frames.push_back({id, theirs.parent, theirs.lamport_time});
    claims.push_back(theirs);
  }
  forest_.hand_to(owner, frames);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    put(ids[i], claims[i]);
    doubt(ids[i]);
    changes_.frame_moved(ids[i], claims[i].parent, name(owner));
  }
  mend();
}

std::optional<Owner> FrameClaims::offered_by(const std::string& id) const {
  const auto there = forest_.info(id);
  const auto claims = shadowed_.find(id);
  if (!there || claims == shadowed_.end()) return std::nullopt;
  for (const FrameClaim& theirs : claims->second) {
    const bool counts =
        !is_gone(theirs.owner) && !succession_.reported_survivor(kHeldHere, theirs.owner);
    if (counts && is_adopted(theirs.lamport_time, there->lamport_time)) return theirs.owner;
  }
  return std::nullopt;
}

bool FrameClaims::has_removed(Owner owner, const std::string& id, std::uint64_t since) const {
  const auto by_owner = [&](const FrameRemoval& one) { return one.owner == owner; };
  return removals_.find(id, kHeldHere, since, by_owner) != nullptr;
}

bool FrameClaims::is_claimed_since(const std::string& id, std::uint64_t since) const {
  const auto claims = shadowed_.find(id);
  return claims != shadowed_.end() &&
         std::any_of(claims->second.begin(), claims->second.end(), [&](const FrameClaim& one) {
           return one.lamport_time > since && !is_gone(one.owner);
         });
}

}  // namespace tfdude
