#include "partition/directory.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "partition/counters.hpp"

namespace tfdude {
namespace {

// Of a page in force.
std::size_t items_of(const Page& page) {
  return 1 + page.entries.size() + page.tombstones.size() + page.joints.size();
}

std::size_t items_of_all(const Page& page) { return items_of(page) + page.others.size(); }

// @param function  called with each id of a kept page
template <class Function>
void for_each_id(const std::string& ids, Function function) {
  for (std::size_t at = 0; at < ids.size();) {
    const std::size_t size = static_cast<unsigned char>(ids[at]);
    function(std::string_view(ids.data() + at + 1, size));
    at += 1 + size;
  }
}

}  // namespace

Directory::Directory(Forest& forest, std::string own)
    : forest_(forest), claims_(forest, changes_), partitions_(1) {
  if (!own.empty()) owners_.emplace(own, kHeldHere);
  (void)claims_.add_owner(own);
  partitions_.front().info.name = std::move(own);
  partitions_.front().info.reachable = true;
}

Directory::Known& Directory::known(const std::string& partition, Owner& owner) {
  const auto [entry, added] = owners_.emplace(partition, static_cast<Owner>(partitions_.size()));
  owner = entry->second;
  if (added) {
    (void)claims_.add_owner(partition);
    partitions_.emplace_back();
    partitions_.back().info.name = partition;
  }
  return partitions_[owner];
}

bool Directory::has_room_for(const Known& partition, const Page& page) const {
  std::size_t items = items_of_all(page);
  for (const Known& one : partitions_) {
    items += one.items + one.awaited.size();
    for (const auto* aside : {&one.successor, &one.silenced}) items += *aside ? (*aside)->items : 0;
  }
  if (items <= most_items_) return true;
  // The page may replace one.
  std::size_t before = 0;
  if (partition.successor && partition.successor->incarnation == page.incarnation) {
    const auto there = partition.successor->pages.find(page.number);
    if (there != partition.successor->pages.end()) before = items_of_all(there->second);
  } else if (partition.incarnation == page.incarnation) {
    const auto there = partition.pages.find(page.number);
    if (there != partition.pages.end()) before = there->second.items;
  }
  return items - before <= most_items_;
}

void Directory::refuse(const std::string& partition) {
  ++refused_;
  // There is no place where this could be noted of a partition that is not known.
  if (refused_ == 1) cut_.push_back(partition);
}

void Directory::leave_out(Known& partition, const Page& page) {
  ++refused_;
  // An earlier incarnation is replaced as a whole.
  if (page.incarnation != partition.live) return;
  auto& left_out = partition.left_out;
  if (std::exchange(partition.cut, partition.live) != partition.live) {
    left_out.clear();
    cut_.push_back(page.partition);
  }
  const bool is_known = std::count(left_out.begin(), left_out.end(), page.number) > 0;
  if (!is_known && left_out.size() < kMostLeftOut) left_out.push_back(page.number);
}

bool Directory::is_cut(std::string_view partition) const {
  const auto number = number_of(partition);
  return number && partitions_[*number].is_cut();
}

// The pages of a new incarnation, collected beside the current ones; null if the current ones need
// not be kept.
Directory::Successor* Directory::succeed(Known& partition, std::uint64_t incarnation) {
  // Only the latest process succeeds. One whose pages came late, while the partition was lost, does
  // not, and would leave the structure incomplete for ever.
  if (partition.successor && partition.successor->incarnation != partition.live) {
    partition.successor.reset();
  }
  if (partition.silenced && partition.silenced->incarnation <= partition.live) {
    auto silenced = std::exchange(partition.silenced, {});
    if (silenced->incarnation == partition.live) partition.successor = std::move(silenced);
  }
  if (incarnation == partition.incarnation) return nullptr;
  if (partition.pages.empty() && !partition.successor) {
    partition.incarnation = incarnation;
    partition.epoch = partition.awaited_epoch = 0;
    partition.page_count = 0;
    return nullptr;
  }
  if (!partition.successor || partition.successor->incarnation < incarnation) {
    partition.successor = Successor{incarnation, {}, {}, 0};
  }
  return &*partition.successor;
}

void Directory::apply(const Presence& presence, Time now) {
  if (!presence.serving && !presence.stopped) return;
  if (!has_room_for(presence.partition)) return refuse(presence.partition);
  Owner owner = kHeldHere;
  (void)known(presence.partition, owner);
  if (owner == kHeldHere) return;
  if (presence.serving) {
    // Also of one that was forgotten here: two that have forgotten each other go on as later ones.
    hear_of_itself(presence.absent);
    if (!partitions_[owner].outdated(presence.incarnation)) {
      hear_absent(owner, presence);
    }
  }
  Known& partition = partitions_[owner];
  if (presence.stopped) {
    const bool known_to_be_there = partition.info.reachable;
    if (known_to_be_there && partition.live == presence.incarnation)
      mark_absent(partition, owner, true, now);
    return;
  }
  if (drop_outdated(partition, presence.incarnation)) return;
  // An old message of a partition that has stopped since.
  if (partition.info.stopped && partition.live == presence.incarnation) return;
  // Its end was not noticed. What it had and the new one has not is removed after this.
  if (partition.told_up && *partition.told_up != presence.ticket) {
    partition.told_up.reset();
    changes_.partition_replaced(partition.info.name);
  }
  if (std::exchange(partition.live, presence.incarnation) != presence.incarnation)
    partition.to_forget_all = false;
  PartitionInfo& info = partition.info;
  const bool known_to_be_up = info.reachable && partition.announced == presence.incarnation;
  if (!known_to_be_up) ++version_;
  if (!known_to_be_up || !partition.told_up) {
    changes_.partition_up(info.name, presence.host, presence.pid);
  }
  partition.told_up = presence.ticket;
  if (Successor* successor = succeed(partition, presence.incarnation)) {
    successor->page_count = presence.pages;
    replace_if_complete(partition, owner);
  } else {
    partition.page_count = presence.pages;
  }
  partition.announced = presence.incarnation;
  info.host = presence.host;
  info.pid = presence.pid;
  info.program = presence.program;
  info.protocol = presence.protocol;
  info.clock = clock_of(presence);
  if (!info.reachable || info.since == Time{}) info.since = now;
  came_back(partition, owner);
  resolve_returns();
}

void Directory::apply(const Page& page) {
  if (!has_room_for(page.partition)) return refuse(page.partition);
  Owner owner = kHeldHere;
  Known& partition = known(page.partition, owner);
  if (owner == kHeldHere) return;
  ++pages_heard_;
  // An incarnation that is being replaced still describes the partition.
  const bool current = !partition.pages.empty() && page.incarnation == partition.incarnation;
  if (!current && drop_outdated(partition, page.incarnation)) return;
  if (page.incarnation > partition.live) {
    // A participant that sends news of an incarnation is alive, even if its presence, which carries
    // the time, arrives after a page.
    ++version_;
    partition.live = page.incarnation;
    partition.to_forget_all = false;
    if (!partition.info.reachable) partition.info.since = Time{};
    came_back(partition, owner);
  }
  Successor* successor = succeed(partition, page.incarnation);
  if (!has_room_for(partition, page)) return leave_out(partition, page);
  if (auto& left_out = partition.left_out;
      page.incarnation == partition.cut && left_out.size() < kMostLeftOut) {
    left_out.erase(std::remove(left_out.begin(), left_out.end(), page.number), left_out.end());
  }
  if (successor != nullptr) {
    if (page.incarnation < successor->incarnation) return;
    Page& kept = successor->pages[page.number];
    // Of a page that was not there before, nothing is subtracted.
    if (!kept.partition.empty()) successor->items -= items_of_all(kept);
    successor->items += items_of_all(page);
    kept = page;
    replace_if_complete(partition, owner);
  } else {
    const std::vector<Tombstone> fresh = new_tombstones(partition, page.tombstones);
    Ids outdated;
    put_page(partition, owner, page, outdated);
    claims_.mend();
    report(fresh, owner);
    find_orphans(page.tombstones, owner);
  }
  resolve_returns();
}

void Directory::replace_if_complete(Known& partition, Owner owner) {
  Successor& successor = *partition.successor;
  if (!successor.page_count || successor.pages.size() < *successor.page_count) return;
  PageMap pages = std::move(successor.pages);
  std::vector<Tombstone> fresh;
  for (const auto& [number, page] : pages) {
    for (Tombstone& tombstone : new_tombstones(partition, page.tombstones))
      fresh.push_back(std::move(tombstone));
  }
  std::optional<Successor> later;
  if (successor.incarnation < partition.incarnation) later = structure_in_force(partition, owner);
  partition.incarnation = successor.incarnation;
  partition.page_count = *successor.page_count;
  partition.epoch = partition.awaited_epoch = 0;
  partition.successor.reset();
  Ids stays;
  for (const auto& [number, page] : pages) {
    put_removals(page, owner);
    for (const PageEntry& entry : page.entries) stays.insert(entry.id);
  }
  for (auto& [number, page] : partition.pages) {
    unclaim_all_but(stays, partition, owner, number);
    replace_joints(page, {}, owner);
  }
  const auto before = std::exchange(partition.pages, {});
  partition.items = 0;
  // The first claim to each frame now replaces that of the previous incarnation, whichever is
  // younger.
  for (const auto& [number, page] : pages) put_page(partition, owner, page, stays);
  for (const auto& [number, page] : before) {
    const auto now = partition.pages.find(number);
    erase_removals(page.tombstones,
                   now != partition.pages.end() ? now->second.tombstones : std::vector<Tombstone>(),
                   owner, number);
  }
  if (later) keep_for_return(partition, std::move(*later));
  ++version_;
  claims_.mend();
  report(fresh, owner);
  for (const auto& [number, page] : pages) find_orphans(page.tombstones, owner);
}

// @param outdated  frames claimed by an earlier incarnation; frames of the page are removed from it
void Directory::put_page(Known& partition, Owner owner, const Page& page, Ids& outdated) {
  Ids stays;
  for (const PageEntry& entry : page.entries) stays.insert(entry.id);
  // In an order in which no claim comes into force that the page as a whole ends.
  put_removals(page, owner);
  unclaim_all_but(stays, partition, owner, page.number);
  KeptPage& kept = partition.pages[page.number];
  partition.items -= std::exchange(kept.items, items_of(page));
  partition.items += kept.items;
  kept.ids.clear();
  for (const PageEntry& entry : page.entries) {
    saw_lamport_time(entry.lamport_time);
    const auto counts = outdated.erase(entry.id) != 0 ? FrameClaims::Counts::kThis
                                                      : FrameClaims::Counts::kTheYounger;
    const bool fresh =
        claims_.claim(entry.id, {owner, entry.parent, entry.lamport_time, page.number}, counts);
    partition.info.frames += fresh ? 1 : 0;
    kept.ids += static_cast<char>(entry.id.size());
    kept.ids += entry.id;
  }
  kept.ids.shrink_to_fit();
  erase_removals(std::exchange(kept.tombstones, page.tombstones), page.tombstones, owner,
                 page.number);
  replace_joints(kept, page.joints, owner);
  kept.epoch = page.epoch;
  note_epoch(partition, page);
}

// A page that was replaced before its delivery arrives after those that were published later. Of
// pages with one epoch, one lists all that have to be there.
void Directory::note_epoch(Known& partition, const Page& page) {
  const bool lists_all =
      page.epoch == partition.awaited_epoch && page.others.size() >= partition.awaited.size();
  if (page.epoch > partition.awaited_epoch || lists_all) {
    partition.awaited_epoch = page.epoch;
    partition.awaited = page.others;
  }
  const bool all_there =
      partition.pages.size() >= partition.page_count && !partition.is_cut() &&
      std::all_of(partition.awaited.begin(), partition.awaited.end(), [&](const PageEpoch& one) {
        const auto there = partition.pages.find(one.number);
        return there != partition.pages.end() && there->second.epoch >= one.epoch;
      });
  if (all_there) partition.epoch = std::max(partition.epoch, partition.awaited_epoch);
}

// If a frame has changed its page, the other page claims it by now, since pages come in order.
void Directory::unclaim_all_but(const Ids& stays, Known& partition, Owner owner,
                                std::uint32_t number) {
  const auto there = partition.pages.find(number);
  if (there == partition.pages.end()) return;
  for_each_id(there->second.ids, [&](std::string_view id) {
    if (stays.count(id) != 0) return;
    if (claims_.unclaim(std::string(id), owner, number)) --partition.info.frames;
  });
}

// As it was published.
Directory::Successor Directory::structure_in_force(const Known& partition, Owner owner) {
  Successor structure{partition.incarnation, {}, {}, 0};
  for (const auto& [number, kept] : partition.pages) {
    Page page{partition.info.name, number, structure.incarnation, kept.epoch, {}, kept.tombstones};
    for_each_id(kept.ids, [&, number = number](std::string_view id) {
      const auto claim = claims_.claim_of(std::string(id), owner);
      if (!claim || claim->page != number) return;
      page.entries.push_back({std::string(id), claim->parent, claim->lamport_time});
    });
    if (kept.epoch == partition.awaited_epoch) page.others = partition.awaited;
    page.joints = kept.joints;
    structure.items += items_of_all(page);
    structure.pages.emplace(number, std::move(page));
  }
  return structure;
}

void Directory::saw_lamport_time(std::uint64_t time) {
  latest_lamport_time_ = std::max(latest_lamport_time_, std::min(time, kLastCounter));
}

std::uint64_t Directory::next_lamport_time(Time now) {
  const auto nanoseconds = now.time_since_epoch().count();
  const auto clock = nanoseconds > 0 ? static_cast<std::uint64_t>(nanoseconds) : 0;
  const auto on_grid = [](std::uint64_t time) { return time - time % kLamportGrid; };
  latest_lamport_time_ =
      std::max(on_grid(clock + kLamportGrid - 1),
               on_grid(std::min(latest_lamport_time_, kLastCounter - kLamportGrid)) + kLamportGrid);
  return latest_lamport_time_;
}

std::optional<Owner> Directory::owner(std::string_view partition) const {
  const auto number = number_of(partition);
  const bool hidden = number && *number != kHeldHere && !partitions_[*number].listed();
  return hidden ? std::nullopt : number;
}

std::optional<Owner> Directory::number_of(std::string_view partition) const {
  const auto entry = owners_.find(std::string(partition));
  if (entry == owners_.end()) return std::nullopt;
  return entry->second;
}

Owner Directory::refer_to(const std::string& partition) {
  Owner owner = kHeldHere;
  (void)known(partition, owner);
  return owner;
}

const std::string* Directory::incomplete() const {
  if (without_pages_) return nullptr;
  const auto found = std::find_if(
      partitions_.begin(), partitions_.end(),
      [](const Known& partition) { return partition.info.reachable && !partition.complete(); });
  return found != partitions_.end() ? &found->info.name : nullptr;
}

bool Directory::note_announced_epoch(Owner owner, std::uint64_t epoch) {
  Known& partition = partitions_[owner];
  const std::uint64_t process = partition.process();
  if (partition.told_by == process && epoch <= partition.told_epoch) return false;
  partition.told_by = process;
  partition.told_epoch = epoch;
  return true;
}

std::vector<SeenEpoch> Directory::announced_epochs() const {
  std::vector<SeenEpoch> all;
  for (const Known& partition : partitions_) {
    if (partition.is_told()) all.push_back({partition.info.name, partition.told_epoch});
  }
  return all;
}

const std::string* Directory::behind() const {
  for (Owner owner = 1; owner < partitions_.size(); ++owner) {
    if (reachable(owner) && owes_change(owner)) return &partitions_[owner].info.name;
  }
  return nullptr;
}

std::vector<PartitionInfo> Directory::partitions() const {
  std::vector<PartitionInfo> all;
  if (!partitions_.front().info.name.empty()) all.push_back(partitions_.front().info);
  for (auto one = partitions_.begin() + 1; one != partitions_.end(); ++one) {
    if (!one->listed()) continue;
    all.push_back(one->info);
    const bool never_came = !one->info.reachable && one->live == 0;
    all.back().complete = without_pages_ || (!never_came && one->complete());
  }
  std::sort(all.begin(), all.end(),
            [](const PartitionInfo& a, const PartitionInfo& b) { return a.name < b.name; });
  return all;
}

}  // namespace tfdude
