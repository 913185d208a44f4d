#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "partition/change_log.hpp"
#include "partition/frame_removals.hpp"
#include "partition/succession.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// A partition's claim to a frame and its parent.
struct FrameClaim {
  Owner owner = kHeldHere;
  std::string parent;
  std::uint64_t lamport_time = 0;
  std::uint32_t page = 0;  ///< the owner's page that contains the claim
  bool passed_on = false;  ///< the owner has handed the frame over: it is in force no more
};

/// Lamport times of all changes are multiples of it (Directory::next_lamport_time). Those between
/// say what part a claim has in a handover.
inline constexpr std::uint64_t kLamportGrid = 16;

// How the Lamport times of claims to a frame that is handed over differ from that of the offer, by
// its owner (FrameClaims).
inline constexpr std::uint64_t kAdopted = 1;   ///< the new owner claims it so much later
inline constexpr std::uint64_t kPassedOn = 4;  ///< the former owner lets go
inline constexpr std::uint64_t kKept = 1;      ///< the former owner keeps it: so much earlier

/// Whether the claim offers the frame.
[[nodiscard]] inline bool is_offer(std::uint64_t claim) {
  return claim % kLamportGrid == kLamportGrid / 2;
}
/// Whether its owner offers the frame to the one with the other claim, and that one has adopted it.
[[nodiscard]] inline bool is_adopted(std::uint64_t offer, std::uint64_t claim) {
  return is_offer(offer) && offer + kAdopted == claim;
}
/// Whether the owner with the first claim has kept the frame, which the other one has adopted.
[[nodiscard]] inline bool is_kept(std::uint64_t kept, std::uint64_t claim) {
  return is_adopted(kept + kKept, claim);
}
/// Whether the owner that has handed it over only repeats its claim.
[[nodiscard]] inline bool is_passed_on(std::uint64_t to, std::uint64_t from) {
  return is_adopted(to - kAdopted, to) && to - kAdopted + kPassedOn == from;
}

/// The time of an offer to a partition, a little after a multiple of the grid: it says to which
/// one, so that no other one can adopt the frame. Of 65,536 names, two are taken for the same.
[[nodiscard]] std::uint64_t time_of_offer(std::uint64_t earliest, const std::string& to);
[[nodiscard]] bool is_offered_to(std::uint64_t offer, const std::string& partition);

/// A frame that this process's partition would have to yield, or move, because of claims of others.
/// Messages on their way may resolve it, for example a claim that was withdrawn. So it is done only
/// after the others were asked for their current state.
struct PendingYield {
  enum class Kind : std::uint8_t {
    kRelease,  ///< `rival` has the older claim to the id: release the frame
    kUnhang,   ///< the frame closes a cycle with an earlier move by `rival`: make it a root
    kRemove,   ///< `rival` removed the frame or its parent: remove the frame, too
    kConcede,  ///< `rival` has the frame, and its claim holds: forget that it was removed here
  };
  Kind kind = Kind::kRelease;
  std::string frame;
  Owner rival = kHeldHere;
  /// When the frame got its parent. Another frame of that name, or a later move, is a different
  /// case.
  std::uint64_t lamport_time = 0;
  std::uint64_t removed_at = 0;  ///< Lamport time of the rival's removal, if that is the reason

  friend bool operator<(const PendingYield& a, const PendingYield& b) {
    return std::tie(a.kind, a.frame, a.rival, a.lamport_time) <
           std::tie(b.kind, b.frame, b.rival, b.lamport_time);
  }
};

/// Decides which claims are in force, and writes those into the forest. If several partitions claim
/// a frame, Succession decides. In each cycle of claims the youngest one is cut, and its frame is a
/// root; claims of partitions that are gone are cut first, and of equally old ones that of the
/// greater id. If a partition has survived another one and then removes a frame, earlier claims of
/// the other one have ended, too. So the result is a function of the claims, the removals and of
/// which partitions are present, not of the order in which they came. A held frame stays until its
/// owner yields; participants that do not own it see the result at once. Not thread-safe.
class FrameClaims {
 public:
  FrameClaims(Forest& forest, ChangeLog& changes) : forest_(forest), changes_(changes) {}

  /// Numbers the partitions; the first is this process's own.
  Owner add_owner(std::string name) { return succession_.add_owner(std::move(name)); }
  [[nodiscard]] const std::string& name(Owner owner) const { return succession_.name(owner); }

  /// Sets whether a partition is present; initially all are. O(contested frames) if it changes.
  void set_standing(Owner owner, Succession::Standing standing);
  /// Sets which partitions a partition claims to have survived. O(contested frames) if it changes.
  void set_survived(Owner owner, std::set<Owner> survived);

  /// Whether that partition also claims a frame that this process holds. O(contested frames).
  [[nodiscard]] bool contests_held(Owner owner) const;

  /// Which of two claims of one partition to a frame, on two of its pages, to take.
  enum class Counts { kTheYounger, kThis };

  /// A partition claims a frame, perhaps repeatedly. O(1) if no other partition does.
  /// @return whether the claim is new
  bool claim(const std::string& id, FrameClaim claim, Counts counts = Counts::kTheYounger);

  /// A page of the partition no longer claims the frame. A later claim of another page stays.
  /// @return whether the claim is gone
  bool unclaim(const std::string& id, Owner owner, std::uint32_t page);

  /// The partition's claim to the frame, whether it is in force or not. O(1).
  [[nodiscard]] std::optional<FrameClaim> claim_of(const std::string& id, Owner owner) const;

  /// A partition has removed or dropped a frame. O(1).
  void removed(const std::string& id, const FrameRemoval& removal);
  /// The page of the partition no longer says that.
  void forget_removal(const std::string& id, Owner owner, std::uint32_t page);

  /// This process released a frame: the claim of another partition may now be in force.
  void released(const std::string& id);

  /// Prepares for holding a frame that may belong to another partition. A new partition yields to
  /// those present, whichever claim is older, unless it has survived them, or an earlier process of
  /// it and the other one were handing the frame over.
  /// @param lamport_time  of the claim; absent: a new one
  /// @return false if it has to yield
  [[nodiscard]] bool take(const std::string& id, std::optional<std::uint64_t> lamport_time = {});
  /// The partition to which it has to yield.
  [[nodiscard]] Owner holder(const std::string& id,
                             std::optional<std::uint64_t> lamport_time = {}) const;

  // Handing over (frame_handovers.cpp). The owner offers the frame: it claims it again, at L. The
  // new owner claims it at L + 1, so that its claim is the younger one, which nobody prefers. Then
  // the former owner lets go, and claims it at L + 4 for a while: whoever knows both claims knows
  // by that who the owner is. Or it keeps the frame, and claims it at L - 1.

  /// The claim to a frame that is in force.
  [[nodiscard]] std::optional<FrameClaim> claim_in_force(const std::string& id) const;
  /// This process holds frames now, of which these claims were in force.
  void adopted(const std::vector<std::pair<std::string, FrameClaim>>& before);
  /// Whether that partition has adopted a frame that this process holds and offers.
  [[nodiscard]] bool has_adopted(Owner owner, const std::string& id) const;
  /// Whether others claim the frame, too, and may have to yield.
  [[nodiscard]] bool is_contested(const std::string& id) const;
  /// This process lets go of frames that that partition has adopted.
  void pass_on(Owner owner, const std::vector<std::string>& ids);
  /// Whether this partition has got the held frame, or has kept it, and the other one still claims
  /// it, too. Until then the frame's Lamport time must stay, even if the frame is moved: the other
  /// claim would be the older one.
  [[nodiscard]] bool is_just_handed(const std::string& id) const;
  /// The partition that offers a held frame to this one, according to their claims alone.
  [[nodiscard]] std::optional<Owner> offered_by(const std::string& id) const;
  /// Whether that partition has kept a frame that this one has adopted at this time.
  [[nodiscard]] bool has_kept(Owner owner, const std::string& id, std::uint64_t adopted) const {
    const auto theirs = claim_of(id, owner);
    return theirs && is_kept(theirs->lamport_time, adopted);
  }
  /// Whether a partition does not count any more.
  [[nodiscard]] bool is_gone(Owner owner) const { return succession_.is_gone(owner); }
  /// Whether the claims of the second do not count against those of the first.
  [[nodiscard]] bool reported_survivor(Owner first, Owner second) const {
    return succession_.reported_survivor(first, second);
  }
  /// Whether a partition has removed, released or yielded the frame, later than that.
  [[nodiscard]] bool has_removed(Owner owner, const std::string& id, std::uint64_t since) const;
  /// Whether another partition claims the held frame, later than that.
  [[nodiscard]] bool is_claimed_since(const std::string& id, std::uint64_t since) const;

  /// This process is going to place a frame below itself. Cuts the path from `parent` up to the
  /// frame, at the youngest claim of others; mend() then finds out who has to yield.
  /// @return false if no edge of the path belongs to others
  [[nodiscard]] bool make_way(const std::string& parent);

  /// Connects frames whose parents were not possible before. Only cycles cause such frames.
  void mend();

  /// Whether any claims exclude each other.
  [[nodiscard]] bool contested() const {
    return !shadowed_.empty() || !cut_.empty() || !doubted_.empty();
  }

  /// What this process would have to yield now. O(contested frames).
  [[nodiscard]] std::set<PendingYield> pending_yields() const;
  /// Held frames that a new partition yields, since those present have removed them. As take().
  [[nodiscard]] std::set<PendingYield> removed_before() const;

 private:
  using Claims = std::vector<const FrameClaim*>;

  /// Whether a partition that has survived its owner has removed the frame since; or has dropped
  /// it, and the owner is still gone.
  [[nodiscard]] bool is_ended(const std::string& id, const FrameClaim& claim) const;
  /// The claim that holds; null: all have ended.
  [[nodiscard]] const FrameClaim* winning_claim(const std::string& id, Claims claims) const;
  /// Held frames that others have removed for whom the condition holds.
  template <class Condition>
  void add_removed(std::set<PendingYield>& all, Condition condition) const;
  void add_orphans(std::set<PendingYield>& all) const;
  void add_conceded(std::set<PendingYield>& all) const;
  void doubt(const std::string& id);
  void drop(const std::string& id);
  [[nodiscard]] bool is_there(Owner owner) const {
    return succession_.standing(owner) == Succession::Standing::kThere;
  }
  [[nodiscard]] bool may_take_from(Owner owner) const;
  [[nodiscard]] bool goes_on(std::uint64_t own, Owner owner, std::uint64_t theirs) const;
  [[nodiscard]] const FrameClaim* shadowed(const std::string& id, Owner owner) const;
  /// Of two edges in a cycle: whether the first one is to be cut rather than the second.
  [[nodiscard]] bool yields_to(const FrameInfo& a, const FrameInfo& b) const;
  [[nodiscard]] FrameClaim in_force(const FrameInfo& there) const;
  [[nodiscard]] std::uint32_t page_of(std::string_view id) const;
  void shadow(const std::string& id, FrameClaim claim);
  /// @param held  the time of the claim of this process, if it is about to hold the frame
  void note_passed_on(const std::string& id, std::optional<std::uint64_t> held = {});
  void promote(const std::string& id);
  void reconsider();
  void reconsider(const std::string& id);
  void put(const std::string& id, const FrameClaim& claim);
  void break_cycle(const std::string& id, const FrameClaim& claim);
  void cut(const FrameInfo& frame);
  /// In the cycle that a claim would close: the youngest edge of other owners, and the youngest
  /// held one.
  struct Cycle {
    FrameInfo youngest;
    std::optional<FrameInfo> held;
    bool all_there = true;  ///< the owners of all edges are
  };
  [[nodiscard]] Cycle cycle_of(const std::string& id, const FrameClaim& claim) const;

  Forest& forest_;
  ChangeLog& changes_;
  Succession succession_;
  // All claims except those in force: to frames claimed by several partitions, and to frames that
  // do not exist because others have removed them.
  std::unordered_map<std::string, std::vector<FrameClaim>> shadowed_;
  FrameRemovals removals_;
  // Frames with a claim in force that is older than such a removal, perhaps no longer.
  std::set<std::string> doubted_;
  std::vector<std::uint32_t> page_of_slot_;  // of the claims in force
  // Claims of frames that are roots because they would close a cycle.
  std::map<std::string, FrameClaim> cut_;
};

}  // namespace tfdude
