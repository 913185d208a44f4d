#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/directory.hpp"

// Which partitions are absent, which have returned, and which are forgotten.
namespace tfdude {

using Standing = Succession::Standing;

namespace {

// Of partitions that nobody calls silent any more.
template <class Partitions>
void end_silences(Partitions& partitions, const Absences& absences) {
  for (auto& partition : partitions) {
    if (!partition.info.silent) continue;
    const auto absence = absences.find(partition.info.name);
    partition.info.silent = absence && absence->kind == Absent::Kind::kSilent;
  }
}

}  // namespace

// What this participant knows of an absent partition, if it tells others: one without a partition
// cannot.
std::optional<Absent> Directory::told_absence(const Known& partition) const {
  return has_voice() ? absences_.find(partition.info.name) : std::nullopt;
}

// Nothing is known of one that this process has not met. One that was forgotten must hear of it.
bool Directory::may_contest(const std::string& partition) const {
  const auto number = number_of(partition);
  if (!number) return true;
  const Known& absent = partitions_[*number];
  return absent.live == 0 || absent.forgotten || !absent.complete() ||
         claims_.contests_held(*number);
}

bool Directory::drop_outdated(Known& partition, std::uint64_t incarnation) {
  if (!partition.outdated(incarnation)) return false;
  // A participant that misses it, or has forgotten it, informs it, and it continues with a higher
  // number.
  const bool is_told = told_absence(partition).has_value();
  if (!is_told && !partition.info.reachable) {
    const bool kept = partition.silenced && partition.silenced->incarnation == incarnation;
    // Others may not say again that they have forgotten it. What was kept they have not forgotten.
    if (partition.forgotten && !kept)
      partition.to_forget = std::max(partition.to_forget, partition.heard_of);
    // This message may be late, and the later process be silent for a moment only.
    if (partition.successor && partition.successor->incarnation > incarnation)
      keep_for_return(partition, *std::exchange(partition.successor, {}));
    partition.live = partition.heard_of = 0;
    return false;
  }
  if (is_told) absences_.relied_on(partition.info.name);
  if (partition.reported != incarnation) {
    partition.reported = incarnation;
    outdated_.push_back(
        {partition.info.name, incarnation, std::max(partition.live, partition.heard_of)});
  }
  return true;
}

void Directory::came_back(Known& partition, Owner owner) {
  if (!std::exchange(partition.info.reachable, true)) ++version_;
  partition.info.stopped = partition.info.silent = false;
  partition.forgotten = false;
  // One that was forgotten is told so until it continues with a higher number.
  const auto told = told_absence(partition);
  const bool is_forgotten = told && told->kind == Absent::Kind::kForgotten;
  const bool missed = !(is_forgotten && partition.live <= told->incarnation) &&
                      absences_.returned(partition.info.name);
  claims_.set_standing(owner, Standing::kThere);
  if (missed) tell_claims();
}

void Directory::mark_absent(Known& partition, Owner owner, bool stopped, Time now,
                            std::chrono::nanoseconds early) {
  if (std::exchange(partition.info.reachable, false)) ++version_;
  partition.info.stopped = stopped;
  partition.info.silent = false;
  partition.info.since = now;
  absences_.mark_absent(partition.info.name, partition.live, stopped, now, early);
  absences_.teller_gone(partition.info.name);
  end_silences(partitions_, absences_);
  partition.told_up.reset();
  changes_.partition_down(partition.info.name, stopped);
  const auto missed = absences_.find(partition.info.name);
  const bool silent = !stopped && missed && missed->kind == Absent::Kind::kSilent;
  claims_.set_standing(owner, silent ? Standing::kSilent : Standing::kGone);
  tell_claims();
  if (partition.to_forget >= std::max(partition.live, partition.heard_of)) {
    (void)forget(partition.info.name, partition.to_forget, now);
  }
}

bool Directory::lost(std::string_view partition, std::uint64_t incarnation, Time now,
                     std::chrono::nanoseconds early) {
  const auto number = number_of(partition);
  if (!number || *number == kHeldHere) return false;
  Known& gone = partitions_[*number];
  if (gone.live != incarnation || !gone.info.reachable) return false;
  mark_absent(gone, *number, false, now, early);
  return true;
}

bool Directory::look_for_gone(Absences::Steady now) {
  const Absences::Looked looked = absences_.look(now);
  for (const std::string& name : looked.gone) {
    if (const auto number = number_of(name)) claims_.set_standing(*number, Standing::kGone);
  }
  const bool news = looked.counts || !looked.gone.empty();
  if (!news) return false;
  tell_claims();
  end_silences(partitions_, absences_);
  for (Known& partition : partitions_) forget_if_gone(partition, partition.info.since);
  return true;
}

// Passes on the partitions that this participant has survived.
void Directory::tell_claims() {
  std::set<Owner> survived;
  for (const Absent& one : absences_.all()) {
    const auto number = number_of(one.partition);
    if (number && Absences::survived(one.kind)) survived.insert(*number);
  }
  claims_.set_survived(kHeldHere, std::move(survived));
}

void Directory::hear_absent(Owner from, const Presence& presence) {
  std::set<Owner> survived;
  std::set<std::string> forgets;
  const std::string teller = partitions_[from].info.name;
  const bool same_process = partitions_[from].announced == presence.incarnation;
  // Only the process that reported a silence knows that it is over.
  if (!same_process) absences_.teller_restarted(teller);
  absences_.replace_reports(presence.absent, teller);
  for (const Absent& one : presence.absent) {
    // One presence can name thousands, which would leave no room for those that are there.
    if (partitions_.size() >= kMaxPartitions / 2 && !number_of(one.partition)) {
      refuse(one.partition);
      continue;
    }
    Owner number = kHeldHere;
    (void)known(one.partition, number);
    // A sender is reachable.
    if (number == from) continue;
    if (Absences::survived(one.kind)) survived.insert(number);
    if (number == kHeldHere) continue;
    if (one.kind != Absent::Kind::kForgotten) {
      hear_of(one, teller);
      continue;
    }
    forgets.insert(one.partition);
    auto& known_of = partitions_[number].forgotten_at;
    const bool is_new = known_of.insert(one.since).second;
    if (known_of.size() > Absences::kMost) known_of.erase(known_of.begin());
    hear_forgotten(partitions_[number], one, same_process && is_new);
  }
  end_silences(partitions_, absences_);
  // What the sender no longer forgets, it has heard a later process of.
  for (const std::string& name : std::exchange(partitions_[from].forgets, forgets)) {
    if (forgets.count(name) != 0) continue;
    Known& partition = partitions_[refer_to(name)];
    partition.to_forget = 0;
    partition.to_forget_all = false;
  }
  claims_.set_survived(from, std::move(survived));
}

void Directory::hear_of_itself(const std::vector<Absent>& absent) {
  const std::string& own = partitions_.front().info.name;
  for (const Absent& one : absent) {
    if (own.empty() || one.partition != own || one.incarnation >= IncarnationSource::kEnd) continue;
    std::uint64_t& latest = one.kind == Absent::Kind::kForgotten ? own_forgotten_ : own_heard_of_;
    latest = std::max(latest, one.incarnation);
  }
}

void Directory::hear_of(const Absent& one, const std::string& teller) {
  Owner number = kHeldHere;
  Known& partition = known(one.partition, number);
  if (partition.info.reachable) return;
  // Others may not have heard yet of something that was forgotten here.
  if (partition.forgotten && one.incarnation <= partition.heard_of) return;
  if (one.incarnation < IncarnationSource::kEnd) {
    partition.heard_of = std::max(partition.heard_of, one.incarnation);
    // Incarnations hidden by that number must hear of it.
    absences_.heard_of(one.partition, partition.heard_of);
  }
  partition.forgotten = false;
  if (partition.live != 0 || one.kind == Absent::Kind::kBack) return;
  // Another one may have said already what became of it.
  const bool is_known = partition.missed_by_others && !partition.info.silent;
  partition.missed_by_others = true;
  partition.info.since = Time(std::chrono::nanoseconds(one.since));
  if (one.kind != Absent::Kind::kSilent || !is_known) {
    partition.info.stopped = one.kind == Absent::Kind::kStopped;
    partition.info.silent = one.kind == Absent::Kind::kSilent;
  }
  absences_.add_report(one, teller);
  tell_claims();
}

// @param news  it was forgotten just now
void Directory::hear_forgotten(Known& partition, const Absent& one, bool news) {
  const Time since{std::chrono::nanoseconds(one.since)};
  const std::uint64_t latest = std::max(partition.live, partition.heard_of);
  if (one.incarnation >= latest && !partition.info.reachable) {
    (void)forget(partition.info.name, one.incarnation, since);
    return;
  }
  // A participant that was away itself may notice later that the partition is unreachable.
  if (partition.info.reachable)
    partition.to_forget = std::max(partition.to_forget, one.incarnation);
  if (one.incarnation >= latest || !news || partition.live < latest) return;
  partition.to_forget_all = true;
  forget_if_gone(partition, since);
}

// A participant that forgot the partition may not have heard of its latest process, which was heard
// here and is gone, too. A process that is silent for a moment only may have been started since.
// Nobody tells it that a participant without a voice has taken it for forgotten: it goes on as the
// same process, whose pages do not come again, so they are kept.
void Directory::forget_if_gone(Known& partition, Time since) {
  if (!partition.to_forget_all || partition.info.reachable) return;
  const auto absence = absences_.find(partition.info.name);
  if (absence && absence->kind == Absent::Kind::kSilent) return;
  std::optional<Successor> latest;
  if (!has_voice()) latest = structure_of_live(partition, refer_to(partition.info.name));
  (void)forget(partition.info.name, std::max(partition.live, partition.heard_of), since);
  if (latest) keep_for_return(partition, std::move(*latest));
}

std::optional<Directory::Successor> Directory::structure_of_live(const Known& partition,
                                                                 Owner owner) {
  for (const auto* aside : {&partition.successor, &partition.silenced}) {
    if (*aside && (*aside)->incarnation == partition.live) return *aside;
  }
  if (partition.incarnation != partition.live) return std::nullopt;
  return structure_in_force(partition, owner);
}

void Directory::keep_for_return(Known& partition, Successor structure) {
  auto& silenced = partition.silenced;
  const bool is_latest = !silenced || silenced->incarnation <= structure.incarnation;
  if (is_latest) silenced = std::move(structure);
}

void Directory::restore(const std::vector<Absent>& absent) {
  const std::string own = partitions_.front().info.name;
  for (const Absent& one : absent) {
    if (one.kind == Absent::Kind::kSilent) continue;
    Absent told = one;
    // This process has not discovered it yet.
    if (told.kind == Absent::Kind::kBack) told.kind = Absent::Kind::kLost;
    const auto number = number_of(one.partition);
    const bool met = number && partitions_[*number].info.reachable;
    const bool forgotten = told.kind == Absent::Kind::kForgotten;
    const bool same = met && partitions_[*number].live <= one.incarnation;
    if (forgotten ? same : !met) absences_.resume(told);
    if (forgotten) {
      hear_forgotten(partitions_[refer_to(one.partition)], told, false);
    } else {
      hear_of(told, own);
    }
  }
}

Result<void> Directory::check_not_there(const std::string& partition) const {
  const auto number = number_of(partition);
  // The own partition counts as reachable.
  if (!number || !partitions_[*number].info.reachable) return {};
  return fail(Errc::kPartitionTaken,
              "partition " + quote(partition) + " is reachable: stop it before you forget it");
}

Result<void> Directory::forget(const std::string& partition, std::uint64_t incarnation, Time now) {
  if (auto ok = check_not_there(partition); !ok) return ok;
  if (!has_room_for(partition)) {
    return fail(Errc::kTooMuch, "partition " + quote(partition) +
                                    " cannot be noted: this process " + "knows the names of " +
                                    std::to_string(kMaxPartitions) + " partitions, its limit");
  }
  Owner number = kHeldHere;
  Known& gone = known(partition, number);
  const std::uint64_t sound = incarnation < IncarnationSource::kEnd ? incarnation : 0;
  gone.heard_of = std::max({gone.heard_of, gone.live, sound});
  gone.forgotten = true;
  gone.to_forget_all = false;
  drop_structure(gone, number);
  if (gone.silenced && gone.silenced->incarnation <= gone.heard_of) gone.silenced.reset();
  absences_.forget(partition, gone.heard_of, now);
  claims_.set_standing(number, Standing::kGone);
  tell_claims();
  claims_.mend();
  return {};
}

void Directory::drop_structure(Known& partition, Owner owner) {
  for (auto& [number, page] : partition.pages) {
    unclaim_all_but({}, partition, owner, number);
    erase_removals(page.tombstones, {}, owner, number);
    replace_joints(page, {}, owner);
  }
  partition.pages.clear();
  partition.items = 0;
  partition.awaited.clear();
  partition.successor.reset();
  partition.page_count = 0;
  partition.incarnation = 0;
}

std::uint64_t Directory::latest_incarnation(const std::string& partition) const {
  const auto number = number_of(partition);
  if (!number) return 0;
  return std::max(partitions_[*number].live, partitions_[*number].heard_of);
}

std::optional<std::uint64_t> Directory::hidden_by(std::uint64_t own) const {
  const std::uint64_t latest = std::max(own_heard_of_, own_forgotten_);
  const bool hidden = own_heard_of_ > own || own_forgotten_ >= own;
  return hidden ? std::optional(latest) : std::nullopt;
}

// A return is resolved once all claims of the partition have come, and none of its frames is held
// here.
void Directory::resolve_returns() {
  for (const std::string& name : absences_.back()) {
    const auto number = number_of(name);
    if (!number) continue;
    const Known& partition = partitions_[*number];
    absences_.set_resolved(name, partition.info.reachable &&
                                     partition.announced == partition.live &&
                                     partition.complete() && !claims_.contests_held(*number));
  }
}

std::vector<Owner> Directory::reachable_owners() const {
  std::vector<Owner> all;
  for (Owner owner = 1; owner < partitions_.size(); ++owner) {
    if (reachable(owner)) all.push_back(owner);
  }
  return all;
}

std::optional<PartitionInfo> Directory::only_heard_of() const {
  const auto lacks = [&](const Known& partition) {
    const bool is_cut_off = !without_pages_ && !partition.info.reachable && !partition.complete();
    return (partition.live == 0 || is_cut_off) && partition.listed();
  };
  const auto one = std::find_if(partitions_.begin() + 1, partitions_.end(), lacks);
  if (one == partitions_.end()) return std::nullopt;
  return one->info;
}

bool Directory::arriving() const {
  if (without_pages_) return false;
  return std::any_of(partitions_.begin() + 1, partitions_.end(), [](const Known& partition) {
    // A successor leaves in force what was known.
    if (!partition.info.reachable || partition.is_cut() || partition.successor) return false;
    return partition.announced != partition.live || !partition.complete();
  });
}

std::optional<Presence> Directory::serving(std::string_view partition) const {
  const auto number = owner(partition);
  if (!number || *number == kHeldHere || !reachable(*number)) return std::nullopt;
  const Known& there = partitions_[*number];
  return Presence{there.info.name, there.live,       there.info.host,
                  there.info.pid,  there.page_count, true};
}

bool Directory::announced(std::string_view partition) const {
  const auto number = owner(partition);
  if (!number || *number == kHeldHere || !reachable(*number)) return false;
  return partitions_[*number].announced == partitions_[*number].live;
}

}  // namespace tfdude
