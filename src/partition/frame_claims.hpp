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
#include "partition/succession.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// That a partition has a frame, and where it hangs it.
struct FrameClaim {
  Owner owner = kHeldHere;
  std::string parent;
  std::uint64_t lamport_time = 0;
  std::uint32_t page = 0;  ///< of its owner's, where it says so
};

/// A frame, or where it hangs, that the partition of this process would have to yield because of what others claim. What is
/// on its way may resolve it, such as a claim that was taken back: so it is done once the others were asked how far they
/// are.
struct PendingYield {
  enum class Kind : std::uint8_t {
    kRelease,  ///< the id was claimed earlier by `rival`: release the frame
    kUnhang,   ///< it closes a cycle with an earlier move of `rival`: make it a root
    kRemove,   ///< the frame that it hung below was removed by `rival`: so is it
  };
  Kind kind = Kind::kRelease;
  std::string frame;
  Owner rival = kHeldHere;
  /// When the frame was hung where it hangs: another of its name, or a move, is another matter.
  std::uint64_t lamport_time = 0;

  friend bool operator<(const PendingYield& a, const PendingYield& b) {
    return std::tie(a.kind, a.frame, a.rival, a.lamport_time) <
           std::tie(b.kind, b.frame, b.rival, b.lamport_time);
  }
};

/// Which of all claims are in force: writes those into the forest. Of several partitions that claim a frame
/// Succession says whose claim holds; in each cycle of claims the youngest does not, of those of partitions that are
/// gone where there are such, and its frame is a root (of the same age: that of the greater id). So what is in force is a function of the claims and of who is there, not of
/// the order in which they came. A held frame stays until its owner yields; whoever does not own it sees the
/// outcome at once. Not thread-safe.
class FrameClaims {
 public:
  FrameClaims(Forest& forest, ChangeLog& changes) : forest_(forest), changes_(changes) {}

  /// Numbers the partitions; the first is this process's own.
  Owner add_owner(std::string name) { return succession_.add_owner(std::move(name)); }
  [[nodiscard]] const std::string& name(Owner owner) const { return succession_.name(owner); }

  /// Whether a partition is there; all are at first. O(contested frames) where that is new.
  void set_standing(Owner owner, Succession::Standing standing);
  /// Whom a partition says that it has outlived. O(contested frames) where that is new.
  void set_outlived(Owner owner, std::set<Owner> outlived);

  /// Whether a frame that this process holds is claimed by that partition, too. O(contested frames).
  [[nodiscard]] bool contests_held(Owner owner) const;

  /// Which of two claims of one partition to a frame, on two of its pages, is the one to take.
  enum class Counts { kTheYounger, kThis };

  /// A partition claims a frame, perhaps once more. O(1) where nobody else does.
  /// @return whether it had not claimed it before
  bool claim(const std::string& id, FrameClaim claim, Counts counts = Counts::kTheYounger);

  /// A page of the partition's does not claim the frame any more. What another page has claimed since stays.
  /// @return whether the claim is gone
  bool unclaim(const std::string& id, Owner owner, std::uint32_t page);

  /// This process released a frame that it held: another's claim to it may be in force now.
  void released(const std::string& id);

  /// This process is going to hold a frame that may be another's now. Who comes yields to who is there already,
  /// whichever claim is the older one, unless this process's partition has outlived that.
  /// @return false where it has to yield
  [[nodiscard]] bool take(const std::string& id);
  /// To whom it has to yield then.
  [[nodiscard]] Owner holder(const std::string& id) const;

  /// This process is going to hang a frame below its own place. Cuts the way from there up to it at the youngest
  /// claim of others, for mend() to find out who has to yield.
  /// @return false where none of the way is others'
  [[nodiscard]] bool make_way(const std::string& parent);

  /// Hangs frames where they belong that could not hang there before. None, but for cycles.
  void mend();

  /// Whether any two claims cannot both hold.
  [[nodiscard]] bool contested() const { return !shadowed_.empty() || !cut_.empty(); }

  /// What this process would have to yield now. O(contested frames).
  [[nodiscard]] std::set<PendingYield> pending_yields() const;

 private:
  [[nodiscard]] bool may_take_from(Owner owner) const;
  /// Of two edges in a cycle: whether the first one is to be cut rather than the second.
  [[nodiscard]] bool yields_to(const FrameInfo& a, const FrameInfo& b) const;
  [[nodiscard]] FrameClaim in_force(const FrameInfo& there) const;
  [[nodiscard]] FrameClaim* shadowed(const std::string& id, Owner owner);
  [[nodiscard]] std::uint32_t page_of(std::string_view id) const;
  void shadow(const std::string& id, FrameClaim claim);
  void promote(const std::string& id);
  void reconsider();
  void put(const std::string& id, const FrameClaim& claim);
  void break_cycle(const std::string& id, const FrameClaim& claim);
  void cut(const FrameInfo& frame);
  /// Of the cycle that a claim would close: the youngest edge that others own, and the youngest held one.
  struct Cycle {
    FrameInfo youngest;
    std::optional<FrameInfo> held;
  };
  [[nodiscard]] Cycle cycle_of(const std::string& id, const FrameClaim& claim) const;

  Forest& forest_;
  ChangeLog& changes_;
  Succession succession_;
  // Frames that several partitions claim: all claims but the one in force.
  std::unordered_map<std::string, std::vector<FrameClaim>> shadowed_;
  std::vector<std::uint32_t> page_of_slot_;  // of the claims in force
  // Claims of frames that are roots because they would close a cycle.
  std::map<std::string, FrameClaim> cut_;
};

}  // namespace tfdude
