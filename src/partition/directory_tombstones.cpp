#include <algorithm>
#include <iterator>
#include <utility>

#include "partition/directory.hpp"

// What the tombstones of all partitions say.
namespace tfdude {
namespace {

bool removes(const Tombstone& tombstone) {
  return tombstone.kind == Tombstone::Kind::kRemoved || tombstone.kind == Tombstone::Kind::kDropped;
}

FrameRemoval removal_of(const Tombstone& tombstone, Owner owner, std::uint32_t page) {
  return {owner, tombstone.lamport_time, page, tombstone.kind == Tombstone::Kind::kRemoved};
}

}  // namespace

void Directory::put_removals(const Page& page, Owner owner) {
  for (const Tombstone& one : page.tombstones) {
    if (removes(one)) claims_.removed(one.id, removal_of(one, owner, page.number));
  }
}

// Of a page that is replaced.
void Directory::erase_removals(const std::vector<Tombstone>& before,
                               const std::vector<Tombstone>& now, Owner owner,
                               std::uint32_t number) {
  for (const Tombstone& one : before) {
    const bool stays = std::any_of(now.begin(), now.end(), [&](const Tombstone& other) {
      return other.id == one.id && removes(other);
    });
    if (!stays) claims_.forget_removal(one.id, owner, number);
  }
}

void Directory::note_own(const Tombstone& tombstone) {
  if (!removes(tombstone)) return forget_own_tombstone(tombstone.id);
  claims_.removed(tombstone.id, removal_of(tombstone, kHeldHere, 0));
}

// New tombstones to report. A new participant does not report those from before its start.
std::vector<Tombstone> Directory::new_tombstones(const Known& partition,
                                                 const std::vector<Tombstone>& tombstones) {
  std::vector<Tombstone> fresh;
  if (partition.page_count == 0 || partition.pages.size() < partition.page_count) return fresh;
  for (const Tombstone& tombstone : tombstones) {
    if (tombstone.kind == Tombstone::Kind::kRemoved) continue;
    const bool known =
        std::any_of(partition.pages.begin(), partition.pages.end(), [&](const auto& page) {
          const std::vector<Tombstone>& there = page.second.tombstones;
          return std::find(there.begin(), there.end(), tombstone) != there.end();
        });
    if (!known) fresh.push_back(tombstone);
  }
  return fresh;
}

void Directory::report(const std::vector<Tombstone>& fresh, Owner owner) {
  for (const Tombstone& tombstone : fresh) {
    if (tombstone.kind == Tombstone::Kind::kDropped) {
      report_orphans(tombstone.id, owner);
    } else if (changes_.watched()) {
      changes_.add(conflict_of(tombstone, name(owner)));
    }
  }
}

// Owners concerned are informed in any case.
void Directory::report_orphans(const std::string& dropped, Owner by) {
  for (const FrameInfo& frame : forest_.waiting_for(dropped)) {
    const bool concerns = changes_.watched() || frame.owner == kHeldHere || by == kHeldHere;
    if (concerns) changes_.add(orphan_of(frame, name(frame.owner), name(by)));
  }
}

void Directory::find_orphans(const std::vector<Tombstone>& tombstones, Owner owner) {
  for (const Tombstone& tombstone : tombstones) {
    saw_lamport_time(tombstone.lamport_time);
    if (tombstone.kind != Tombstone::Kind::kRemoved) continue;
    for (const FrameInfo& frame : forest_.waiting_for(tombstone.id)) {
      if (frame.owner != kHeldHere || frame.lamport_time >= tombstone.lamport_time) continue;
      orphans_.insert({PendingYield::Kind::kRemove, frame.id, owner, frame.lamport_time,
                       tombstone.lamport_time});
    }
  }
}

void Directory::find_orphans() {
  for (Owner owner = 1; owner < partitions_.size(); ++owner) {
    for (const auto& [number, page] : partitions_[owner].pages)
      find_orphans(page.tombstones, owner);
  }
}

std::set<PendingYield> Directory::pending_yields() {
  // Orphans that were removed or moved are resolved, and those whose parent exists again.
  for (auto orphan = orphans_.begin(); orphan != orphans_.end();) {
    const auto frame = forest_.info(orphan->frame);
    const bool stands = frame && frame->owner == kHeldHere &&
                        frame->lamport_time == orphan->lamport_time &&
                        !forest_.exists(frame->parent);
    orphan = stands ? std::next(orphan) : orphans_.erase(orphan);
  }
  std::set<PendingYield> all = claims_.pending_yields();
  all.insert(orphans_.begin(), orphans_.end());
  return all;
}

}  // namespace tfdude
