#include "tfdude/partition/directory.hpp"

#include <algorithm>
#include <unordered_set>
#include <utility>

namespace tfdude {

Directory::Directory(Forest& forest, std::string own) : forest_(forest), partitions_(1) {
  if (!own.empty()) owners_.emplace(own, kHeldHere);
  partitions_.front().info.name = std::move(own);
  partitions_.front().info.reachable = true;
}

Directory::Known& Directory::known(const std::string& partition, Owner& owner) {
  const auto [entry, added] = owners_.emplace(partition, static_cast<Owner>(partitions_.size()));
  owner = entry->second;
  if (added) {
    partitions_.emplace_back();
    partitions_.back().info.name = partition;
  }
  return partitions_[owner];
}

// Makes the incarnation the one in force; false if a later one is already.
bool Directory::advance(Known& partition, Owner owner, std::uint64_t incarnation) {
  if (incarnation < partition.incarnation) return false;
  if (incarnation > partition.incarnation) {
    for (const auto& [id, count] : partition.listed) unclaim(id, owner);
    partition.listed.clear();
    partition.pages.clear();
    partition.epoch = 0;
    partition.page_count = 0;
    partition.info.frames = 0;
    partition.incarnation = incarnation;
    // Whoever tells something new of an incarnation lives, even where the presence, which is handed
    // the time, comes after a page.
    if (!partition.info.reachable) partition.info.since = Time{};
    partition.info.reachable = true;
  }
  return true;
}

void Directory::apply(const Presence& presence, Time now) {
  if (!presence.serving) return;
  Owner owner = kHeldHere;
  Known& partition = known(presence.partition, owner);
  if (owner == kHeldHere || !advance(partition, owner, presence.incarnation)) return;
  mend();
  partition.page_count = presence.pages;
  PartitionInfo& info = partition.info;
  info.host = presence.host;
  info.pid = presence.pid;
  if (!info.reachable || info.since == Time{}) info.since = now;
  info.reachable = true;
}

void Directory::apply(const Page& page) {
  Owner owner = kHeldHere;
  Known& partition = known(page.partition, owner);
  if (owner == kHeldHere || !advance(partition, owner, page.incarnation)) return;
  std::unordered_set<std::string_view> stays;
  for (const PageEntry& entry : page.entries) stays.insert(entry.id);
  for (const PageEntry& entry : std::exchange(partition.pages[page.number], {})) {
    leave_page(partition, owner, entry.id, stays.count(entry.id) != 0);
  }
  for (const PageEntry& entry : page.entries) {
    ++partition.listed[entry.id];
    claim(entry, owner);
  }
  partition.pages[page.number] = page.entries;
  partition.info.frames = partition.listed.size();
  partition.epoch = std::max(partition.epoch, page.epoch);
  mend();
}

// An id is no longer where it was; unless the same page lists it again, another page or nobody has it.
void Directory::leave_page(Known& partition, Owner owner, const std::string& id, bool stays) {
  const auto listed = partition.listed.find(id);
  const bool elsewhere = --listed->second > 0;
  if (!elsewhere) partition.listed.erase(listed);
  if (stays) return;
  if (!elsewhere) {
    unclaim(id, owner);
    return;
  }
  for (const auto& [number, entries] : partition.pages) {
    for (const PageEntry& entry : entries) {
      if (entry.id == id) claim(entry, owner);
    }
  }
}

bool Directory::lost(std::string_view partition, std::uint64_t incarnation, Time now) {
  const auto number = owner(partition);
  if (!number || *number == kHeldHere) return false;
  Known& gone = partitions_[*number];
  if (gone.incarnation != incarnation || !gone.info.reachable) return false;
  gone.info.reachable = false;
  gone.info.since = now;
  return true;
}

void Directory::claim(const PageEntry& entry, Owner owner) {
  const auto there = forest_.info(entry.id);
  if (there && there->owner != owner) {
    const bool wins = there->owner != kHeldHere && name(owner) < name(there->owner);
    if (!wins) {
      shadow(entry.id, {owner, entry.parent});
      return;
    }
    const auto cut = cut_.find(entry.id);
    shadow(entry.id, cut != cut_.end() ? cut->second : Claim{there->owner, there->parent});
  }
  put(entry.id, {owner, entry.parent});
}

void Directory::unclaim(const std::string& id, Owner owner) {
  if (const auto claims = shadowed_.find(id); claims != shadowed_.end()) {
    auto& others = claims->second;
    const auto mine = std::find_if(others.begin(), others.end(),
                                   [owner](const Claim& claim) { return claim.owner == owner; });
    if (mine != others.end()) {
      others.erase(mine);
      if (others.empty()) shadowed_.erase(claims);
      return;
    }
  }
  forest_.drop_remote(id, owner);
  cut_.erase(id);
  promote(id);
}

void Directory::released(const std::string& id) {
  promote(id);
  mend();
}

void Directory::promote(const std::string& id) {
  const auto claims = shadowed_.find(id);
  if (claims == shadowed_.end()) return;
  auto& others = claims->second;
  const auto least = std::min_element(
      others.begin(), others.end(),
      [this](const Claim& a, const Claim& b) { return name(a.owner) < name(b.owner); });
  put(id, *least);
  others.erase(least);
  if (others.empty()) shadowed_.erase(claims);
}

void Directory::shadow(const std::string& id, Claim claim) {
  auto& claims = shadowed_[id];
  const auto mine = std::find_if(claims.begin(), claims.end(),
                                 [&](const Claim& c) { return c.owner == claim.owner; });
  if (mine != claims.end()) {
    *mine = std::move(claim);
  } else {
    claims.push_back(std::move(claim));
  }
}

void Directory::put(const std::string& id, const Claim& claim) {
  const auto done = forest_.put_remote(id, claim.parent, claim.owner);
  if (!done && done.error().code == Errc::kCycle) {
    cut_[id] = claim;
  } else {
    cut_.erase(id);
  }
}

// Hangs frames where they belong that could not hang there before. None, but for conflicts.
void Directory::mend() {
  for (const auto& [id, claim] : std::exchange(cut_, {})) put(id, claim);
}

std::optional<Owner> Directory::owner(std::string_view partition) const {
  const auto entry = owners_.find(std::string(partition));
  if (entry == owners_.end()) return std::nullopt;
  return entry->second;
}

bool Directory::complete() const {
  return std::all_of(partitions_.begin(), partitions_.end(), [](const Known& partition) {
    return !partition.info.reachable || partition.pages.size() >= partition.page_count;
  });
}

std::vector<PartitionInfo> Directory::partitions() const {
  std::vector<PartitionInfo> all;
  for (const Known& partition : partitions_) {
    if (!partition.info.name.empty()) all.push_back(partition.info);
  }
  std::sort(all.begin(), all.end(),
            [](const PartitionInfo& a, const PartitionInfo& b) { return a.name < b.name; });
  return all;
}

std::optional<Presence> Directory::serving(std::string_view partition) const {
  const auto number = owner(partition);
  if (!number || *number == kHeldHere || !reachable(*number)) return std::nullopt;
  const Known& there = partitions_[*number];
  return Presence{there.info.name, there.incarnation, there.info.host,
                  there.info.pid,  there.page_count,  true};
}

}  // namespace tfdude
