#pragma once

#include <cstdint>
#include <limits>
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

/// A participant's replica of the structure: which partition owns which frame. Writes what owners
/// publish into the participant's forest, and maps partitions to the forest's owner numbers. Its
/// content is a function of the pages, not of the order in which they came. Not thread-safe; the
/// forest it writes to is.
class Directory {
 public:
  /// @param own  the name of the partition that this process serves; empty: none
  Directory(Forest& forest, std::string own);
  ~Directory() = default;
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;

  /// From now on no pages come (AskedFrames): what is not here is not missing.
  void do_without_pages() { without_pages_ = true; }

  /// How many names of partitions are kept at most.
  static constexpr std::size_t kMaxPartitions = 4096;
  /// How much of the pages of others is kept at most: their entries, tombstones and joints, one
  /// more for each page, and what is kept of the pages that they name. Pages beyond are dropped, so
  /// that their partitions stay incomplete until these pages come again.
  void limit_others(std::size_t items) { most_items_ = items; }
  /// Messages of others that were dropped because of these limits.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// Whether pages of that partition's latest process were, and have not come again.
  [[nodiscard]] bool is_cut(std::string_view partition) const;
  /// Partitions whose messages were dropped for the first time since the last call.
  [[nodiscard]] std::vector<std::string> take_cut() { return std::exchange(cut_, {}); }

  /// A partition is served, or stops. A later incarnation replaces an earlier one.
  void apply(const Presence& presence, Time now);

  /// A page of a partition's structure. If an earlier incarnation is known, the pages of a new one
  /// replace it only once all have come. So frames that a restart does not change exist all the
  /// time.
  void apply(const Page& page);

  /// The partition's participant is lost; its structure is kept.
  /// @param early  as of Absences::mark_absent()
  /// @return false if this was known
  bool lost(std::string_view partition, std::uint64_t incarnation, Time now,
            std::chrono::nanoseconds early = {});

  /// Evaluates silences: a partition silent for Absences::kGrace counts as absent. After kTakeover
  /// it counts as gone, and frames that others also claim go to them. Call again while
  /// any_pending(). @return whether any partition is newly absent or gone
  bool look_for_gone(Absences::Steady now);
  [[nodiscard]] bool any_pending() const { return absences_.any_pending(); }

  /// Whether a partition that this process has not discovered is reported silent, so that it may
  /// return at any moment, or is gone for so short a time that it would not yield to this process.
  [[nodiscard]] bool awaits_silent() const { return absences_.any_hearsay(); }

  /// Whether a partition may be forgotten. @return kPartitionTaken if it is reachable
  [[nodiscard]] Result<void> check_not_there(const std::string& partition) const;
  /// Drops everything about an unreachable partition.
  /// @param incarnation  the latest that the sender of the request has heard of
  /// @return as check_not_there().
  [[nodiscard]] Result<void> forget(const std::string& partition, std::uint64_t incarnation,
                                    Time now);
  /// The latest incarnation heard of; 0: none.
  [[nodiscard]] std::uint64_t latest_incarnation(const std::string& partition) const;

  /// Restores the partitions that an earlier process of this partition missed.
  void restore(const std::vector<Absent>& absent);

  /// The greatest other incarnation of this process's partition that others know and that would
  /// hide this one.
  [[nodiscard]] std::optional<std::uint64_t> hidden_by(std::uint64_t own) const;
  /// Others may know this valid incarnation of this process's partition.
  void others_know(std::uint64_t incarnation) {
    own_heard_of_ = std::max(own_heard_of_, incarnation);
  }

  /// Partitions of which messages were dropped as outdated since the last call; each incarnation
  /// once.
  struct Outdated {
    std::string partition;
    std::uint64_t incarnation = 0;
    std::uint64_t latest = 0;
  };
  [[nodiscard]] std::vector<Outdated> take_outdated() { return std::exchange(outdated_, {}); }

  /// Adds a joint of this process's partition.
  void put_own_joint(const PageJoint& joint);
  void erase_own_joint(const PageJoint& joint);

  /// Where positions of a joint go: to the owners of a joint of this name, or of one that follows
  /// it. A name that no joint has may be PARTITION/JOINT. O(log joints).
  struct JointRoute {
    std::string name;           ///< that the owners know
    std::vector<Owner> owners;  ///< without duplicates
  };
  /// @return kUnknownJoint; kAmbiguousJoint if joints of several partitions have this name, so that
  ///   one message would move several robots
  [[nodiscard]] Result<JointRoute> route_joint(const std::string& name) const;

  /// This process released a frame: the claim of another partition may now be in force. What it has
  /// said of the frame is noted before.
  void released(const std::string& id) { claims_.released(id); }

  /// A tombstone of this process's partition, instead of an earlier one of that frame; or none any
  /// more.
  void note_own(const Tombstone& tombstone);
  void forget_own_tombstone(const std::string& id) { claims_.forget_removal(id, kHeldHere, 0); }

  /// This process moved a frame that it holds: frames of others may now fit below it.
  void moved() { claims_.mend(); }

  /// As FrameClaims::make_way().
  [[nodiscard]] bool make_way(const std::string& parent) { return claims_.make_way(parent); }

  /// As FrameClaims::take() and FrameClaims::holder().
  [[nodiscard]] bool take(const std::string& id, std::optional<std::uint64_t> lamport_time = {}) {
    return claims_.take(id, lamport_time);
  }
  [[nodiscard]] Owner holder(const std::string& id) const { return claims_.holder(id); }

  /// Claims to frames that are handed over.
  [[nodiscard]] FrameClaims& handovers() { return claims_; }

  /// What this process's partition would have to yield, according to what was applied so far.
  /// O(contested frames).
  [[nodiscard]] std::set<PendingYield> pending_yields();
  /// As FrameClaims::removed_before().
  [[nodiscard]] std::set<PendingYield> removed_before() const { return claims_.removed_before(); }
  /// Whether pending_yields() may be non-empty. O(1).
  [[nodiscard]] bool contested() const { return !orphans_.empty() || claims_.contested(); }

  /// A partition's configuration no longer names a frame: reports the frames that now wait for it.
  void report_orphans(const std::string& dropped, Owner by);

  /// This process has taken frames whose parents others may have removed before.
  void find_orphans();

  /// The Lamport time of a structure change: the time [ns since the UNIX epoch], but greater than
  /// all given or seen before (Lamport 1978, rules IR1 and IR2). So a change made with knowledge of
  /// another one has the greater time. It is a multiple of kLamportGrid: only those of claims in a
  /// handover lie between.
  [[nodiscard]] std::uint64_t next_lamport_time(Time now);

  /// Records a Lamport time given by an earlier process of this partition, or known to a sender:
  /// later ones will be greater.
  void saw_lamport_time(std::uint64_t time);
  /// The latest Lamport time given or seen.
  [[nodiscard]] std::uint64_t latest_lamport_time() const { return latest_lamport_time_; }

  /// Changes of others' frames, and of this process's frames as far as they are reported.
  [[nodiscard]] ChangeLog& changes() { return changes_; }

  /// The forest's owner number of a partition; kHeldHere for the own one.
  [[nodiscard]] std::optional<Owner> owner(std::string_view partition) const;
  /// The same for a partition that is only mentioned, and may be unknown: it gets a number.
  [[nodiscard]] Owner refer_to(const std::string& partition);
  [[nodiscard]] const std::string& name(Owner owner) const { return partitions_[owner].info.name; }
  [[nodiscard]] bool reachable(Owner owner) const { return partitions_[owner].info.reachable; }
  [[nodiscard]] const PartitionInfo& info(Owner owner) const { return partitions_[owner].info; }

  /// The epoch up to which this partition's structure is known here.
  [[nodiscard]] std::uint64_t epoch(Owner owner) const { return partitions_[owner].epoch; }

  /// Numbers the latest process of a partition, as far as it is known.
  [[nodiscard]] std::uint64_t process(Owner owner) const { return partitions_[owner].process(); }
  /// Whether what is known of the frames of a partition is of its process that lives.
  [[nodiscard]] bool is_of_live_process(Owner owner) const {
    const Known& partition = partitions_[owner];
    return partition.info.reachable && partition.incarnation == partition.live &&
           !partition.successor;
  }

  /// Whether all pages of all reachable partitions have come.
  [[nodiscard]] bool complete() const { return incomplete() == nullptr; }
  /// The name of a reachable partition with missing pages; null: none.
  [[nodiscard]] const std::string* incomplete() const;
  /// Grows with each page that comes, and with each partition that is there for the first time.
  [[nodiscard]] std::uint64_t progress() const { return pages_heard_ + partitions_.size(); }
  /// Whether a partition has come, or come back, of which nothing was known, and has not told all
  /// that it has. O(partitions).
  [[nodiscard]] bool arriving() const;

  /// An owner has announced a change that its structure shows in this epoch. @return whether it is
  /// the latest
  bool note_announced_epoch(Owner owner, std::uint64_t epoch);
  /// All such changes: the latest of each owner.
  [[nodiscard]] std::vector<SeenEpoch> announced_epochs() const;
  /// Whether that change has not come yet. A process that follows does not owe what its predecessor
  /// has announced: it shows all that was stored, and nothing else will come.
  [[nodiscard]] bool owes_change(Owner owner) const {
    const Known& partition = partitions_[owner];
    return !without_pages_ && partition.is_told() &&
           (partition.incarnation != partition.told_by || partition.epoch < partition.told_epoch);
  }
  /// The name of a reachable partition with an announced change that has not come yet; null: none.
  [[nodiscard]] const std::string* behind() const;

  /// Finds the partitions that are back and of which nothing is contested any more: after a while
  /// their absence is forgotten. Called after each input: a message, or a change of own frames.
  void resolve_returns();
  /// The partitions that this participant misses, for its presence.
  [[nodiscard]] std::vector<Absent> absent() const { return absences_.all(); }

  /// A partition that is missed, and not all frames of which have come here.
  [[nodiscard]] std::optional<PartitionInfo> only_heard_of() const;

  /// Changes with everything beside the forest's structure that a plan depends on: which partitions
  /// are reachable, as which process, and who owns which joint.
  [[nodiscard]] std::uint64_t version() const { return version_; }

  /// The other partitions that are reachable.
  [[nodiscard]] std::vector<Owner> reachable_owners() const;

  /// The other partitions and the own one, if any; sorted by name.
  [[nodiscard]] std::vector<PartitionInfo> partitions() const;

  /// The live incarnation of a partition, if one is known.
  [[nodiscard]] std::optional<Presence> serving(std::string_view partition) const;
  /// Whether that incarnation has also announced itself, and not only sent pages.
  [[nodiscard]] bool announced(std::string_view partition) const;

 private:
  static constexpr std::size_t kMostLeftOut = 64;
  using PageMap = std::map<std::uint32_t, Page>;
  using Ids = std::unordered_set<std::string_view>;

  /// The part of a page that is needed later: its tombstones, and its ids, each preceded by its
  /// length in one byte. Separate strings would take most of the memory of a large structure.
  struct KeptPage {
    std::uint64_t epoch = 0;
    std::string ids;
    std::vector<Tombstone> tombstones;
    std::vector<PageJoint> joints;
    std::size_t items = 0;
  };

  /// A new incarnation of a partition with a known structure, until all its pages have come.
  struct Successor {
    std::uint64_t incarnation = 0;
    std::optional<std::uint32_t> page_count;  // from its presence
    PageMap pages;
    std::size_t items = 0;
  };
  struct Known {
    PartitionInfo info;
    std::uint64_t live = 0;                // the latest incarnation heard
    std::uint64_t announced = 0;           // the latest incarnation whose presence has come
    std::optional<std::uint64_t> told_up;  // the ticket of the process that was reported as up
    std::uint64_t incarnation = 0;         // of the pages
    std::uint64_t epoch = 0;               // up to which everything has come
    std::uint64_t awaited_epoch = 0;       // will be complete once `awaited` has come
    std::uint64_t told_epoch = 0;          // of an announced change
    std::uint64_t told_by = 0;             // the process that has announced it
    std::vector<PageEpoch> awaited;
    std::uint32_t page_count = 0;
    std::map<std::uint32_t, KeptPage> pages;
    std::size_t items = 0;  // of the pages
    std::optional<Successor> successor;
    // What has come of a process that is taken for gone, and may only be silent. Its pages do not
    // come again, since nobody tells it that they were dropped.
    std::optional<Successor> silenced;
    std::uint64_t cut = 0;  // the latest incarnation of which pages were dropped
    // Of these the last versions were dropped; if there are kMostLeftOut, perhaps those of others.
    std::vector<std::uint32_t> left_out;
    std::uint64_t heard_of = 0;  // the latest incarnation mentioned by others
    bool forgotten = false;      // up to heard_of
    // Up to this incarnation, once the partition is unreachable here, too.
    std::uint64_t to_forget = 0;
    // What it has last said that it has forgotten.
    std::set<std::string> forgets;
    // When others have forgotten this one, as far as that was heard. Who passes it on does not
    // change that.
    std::set<std::int64_t> forgotten_at;
    bool missed_by_others = false;
    // Others forget it now, perhaps without having heard of `live`.
    bool to_forget_all = false;
    [[nodiscard]] bool listed() const { return !forgotten && (live != 0 || missed_by_others); }
    std::uint64_t reported = 0;  // the last one dropped as outdated

    [[nodiscard]] bool outdated(std::uint64_t one) const {
      return one < live || one < heard_of || (forgotten && one == heard_of);
    }
    // Whether the process that runs has announced a change.
    [[nodiscard]] bool is_told() const { return told_epoch > 0 && told_by == process(); }
    [[nodiscard]] std::uint64_t process() const { return std::max(live, incarnation); }
    [[nodiscard]] bool is_cut() const { return cut == live && !left_out.empty(); }
    [[nodiscard]] bool complete() const {
      return !successor && pages.size() >= page_count && !is_cut();
    }
  };

  Known& known(const std::string& partition, Owner& owner);
  /// Whether that name is known, or can still be.
  [[nodiscard]] bool has_room_for(const std::string& partition) const {
    return partitions_.size() < kMaxPartitions || number_of(partition);
  }
  [[nodiscard]] bool has_room_for(const Known& partition, const Page& page) const;
  void refuse(const std::string& partition);
  void leave_out(Known& partition, const Page& page);
  [[nodiscard]] std::optional<Owner> number_of(std::string_view partition) const;
  void hear_absent(Owner from, const Presence& presence);
  void hear_of(const Absent& one, const std::string& teller);
  void hear_forgotten(Known& partition, const Absent& one, bool news);
  void forget_if_gone(Known& partition, Time since);
  void hear_of_itself(const std::vector<Absent>& absent);
  /// Whether this participant tells others what it knows of absent partitions.
  [[nodiscard]] bool has_voice() const { return !partitions_.front().info.name.empty(); }
  [[nodiscard]] std::optional<Absent> told_absence(const Known& partition) const;
  /// Whether an absent partition may claim what is held here, or was removed here.
  [[nodiscard]] bool may_contest(const std::string& partition) const;
  bool drop_outdated(Known& partition, std::uint64_t incarnation);
  void came_back(Known& partition, Owner owner);
  void mark_absent(Known& partition, Owner owner, bool stopped, Time now,
                   std::chrono::nanoseconds early = {});
  void drop_structure(Known& partition, Owner owner);
  [[nodiscard]] Successor structure_in_force(const Known& partition, Owner owner);
  [[nodiscard]] std::optional<Successor> structure_of_live(const Known& partition, Owner owner);
  /// Of several, the latest. What is kept was there before, so this takes no more room.
  static void keep_for_return(Known& partition, Successor structure);
  void tell_claims();
  static Successor* succeed(Known& partition, std::uint64_t incarnation);
  void replace_if_complete(Known& partition, Owner owner);
  static void note_epoch(Known& partition, const Page& page);
  void put_page(Known& partition, Owner owner, const Page& page, Ids& outdated);
  void unclaim_all_but(const Ids& stays, Known& partition, Owner owner, std::uint32_t number);
  /// Those who have to do with a joint's name; one entry per joint and page.
  struct JointUse {
    std::multiset<Owner> movers;  // have a joint of that name, which follows none
    std::multiset<Owner> others;  // have one that follows another, or one that follows this one
  };
  void put_removals(const Page& page, Owner owner);
  void erase_removals(const std::vector<Tombstone>& before, const std::vector<Tombstone>& now,
                      Owner owner, std::uint32_t number);
  void add_joint(const PageJoint& joint, Owner owner);
  void forget_joint(const PageJoint& joint, Owner owner);
  void forget_use(const std::string& name, std::multiset<Owner> JointUse::*part, Owner owner);
  /// Whether it may own a frame; another partition may have all frames of one that is absent.
  [[nodiscard]] bool has_frames(Owner owner) const;
  /// Without those that others have left no frame, if there are several.
  [[nodiscard]] std::vector<Owner> living(const std::multiset<Owner>& owners) const;
  [[nodiscard]] Result<JointRoute> route_joint_of(Owner owner, const std::string& name) const;
  [[nodiscard]] static std::optional<Owner> mimicker_of(const JointUse& use);
  [[nodiscard]] std::string contested_text(const std::string& joint, const JointUse& use,
                                           const std::vector<Owner>& owners) const;
  void report_contested(const std::string& joint);
  void replace_joints(KeptPage& kept, const std::vector<PageJoint>& joints, Owner owner);
  [[nodiscard]] static std::vector<Tombstone> new_tombstones(
      const Known& partition, const std::vector<Tombstone>& tombstones);
  void report(const std::vector<Tombstone>& fresh, Owner owner);
  void find_orphans(const std::vector<Tombstone>& tombstones, Owner owner);

  Forest& forest_;
  ChangeLog changes_;
  FrameClaims claims_;
  std::vector<Known> partitions_;  // by Owner; the first is the own one
  std::unordered_map<std::string, Owner> owners_;
  std::set<PendingYield> orphans_;          // held frames whose parent another partition removed
  std::map<std::string, JointUse> joints_;  // by name
  std::map<std::string, std::set<Owner>> contested_joints_;  // those that were reported
  std::uint64_t latest_lamport_time_ = 0;
  Absences absences_{[this](const std::string& partition) { return may_contest(partition); }};
  // The latest incarnation of the own partition mentioned by others.
  std::uint64_t own_heard_of_ = 0;
  std::uint64_t own_forgotten_ = 0;  // the latest one that others have forgotten
  std::vector<Outdated> outdated_;
  bool without_pages_ = false;
  std::size_t most_items_ = std::numeric_limits<std::size_t>::max();
  std::uint64_t refused_ = 0;
  std::vector<std::string> cut_;
  std::uint64_t version_ = 0;
  std::uint64_t pages_heard_ = 0;
};

}  // namespace tfdude
