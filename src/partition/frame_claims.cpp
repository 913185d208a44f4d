#include "partition/frame_claims.hpp"

#include <algorithm>
#include <optional>
#include <tuple>
#include <utility>

namespace tfdude {

namespace {

std::vector<const FrameClaim*> all_of(const std::vector<FrameClaim>& claims) {
  std::vector<const FrameClaim*> all;
  all.reserve(claims.size() + 1);
  for (const FrameClaim& claim : claims) all.push_back(&claim);
  return all;
}

std::vector<const FrameClaim*> all_of(const std::vector<FrameClaim>& claims,
                                      const FrameClaim& one) {
  auto all = all_of(claims);
  all.push_back(&one);
  return all;
}

}  // namespace

bool FrameClaims::yields_to(const FrameInfo& a, const FrameInfo& b) const {
  const bool a_gone = succession_.standing(a.owner) == Succession::Standing::kGone;
  const bool b_gone = succession_.standing(b.owner) == Succession::Standing::kGone;
  return std::tie(a_gone, a.lamport_time, a.id) > std::tie(b_gone, b.lamport_time, b.id);
}

std::uint32_t FrameClaims::page_of(std::string_view id) const {
  const auto frame = forest_.find(id);
  return frame && frame->slot < page_of_slot_.size() ? page_of_slot_[frame->slot] : 0;
}

FrameClaim FrameClaims::in_force(const FrameInfo& there) const {
  const auto cut = cut_.find(there.id);
  if (cut != cut_.end()) return cut->second;
  return {there.owner, there.parent, there.lamport_time, page_of(there.id)};
}

FrameClaim* FrameClaims::shadowed(const std::string& id, Owner owner) {
  const auto claims = shadowed_.find(id);
  if (claims == shadowed_.end()) return nullptr;
  const auto mine = std::find_if(claims->second.begin(), claims->second.end(),
                                 [owner](const FrameClaim& claim) { return claim.owner == owner; });
  return mine != claims->second.end() ? &*mine : nullptr;
}

bool FrameClaims::claim(const std::string& id, FrameClaim claim, Counts counts) {
  const auto there = forest_.info(id);
  std::optional<FrameClaim> before;
  if (there && there->owner == claim.owner) before = in_force(*there);
  if (const FrameClaim* mine = shadowed(id, claim.owner)) before = *mine;
  // A late page: the frame has left it since.
  const bool late =
      before && before->page != claim.page && before->lamport_time > claim.lamport_time;
  if (late && counts == Counts::kTheYounger) return false;
  const bool contested =
      (there && there->owner != claim.owner) || shadowed_.find(id) != shadowed_.end();
  if (!contested) {
    put(id, claim);
    return !before;
  }
  if (there && there->owner != claim.owner && there->owner != kHeldHere) {
    shadow(id, in_force(*there));
  }
  shadow(id, std::move(claim));
  promote(id);
  return !before;
}

bool FrameClaims::unclaim(const std::string& id, Owner owner, std::uint32_t page) {
  if (FrameClaim* mine = shadowed(id, owner)) {
    if (mine->page != page) return false;
    auto& others = shadowed_[id];
    others.erase(others.begin() + (mine - others.data()));
    if (others.empty()) shadowed_.erase(id);
    return true;
  }
  const auto there = forest_.info(id);
  if (!there || there->owner != owner || page_of(id) != page) return false;
  const bool last = shadowed_.find(id) == shadowed_.end();
  if (last) {
    changes_.frame_removed(id, name(owner));
    forest_.drop_remote(id, owner);
  }
  cut_.erase(id);
  promote(id);
  return true;
}

void FrameClaims::released(const std::string& id) {
  promote(id);
  mend();
}

bool FrameClaims::may_take_from(Owner owner) const {
  return succession_.standing(owner) == Succession::Standing::kGone ||
         succession_.outlived(kHeldHere, owner);
}

Owner FrameClaims::holder(const std::string& id) const {
  const auto there = forest_.info(id);
  if (!there) return kHeldHere;
  if (!may_take_from(there->owner)) return there->owner;
  const auto claims = shadowed_.find(id);
  if (claims == shadowed_.end()) return kHeldHere;
  const auto other =
      std::find_if(claims->second.begin(), claims->second.end(),
                   [this](const FrameClaim& claim) { return !may_take_from(claim.owner); });
  return other != claims->second.end() ? other->owner : kHeldHere;
}

bool FrameClaims::take(const std::string& id) {
  const auto there = forest_.info(id);
  if (!there || there->owner == kHeldHere) return true;
  if (holder(id) != kHeldHere) return false;
  FrameClaim theirs = in_force(*there);
  forest_.drop_remote(id, theirs.owner);
  cut_.erase(id);
  shadow(id, std::move(theirs));
  return true;
}

// Puts the winning claim in force, unless this process holds the frame: then its owner must yield.
void FrameClaims::promote(const std::string& id) {
  const auto claims = shadowed_.find(id);
  if (claims == shadowed_.end() || forest_.holds(id)) return;
  const FrameClaim heir = succession_.heir(all_of(claims->second));
  auto& others = claims->second;
  others.erase(std::find_if(others.begin(), others.end(),
                            [&](const FrameClaim& claim) { return claim.owner == heir.owner; }));
  if (others.empty()) shadowed_.erase(claims);
  put(id, heir);
}

// Re-evaluates the claims: a partition's standing, or a precedence between partitions, has changed.
void FrameClaims::reconsider() {
  std::vector<std::string> contested;
  contested.reserve(shadowed_.size());
  for (const auto& [id, claims] : shadowed_) contested.push_back(id);
  std::sort(contested.begin(), contested.end());
  for (const std::string& id : contested) {
    const auto there = forest_.info(id);
    if (!there || there->owner == kHeldHere) continue;
    const FrameClaim now = in_force(*there);
    if (succession_.heir(all_of(shadowed_[id], now)).owner == now.owner) continue;
    shadow(id, now);
    cut_.erase(id);
    promote(id);
  }
  mend();
}

void FrameClaims::set_standing(Owner owner, Succession::Standing standing) {
  if (succession_.set_standing(owner, standing)) reconsider();
}

void FrameClaims::set_outlived(Owner owner, std::set<Owner> outlived) {
  if (succession_.set_outlived(owner, std::move(outlived))) reconsider();
}

bool FrameClaims::contests_held(Owner owner) const {
  return std::any_of(shadowed_.begin(), shadowed_.end(), [&](const auto& known) {
    const auto& [id, claims] = known;
    return forest_.holds(id) &&
           std::any_of(claims.begin(), claims.end(),
                       [owner](const FrameClaim& claim) { return claim.owner == owner; });
  });
}

std::set<PendingYield> FrameClaims::pending_yields() const {
  std::set<PendingYield> all;
  for (const auto& [id, claims] : shadowed_) {
    const auto there = forest_.info(id);
    if (!there || there->owner != kHeldHere) continue;
    const FrameClaim own = in_force(*there);
    const FrameClaim& heir = succession_.heir(all_of(claims, own));
    // Nothing is yielded to an unreachable partition, which may never return.
    if (heir.owner == kHeldHere || succession_.standing(heir.owner) != Succession::Standing::kThere)
      continue;
    all.insert({PendingYield::Kind::kRelease, id, heir.owner, there->lamport_time});
  }
  for (const auto& [id, claim] : cut_) {
    const Cycle cycle = cycle_of(id, claim);
    // What an unreachable partition claims may be outdated, so that there is no cycle.
    if (cycle.held && cycle.all_there && yields_to(*cycle.held, cycle.youngest)) {
      all.insert({PendingYield::Kind::kUnhang, cycle.held->id, cycle.youngest.owner,
                  cycle.held->lamport_time});
    }
  }
  return all;
}

void FrameClaims::shadow(const std::string& id, FrameClaim claim) {
  auto& claims = shadowed_[id];
  const auto mine = std::find_if(claims.begin(), claims.end(),
                                 [&](const FrameClaim& c) { return c.owner == claim.owner; });
  if (mine != claims.end()) {
    *mine = std::move(claim);
  } else {
    claims.push_back(std::move(claim));
  }
}

void FrameClaims::put(const std::string& id, const FrameClaim& claim) {
  std::optional<FrameInfo> before;
  if (changes_.watched()) before = forest_.info(id);
  const auto done = forest_.put_remote(id, claim.parent, claim.owner, claim.lamport_time);
  if (const auto frame = forest_.find(id)) {
    if (frame->slot >= page_of_slot_.size()) page_of_slot_.resize(frame->slot + 1);
    page_of_slot_[frame->slot] = claim.page;
  }
  if (!done && done.error().code == Errc::kCycle) {
    break_cycle(id, claim);
  } else {
    cut_.erase(id);
  }
  if (!changes_.watched()) return;
  const auto after = forest_.info(id);
  if (!after) return;
  if (!before) {
    changes_.frame_added(id, after->parent, name(claim.owner));
  } else if (before->owner != after->owner &&
             (succession_.standing(before->owner) != Succession::Standing::kThere ||
              succession_.outlived(after->owner, before->owner))) {
    // Others may have noticed it before.
    changes_.frame_taken_over(id, after->parent, name(claim.owner), name(before->owner));
  } else if (before->parent != after->parent || before->owner != after->owner) {
    changes_.frame_moved(id, after->parent, name(claim.owner));
  }
}

FrameClaims::Cycle FrameClaims::cycle_of(const std::string& id, const FrameClaim& claim) const {
  const auto there = [this](Owner owner) {
    return succession_.standing(owner) == Succession::Standing::kThere;
  };
  Cycle cycle{{id, claim.parent, claim.owner, false, claim.lamport_time}, {}, there(claim.owner)};
  for (auto edge = forest_.info(claim.parent); edge && edge->id != id;
       edge = forest_.info(edge->parent)) {
    if (edge->owner == kHeldHere) {
      if (!cycle.held || yields_to(*edge, *cycle.held)) cycle.held = edge;
      continue;
    }
    cycle.all_there = cycle.all_there && there(edge->owner);
    if (yields_to(*edge, cycle.youngest)) cycle.youngest = *edge;
  }
  return cycle;
}

void FrameClaims::cut(const FrameInfo& frame) {
  cut_[frame.id] = {frame.owner, frame.parent, frame.lamport_time, page_of(frame.id)};
  (void)forest_.put_remote(frame.id, {}, frame.owner, frame.lamport_time);
  changes_.frame_moved(frame.id, {}, name(frame.owner));
}

bool FrameClaims::make_way(const std::string& parent) {
  std::optional<FrameInfo> youngest;
  for (auto edge = forest_.info(parent); edge; edge = forest_.info(edge->parent)) {
    if (edge->owner == kHeldHere) continue;
    if (!youngest || yields_to(*edge, *youngest)) youngest = edge;
  }
  if (youngest) cut(*youngest);
  return youngest.has_value();
}

// The frame's claimed parent is below it, so the forest has made the frame a root. Cuts the edge of
// the cycle that yields to all other edges of other owners. If a held edge yields even to that one,
// its owner has to yield, which mends the cycle.
void FrameClaims::break_cycle(const std::string& id, const FrameClaim& claim) {
  const FrameInfo youngest = cycle_of(id, claim).youngest;
  if (youngest.id == id) {
    cut_[id] = claim;
    return;
  }
  cut(youngest);
  (void)forest_.put_remote(id, claim.parent, claim.owner, claim.lamport_time);
  cut_.erase(id);
}

void FrameClaims::mend() {
  for (const auto& [id, claim] : std::exchange(cut_, {})) put(id, claim);
}

}  // namespace tfdude
