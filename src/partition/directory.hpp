#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/types/partition_info.hpp"

#include "partition/absences.hpp"
#include "partition/change_log.hpp"
#include "partition/frame_claims.hpp"
#include "partition/incarnation.hpp"
#include "partition/messages.hpp"
#include "tree/forest.hpp"

namespace tfdude {

/// A participant's replica of the structure: which partition owns which frame. Writes what the owners
/// publish into the participant's forest and names the forest's owner numbers. What it holds is a function
/// of the pages, not of the order in which they came. Not thread-safe; the forest it writes to is.
class Directory {
 public:
  /// @param own  the name of the partition that this process serves; empty: none
  Directory(Forest& forest, std::string own);
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;

  /// A partition is served, or ends. A later incarnation replaces an earlier one.
  void apply(const Presence& presence, Time now);

  /// A piece of a partition's structure. That of an incarnation which is new, where an earlier one is known,
  /// takes its place once all of it has come, so that what a restart does not change stays there all the time.
  void apply(const Page& page);

  /// The partition's participant has gone; its structure is kept.
  /// @return false where this is not new
  bool lost(std::string_view partition, std::uint64_t incarnation, Time now);

  /// Who has been silent for Absences::kGrace has been absent; who has been for kTakeover is gone: frames that others claim,
  /// too, are theirs. To be called again while any_pending(). @return whether there are such
  bool look_for_gone(Absences::Steady now);
  [[nodiscard]] bool any_pending() const { return absences_.any_pending(); }

  /// Whether somebody whom this process has not met is said to be silent, so that it may be there again in a moment, or to be
  /// gone since so short a time that it would not yield to this process.
  [[nodiscard]] bool awaits_silent() const { return absences_.any_hearsay(); }

  /// Whether a partition may be forgotten. @return kPartitionTaken where it is there
  [[nodiscard]] Result<void> check_not_there(const std::string& partition) const;
  /// Nothing is kept of a partition that is not there.
  /// @param incarnation  the latest that whoever says so has heard of
  /// @return as check_not_there().
  [[nodiscard]] Result<void> forget(const std::string& partition, std::uint64_t incarnation,
                                    Time now);
  /// The latest incarnation that was heard of; 0: of none.
  [[nodiscard]] std::uint64_t latest_incarnation(const std::string& partition) const;

  /// Whom an earlier process of this partition missed.
  void restore(const std::vector<Absent>& absent);

  /// Others know of an incarnation of this process's partition that is not this one, and would hide it: the greatest.
  [[nodiscard]] std::optional<std::uint64_t> hidden_by(std::uint64_t own) const;

  /// Of whom something was dropped for its age since the last call; each incarnation once.
  struct Outdated {
    std::string partition;
    std::uint64_t incarnation = 0;
    std::uint64_t latest = 0;
  };
  [[nodiscard]] std::vector<Outdated> take_outdated() { return std::exchange(outdated_, {}); }

  /// This process's partition has a joint.
  void put_own_joint(const PageJoint& joint) { add_joint(joint, kHeldHere); }
  void erase_own_joint(const PageJoint& joint) { forget_joint(joint, kHeldHere); }

  /// Who has a joint of this name, or one that follows it; each once. O(log joints).
  [[nodiscard]] std::vector<Owner> joint_owners(const std::string& name) const;

  /// This process released a frame that it held: another's claim to it may show now.
  void released(const std::string& id) { claims_.released(id); }

  /// This process moved a frame that it holds: another's frame may hang below it now.
  void moved() { claims_.mend(); }

  /// As FrameClaims::make_way().
  [[nodiscard]] bool make_way(const std::string& parent) { return claims_.make_way(parent); }

  /// As FrameClaims::take() and FrameClaims::holder().
  [[nodiscard]] bool take(const std::string& id) { return claims_.take(id); }
  [[nodiscard]] Owner holder(const std::string& id) const { return claims_.holder(id); }

  /// What this process's partition would have to give up, by what was applied so far.
  /// O(contested frames).
  [[nodiscard]] std::set<PendingYield> pending_yields();
  /// Whether there may be any. O(1).
  [[nodiscard]] bool contested() const { return !orphans_.empty() || claims_.contested(); }

  /// A partition's configuration names a frame no more: reports what waits for that now.
  void report_orphans(const std::string& dropped, Owner by);

  /// This process has taken frames whose parents others may have removed before.
  void find_orphans();

  /// The Lamport time of a change of the structure: the time [ns since the UNIX epoch], but later than all that were given
  /// or seen before (Lamport 1978, rule IR1 and IR2), so that whoever knew of a change has the greater one.
  [[nodiscard]] std::uint64_t next_lamport_time(Time now);

  /// A Lamport time was given by an earlier process of this partition, or is known to a sender: those that are given from
  /// now on are later.
  void saw_lamport_time(std::uint64_t time);
  /// The latest that was given or seen.
  [[nodiscard]] std::uint64_t latest_lamport_time() const { return latest_lamport_time_; }

  /// What happened to the frames of others, and of this process as far as it is reported.
  [[nodiscard]] ChangeLog& changes() { return changes_; }

  /// The number under which the forest knows a partition; kHeldHere for the own one.
  [[nodiscard]] std::optional<Owner> owner(std::string_view partition) const;
  [[nodiscard]] const std::string& name(Owner owner) const { return partitions_[owner].info.name; }
  [[nodiscard]] bool reachable(Owner owner) const { return partitions_[owner].info.reachable; }
  [[nodiscard]] const PartitionInfo& info(Owner owner) const { return partitions_[owner].info; }

  /// Up to which epoch this partition's structure is here.
  [[nodiscard]] std::uint64_t epoch(Owner owner) const { return partitions_[owner].epoch; }

  /// Whether all pages of all reachable partitions have come.
  [[nodiscard]] bool complete() const { return incomplete() == nullptr; }
  /// The name of one of which they have not; null: there is none.
  [[nodiscard]] const std::string* incomplete() const;

  /// An owner has told of a change that its structure shows in this epoch.
  void told_of(Owner owner, std::uint64_t epoch);
  /// Whether that change has not come yet.
  [[nodiscard]] bool owes_change(Owner owner) const {
    return partitions_[owner].epoch < partitions_[owner].told_epoch;
  }
  /// The name of a reachable one whose structure is older here than what it has told of; null: there is none.
  [[nodiscard]] const std::string* behind() const;

  /// Whom this participant misses: what to tell others.
  [[nodiscard]] std::vector<Absent> absent() const { return absences_.all(); }

  /// A partition that others miss, and of which nothing else is known here.
  [[nodiscard]] std::optional<PartitionInfo> only_heard_of() const;

  /// Those other partitions that are reachable.
  [[nodiscard]] std::vector<Owner> reachable_owners() const;

  /// The other partitions and, where there is one, the own; sorted by name.
  [[nodiscard]] std::vector<PartitionInfo> partitions() const;

  /// The live incarnation of a partition, if one is known.
  [[nodiscard]] std::optional<Presence> serving(std::string_view partition) const;

 private:
  using PageMap = std::map<std::uint32_t, Page>;
  using Ids = std::unordered_set<std::string_view>;

  /// What of a page is needed later: its ids, each after its length in one byte, since most of the memory of a
  /// large structure would else go into strings; and its tombstones.
  struct KeptPage {
    std::uint64_t epoch = 0;
    std::string ids;
    std::vector<Tombstone> tombstones;
    std::vector<PageJoint> joints;
  };

  /// An incarnation that follows one whose structure is here, until all of its own has come.
  struct Successor {
    std::uint64_t incarnation = 0;
    std::optional<std::uint32_t> page_count;  // said by its presence
    PageMap pages;
  };
  struct Known {
    PartitionInfo info;
    std::uint64_t live = 0;           // the latest incarnation heard of
    std::uint64_t announced = 0;      // the latest whose presence has come
    std::uint64_t incarnation = 0;    // that of the pages
    std::uint64_t epoch = 0;          // up to which all has come,
    std::uint64_t awaited_epoch = 0;  // will have once these have, too
    std::uint64_t told_epoch = 0;     // of a change that it has told of
    std::vector<PageEpoch> awaited;
    std::uint32_t page_count = 0;
    std::map<std::uint32_t, KeptPage> pages;
    std::optional<Successor> successor;
    std::uint64_t heard_of = 0;   // the latest incarnation that others have spoken of
    bool forgotten = false;       // up to that one
    std::uint64_t to_forget = 0;  // up to that one, once it is not heard here, either
    bool missed_by_others = false;
    [[nodiscard]] bool listed() const { return !forgotten && (live != 0 || missed_by_others); }
    std::uint64_t reported = 0;  // the last that was dropped for its age

    [[nodiscard]] bool outdated(std::uint64_t one) const {
      return one < live || one < heard_of || (forgotten && one == heard_of);
    }
    [[nodiscard]] bool complete() const { return !successor && pages.size() >= page_count; }
  };

  Known& known(const std::string& partition, Owner& owner);
  [[nodiscard]] std::optional<Owner> number_of(std::string_view partition) const;
  void hear_absent(Owner from, const std::vector<Absent>& absent, Time now);
  void hear_of(const Absent& one, const std::string& teller, Time now);
  bool drop_outdated(Known& partition, std::uint64_t incarnation);
  void came_back(Known& partition, Owner owner);
  void went(Known& partition, Owner owner, bool stopped, Time now);
  void drop_structure(Known& partition, Owner owner);
  void resolve_returns();
  void tell_claims();
  Successor* succeed(Known& partition, std::uint64_t incarnation);
  void replace_if_complete(Known& partition, Owner owner);
  static void note_epoch(Known& partition, const Page& page);
  void put_page(Known& partition, Owner owner, const Page& page, Ids& outdated);
  void unclaim_all_but(const Ids& stays, Known& partition, Owner owner, std::uint32_t number);
  void add_joint(const PageJoint& joint, Owner owner);
  void forget_joint(const PageJoint& joint, Owner owner);
  void replace_joints(KeptPage& kept, const std::vector<PageJoint>& joints, Owner owner);
  [[nodiscard]] static std::vector<Tombstone> new_tombstones(
      const Known& partition, const std::vector<Tombstone>& tombstones);
  void report(const std::vector<Tombstone>& fresh, Owner owner);
  void find_orphans(const std::vector<Tombstone>& tombstones, Owner owner);

  Forest& forest_;
  ChangeLog changes_;
  FrameClaims claims_;
  std::vector<Known> partitions_;  // by Owner; the first is the own
  std::unordered_map<std::string, Owner> owners_;
  std::set<PendingYield> orphans_;  // held frames that hung below one that another removed
  std::map<std::string, std::multiset<Owner>> joint_owners_;  // once a joint and page
  std::uint64_t latest_lamport_time_ = 0;
  Absences absences_;
  std::uint64_t own_heard_of_ =
      0;  // the latest incarnation of the own partition that others have spoken of,
  std::uint64_t own_forgotten_ = 0;  // or have forgotten
  std::vector<Outdated> outdated_;
};

}  // namespace tfdude
