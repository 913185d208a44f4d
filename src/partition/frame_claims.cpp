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

const FrameClaim* FrameClaims::shadowed(const std::string& id, Owner owner) const {
  const auto claims = shadowed_.find(id);
  if (claims == shadowed_.end()) return nullptr;
  const auto mine = std::find_if(claims->second.begin(), claims->second.end(),
                                 [owner](const FrameClaim& claim) { return claim.owner == owner; });
  return mine != claims->second.end() ? &*mine : nullptr;
}

std::optional<FrameClaim> FrameClaims::claim_of(const std::string& id, Owner owner) const {
  if (const FrameClaim* mine = shadowed(id, owner)) return *mine;
  const auto there = forest_.info(id);
  return there && there->owner == owner ? std::optional(in_force(*there)) : std::nullopt;
}

bool FrameClaims::is_ended(const std::string& id, const FrameClaim& claim) const {
  return removals_.find(id, claim.owner, claim.lamport_time, [&](const FrameRemoval& one) {
    const bool counts = one.by_request || succession_.is_gone(claim.owner);
    return counts && succession_.survived(one.owner, claim.owner);
  }) != nullptr;
}

const FrameClaim* FrameClaims::winning_claim(const std::string& id, Claims claims) const {
  claims.erase(std::remove_if(claims.begin(), claims.end(),
                              [&](const FrameClaim* claim) {
                                return claim->passed_on || is_ended(id, *claim);
                              }),
               claims.end());
  return claims.empty() ? nullptr : &succession_.winning_claim(claims);
}

bool FrameClaims::claim(const std::string& id, FrameClaim claim, Counts counts) {
  const auto there = forest_.info(id);
  const auto before = claim_of(id, claim.owner);
  const bool repeats = before && before->lamport_time == claim.lamport_time;
  claim.passed_on = repeats && before->passed_on;
  // A late page: the frame has left it since.
  const bool late =
      before && before->page != claim.page && before->lamport_time > claim.lamport_time;
  if (late && counts == Counts::kTheYounger) return false;
  const bool contested = (there && there->owner != claim.owner) ||
                         shadowed_.find(id) != shadowed_.end() || removals_.any(id);
  if (!contested) {
    put(id, claim);
    return !before;
  }
  if (there && there->owner != claim.owner && there->owner != kHeldHere) {
    shadow(id, in_force(*there));
  }
  shadow(id, std::move(claim));
  note_passed_on(id);
  promote(id);
  return !before;
}

bool FrameClaims::unclaim(const std::string& id, Owner owner, std::uint32_t page) {
  if (const FrameClaim* mine = shadowed(id, owner)) {
    if (mine->page != page) return false;
    auto& others = shadowed_[id];
    others.erase(others.begin() + (mine - others.data()));
    if (others.empty()) shadowed_.erase(id);
    return true;
  }
  const auto there = forest_.info(id);
  if (!there || there->owner != owner || page_of(id) != page) return false;
  cut_.erase(id);
  promote(id);
  return true;
}

void FrameClaims::removed(const std::string& id, const FrameRemoval& removal) {
  if (!removals_.put(id, removal)) return;
  reconsider(id);
  doubt(id);
}

void FrameClaims::forget_removal(const std::string& id, Owner owner, std::uint32_t page) {
  removals_.erase(id, owner, page);
  reconsider(id);
}

// A claim in force that a removal would end if its owner were gone is examined again later.
void FrameClaims::doubt(const std::string& id) {
  const auto there = forest_.info(id);
  const auto any = [](const FrameRemoval&) { return true; };
  if (there && removals_.find(id, there->owner, there->lamport_time, any) != nullptr)
    doubted_.insert(id);
}

void FrameClaims::released(const std::string& id) {
  if (!forest_.exists(id)) promote(id);
  mend();
}

bool FrameClaims::may_take_from(Owner owner) const {
  return succession_.standing(owner) == Succession::Standing::kGone ||
         succession_.reported_survivor(kHeldHere, owner);
}

Owner FrameClaims::holder(const std::string& id, std::optional<std::uint64_t> lamport_time) const {
  const auto there = forest_.info(id);
  if (!there) return kHeldHere;
  const auto stays = [&](Owner owner, std::uint64_t theirs) {
    return !may_take_from(owner) && !(lamport_time && goes_on(*lamport_time, owner, theirs));
  };
  if (stays(there->owner, in_force(*there).lamport_time)) return there->owner;
  const auto claims = shadowed_.find(id);
  if (claims == shadowed_.end()) return kHeldHere;
  const auto other =
      std::find_if(claims->second.begin(), claims->second.end(),
                   [&](const FrameClaim& claim) { return stays(claim.owner, claim.lamport_time); });
  return other != claims->second.end() ? other->owner : kHeldHere;
}

bool FrameClaims::take(const std::string& id, std::optional<std::uint64_t> lamport_time) {
  const auto there = forest_.info(id);
  if (removals_.any(id)) doubted_.insert(id);
  if (!there || there->owner == kHeldHere) return true;
  if (holder(id, lamport_time) != kHeldHere) return false;
  FrameClaim theirs = in_force(*there);
  forest_.drop_remote(id, theirs.owner);
  cut_.erase(id);
  shadow(id, std::move(theirs));
  note_passed_on(id, lamport_time);
  return true;
}

// Puts the winning claim in force, unless this process holds the frame: then its owner must yield.
// That in force before does not count any more, or is among the shadowed ones.
void FrameClaims::promote(const std::string& id) {
  if (forest_.holds(id)) return;
  const auto claims = shadowed_.find(id);
  const FrameClaim* next = nullptr;
  if (claims != shadowed_.end()) next = winning_claim(id, all_of(claims->second));
  if (next == nullptr) return drop(id);
  const FrameClaim now = *next;
  auto& others = claims->second;
  others.erase(others.begin() + (next - others.data()));
  if (others.empty()) shadowed_.erase(claims);
  put(id, now);
  doubt(id);
}

void FrameClaims::drop(const std::string& id) {
  cut_.erase(id);
  const auto there = forest_.info(id);
  if (!there) return;
  changes_.frame_removed(id, name(there->owner));
  forest_.drop_remote(id, there->owner);
}

// Re-evaluates the claims: a partition's standing, or a precedence between partitions, has changed.
void FrameClaims::reconsider() {
  std::set<std::string> contested = std::exchange(doubted_, {});
  for (const auto& [id, claims] : shadowed_) contested.insert(id);
  for (const std::string& id : contested) {
    reconsider(id);
    doubt(id);
  }
  mend();
}

void FrameClaims::reconsider(const std::string& id) {
  const auto there = forest_.info(id);
  if (!there) return promote(id);
  if (there->owner == kHeldHere) return;
  const FrameClaim now = in_force(*there);
  const auto others = shadowed_.find(id);
  const FrameClaim* next =
      winning_claim(id, others != shadowed_.end() ? all_of(others->second, now) : Claims{&now});
  if (next != nullptr && next->owner == now.owner) return;
  shadow(id, now);
  cut_.erase(id);
  promote(id);
}

void FrameClaims::set_standing(Owner owner, Succession::Standing standing) {
  if (succession_.set_standing(owner, standing)) reconsider();
}

void FrameClaims::set_survived(Owner owner, std::set<Owner> survived) {
  if (succession_.set_survived(owner, std::move(survived))) reconsider();
}

bool FrameClaims::contests_held(Owner owner) const {
  const auto here = [&](const FrameRemoval& one) {
    return one.owner == kHeldHere && one.by_request && succession_.survived(kHeldHere, owner);
  };
  return std::any_of(shadowed_.begin(), shadowed_.end(), [&](const auto& known) {
    const std::string& id = known.first;
    return std::any_of(known.second.begin(), known.second.end(), [&](const FrameClaim& claim) {
      return claim.owner == owner &&
             (forest_.holds(id) || removals_.find(id, owner, claim.lamport_time, here) != nullptr);
    });
  });
}

std::set<PendingYield> FrameClaims::pending_yields() const {
  std::set<PendingYield> all;
  for (const auto& [id, claims] : shadowed_) {
    const auto there = forest_.info(id);
    if (!there || there->owner != kHeldHere) continue;
    const FrameClaim own = in_force(*there);
    const FrameClaim* next = winning_claim(id, all_of(claims, own));
    // Nothing is yielded to an unreachable partition, which may never return.
    if (next == nullptr || next->owner == kHeldHere || !is_there(next->owner)) continue;
    all.insert({PendingYield::Kind::kRelease, id, next->owner, there->lamport_time});
  }
  for (const auto& [id, claim] : cut_) {
    const Cycle cycle = cycle_of(id, claim);
    // What an unreachable partition claims may be outdated, so that there is no cycle.
    if (cycle.held && cycle.all_there && yields_to(*cycle.held, cycle.youngest)) {
      all.insert({PendingYield::Kind::kUnhang, cycle.held->id, cycle.youngest.owner,
                  cycle.held->lamport_time});
    }
  }
  add_removed(all,
              [this](Owner by) { return is_there(by) && succession_.survived(by, kHeldHere); });
  add_orphans(all);
  add_conceded(all);
  return all;
}

std::set<PendingYield> FrameClaims::removed_before() const {
  std::set<PendingYield> all;
  add_removed(all, [this](Owner by) { return !may_take_from(by); });
  return all;
}

template <class Condition>
void FrameClaims::add_removed(std::set<PendingYield>& all, Condition condition) const {
  for (const std::string& id : doubted_) {
    const auto there = forest_.info(id);
    if (!there || there->owner != kHeldHere) continue;
    const FrameRemoval* removal = removals_.find(
        id, kHeldHere, there->lamport_time,
        [&](const FrameRemoval& one) { return one.by_request && condition(one.owner); });
    if (removal == nullptr) continue;
    all.insert({PendingYield::Kind::kRemove, id, removal->owner, there->lamport_time,
                removal->lamport_time});
  }
}

// Held frames that were below a frame whose last claim has ended.
void FrameClaims::add_orphans(std::set<PendingYield>& all) const {
  const auto by_request = [](const FrameRemoval& one) { return one.by_request; };
  for (const auto& [id, claims] : shadowed_) {
    if (!removals_.any(id) || forest_.exists(id)) continue;
    for (const FrameInfo& frame : forest_.waiting_for(id)) {
      if (frame.owner != kHeldHere) continue;
      const FrameRemoval* one = removals_.find(id, kHeldHere, frame.lamport_time, by_request);
      if (one == nullptr) continue;
      all.insert({PendingYield::Kind::kRemove, frame.id, one->owner, frame.lamport_time,
                  one->lamport_time});
    }
  }
}

// Removals by this process that end no claim of a partition that is there. They would end it later,
// if that partition were away for a while, with all that was done to its frame in the meantime.
void FrameClaims::add_conceded(std::set<PendingYield>& all) const {
  const auto here = [](const FrameRemoval& one) { return one.owner == kHeldHere; };
  for (const std::string& id : doubted_) {
    const auto there = forest_.info(id);
    if (!there || there->owner == kHeldHere || !is_there(there->owner)) continue;
    if (succession_.survived(kHeldHere, there->owner)) continue;
    if (removals_.find(id, there->owner, there->lamport_time, here) == nullptr) continue;
    all.insert({PendingYield::Kind::kConcede, id, there->owner, there->lamport_time});
  }
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
              succession_.reported_survivor(after->owner, before->owner))) {
    // Others may have noticed it before.
    changes_.frame_taken_over(id, after->parent, name(claim.owner), name(before->owner));
  } else if (before->parent != after->parent || before->owner != after->owner) {
    changes_.frame_moved(id, after->parent, name(claim.owner));
  }
}

FrameClaims::Cycle FrameClaims::cycle_of(const std::string& id, const FrameClaim& claim) const {
  Cycle cycle{
      {id, claim.parent, claim.owner, false, claim.lamport_time}, {}, is_there(claim.owner)};
  for (auto edge = forest_.info(claim.parent); edge && edge->id != id;
       edge = forest_.info(edge->parent)) {
    if (edge->owner == kHeldHere) {
      if (!cycle.held || yields_to(*edge, *cycle.held)) cycle.held = edge;
      continue;
    }
    cycle.all_there = cycle.all_there && is_there(edge->owner);
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
