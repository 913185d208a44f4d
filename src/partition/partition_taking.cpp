#include <algorithm>
#include <set>

#include "tfdude/base/id.hpp"

#include "partition/partition.hpp"
#include "tree/revised_sample.hpp"

// The owner to which frames are handed over (partition_handover.cpp).
namespace tfdude {
namespace {

// The edge below another parent, as Forest::move() makes it.
Result<void> move_below(HandedEdge& edge, const std::string& parent, const PartialTransform& X_PC) {
  if (!X_PC.empty()) {
    const Transform all = edge.now ? whole(edge.X_PC, *edge.now, &edge.said) : edge.X_PC;
    auto value = with_parts(all, edge.id, X_PC);
    if (!value) return tl::unexpected(std::move(value.error()));
    edge.X_PC = *value;
    edge.now.reset();
  }
  edge.parent = parent;
  edge.samples.clear();
  edge.state = HandedState::kStatic;
  edge.left_behind = false;
  return {};
}

}  // namespace

// Only what its owner offers: what it claims at that time, and not before.
Result<void> Partition::check_offered(const std::vector<HandedEdge>& edges, const std::string& top,
                                      const AdoptRequest& request) const {
  const auto from = directory_.owner(request.from);
  const auto serving = directory_.serving(request.from);
  const bool lives =
      from && *from != kHeldHere && serving && serving->incarnation == request.part.incarnation;
  if (!lives) return fail_not_offered(top, request.from);
  // Its claim would not count, so that it could not keep the frame.
  if (directory_.handovers().reported_survivor(kHeldHere, *from)) {
    return fail(Errc::kNotYet, "partition " + quote(name_) + " has missed partition " +
                                   quote(request.from) + ", and both have not agreed yet");
  }
  for (const HandedEdge& edge : edges) {
    const auto claim = directory_.handovers().claim_of(edge.id, *from);
    const bool late = !directory_.is_of_live_process(*from) || !claim ||
                      claim->lamport_time + kKept < edge.lamport_time;
    if (late) {
      return fail(Errc::kNotYet, "partition " + quote(name_) +
                                     " has not heard yet that partition " + quote(request.from) +
                                     " hands over frame " + quote(edge.id));
    }
    if (claim->lamport_time != edge.lamport_time || !is_offered_to(claim->lamport_time, name_)) {
      return fail_not_offered(edge.id, request.from);
    }
  }
  return {};
}

tl::unexpected<Error> Partition::fail_not_offered(const std::string& id,
                                                  const std::string& from) const {
  return fail(Errc::kNotOwner, "partition " + quote(name_) + " does not know frame " + quote(id) +
                                   " as partition " + quote(from) + " hands it over");
}

Result<void> Partition::check_adopted(const std::vector<HandedEdge>& edges, const std::string& top,
                                      const AdoptRequest& request) const {
  if (auto ok = check_offered(edges, top, request); !ok) return ok;
  if (edges.front().id != top) return fail_not_offered(top, request.from);
  const auto from = directory_.owner(request.from);
  std::set<std::string> ids;
  for (const HandedEdge& edge : edges) {
    const auto there = forest_.info(edge.id);
    const bool known = there && there->owner == *from && there->parent == edge.parent;
    const bool below = edge.id == top || ids.count(edge.parent) != 0;
    if (!known || !below || !ids.insert(edge.id).second) {
      return fail_not_offered(edge.id, request.from);
    }
  }
  const std::string& parent = request.parent.value_or("");
  if (!parent.empty() && !forest_.exists(parent)) {
    return fail(Errc::kUnknownParent,
                "no frame " + quote(parent) + " to be the parent of " + quote(top));
  }
  if (frame_count() + edges.size() <= max_frames_) return {};
  return fail(Errc::kTooMuch, "frame " + quote(top) + " is not taken: partition " + quote(name_) +
                                  " has " + std::to_string(frame_count()) +
                                  " frames, and its limit is " + std::to_string(max_frames_));
}

Result<void> Partition::adopt(const PeerId& peer, const std::string& top,
                              const AdoptRequest& request, Time now) {
  directory_.saw_lamport_time(request.lamport_time);
  const auto has = handovers_.adopted.find(top);
  const auto& given = request.part.edges;
  const auto there = forest_.info(top);  // it may be gone, and not be settled yet
  const bool again = has != handovers_.adopted.end() && there && !given.empty() &&
                     has->second.offered == given.front().lamport_time &&
                     there->parent == request.parent.value_or(given.front().parent);
  if (again) return {};
  if (auto ok = check_offered(given, top, request); !ok) return ok;
  auto whole = adopted_parts_.add(peer, top, request.part, now);
  if (!whole) return tl::unexpected(std::move(whole.error()));
  if (!*whole) return {};
  std::vector<HandedEdge> edges = **std::move(whole);
  if (auto ok = check_adopted(edges, top, request); !ok) return ok;
  if (request.parent) {
    if (auto ok = move_below(edges.front(), *request.parent, request.X_PC); !ok) return ok;
  }
  FrameClaims& claims = directory_.handovers();
  std::vector<std::pair<std::string, FrameClaim>> before;
  for (HandedEdge& edge : edges) {
    before.emplace_back(edge.id, *claims.claim_in_force(edge.id));
    edge.lamport_time += kAdopted;
  }
  if (auto ok = forest_.adopt(edges); !ok) return ok;
  directory_.saw_lamport_time(before.front().second.lamport_time + kPassedOn);
  claims.adopted(before);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const HandedEdge& edge = edges[i];
    const FrameClaim& offer = before[i].second;
    handovers_.passed.erase(edge.id);
    handovers_.adopted[edge.id] = {offer.owner, offer.lamport_time};
    pages_.put(edge.id, edge.parent, edge.lamport_time);
    directory_.forget_own_tombstone(edge.id);
    directory_.changes().frame_moved(edge.id, edge.parent, name_);
  }
  values_asked_ = true;
  pages_.close_epoch();
  directory_.find_orphans();
  settle_handovers();
  return {};
}

// What an earlier process has offered stays. Of what it has adopted, the former owner decides.
void Partition::resume_handovers(const std::vector<const StoredFrame*>& kept) {
  const FrameClaims& claims = directory_.handovers();
  Handovers::Handover offered;
  for (const StoredFrame* frame : kept) {
    if (is_offer(frame->lamport_time)) {
      offered.frames.push_back({frame->id, frame->parent, frame->lamport_time});
    } else if (const auto from = claims.offered_by(frame->id)) {
      handovers_.adopted[frame->id] = {*from, claims.claim_of(frame->id, *from)->lamport_time};
    }
  }
  if (!offered.frames.empty()) keep(offered);
}

void Partition::freeze_adopted() {
  std::vector<std::string> ids;
  for (const auto& [id, one] : handovers_.adopted) ids.push_back(id);
  if (!ids.empty()) forest_.freeze(ids);
}

// What the former owner, as far as is known, has done with an adopted frame.
Partition::Outlook Partition::outlook(const std::string& id,
                                      const Handovers::Adopted& adopted) const {
  const FrameClaims& claims = directory_.handovers();
  const auto theirs = claims.claim_of(id, adopted.from);
  if (claims.is_gone(adopted.from)) {
    // Its claim, the older one, does not count if it returns after that.
    const auto absent = directory_.absent();
    const bool survived = std::any_of(absent.begin(), absent.end(), [&](const Absent& one) {
      return one.partition == directory_.name(adopted.from) && Absences::survived(one.kind);
    });
    return survived || !theirs ? Outlook::kOwned : Outlook::kOpen;
  }
  if (!directory_.is_of_live_process(adopted.from)) return Outlook::kOpen;
  // Its claim does not count for others either.
  if (claims.reported_survivor(kHeldHere, adopted.from)) return Outlook::kOwned;
  if (!theirs) {
    // What it has kept, it may have given away since.
    const bool lost = claims.has_removed(adopted.from, id, adopted.offered) ||
                      claims.is_claimed_since(id, adopted.offered + kPassedOn);
    return lost ? Outlook::kLost : Outlook::kOwned;
  }
  if (theirs->lamport_time == adopted.offered) return Outlook::kOpen;
  return theirs->lamport_time == adopted.offered + kPassedOn ? Outlook::kOwned : Outlook::kLost;
}

bool Partition::withdraw(const std::string& id) {
  if (!forest_.release(id)) return false;
  pages_.erase(id);
  directory_.released(id);
  return true;
}

bool Partition::settle_adopted() {
  std::vector<std::string> owned;
  bool changed = false;
  for (auto one = handovers_.adopted.begin(); one != handovers_.adopted.end();) {
    const std::string& id = one->first;
    const Outlook outlook = forest_.holds(id) ? this->outlook(id, one->second) : Outlook::kOwned;
    if (outlook == Outlook::kOwned) owned.push_back(id);
    if (outlook == Outlook::kLost) changed = withdraw(id) || changed;
    one = outlook == Outlook::kOpen ? std::next(one) : handovers_.adopted.erase(one);
  }
  if (!owned.empty()) forest_.thaw(owned);
  return changed;
}

}  // namespace tfdude
