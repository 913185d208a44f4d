#include "tree/remote_edges.hpp"

#include <algorithm>
#include <iterator>

#include "tree/epoch.hpp"

namespace tfdude {
namespace {

std::size_t cells_in(std::size_t segment) { return std::size_t{SlotArray::kFirst} << segment; }

}  // namespace

RemoteEdges::~RemoteEdges() {
  for (std::size_t k = 0; k < segments_.size(); ++k) {
    Cell* cells = segments_[k].load(std::memory_order_relaxed);
    for (std::size_t i = 0; cells != nullptr && i < cells_in(k); ++i) {
      delete cells[i].load(std::memory_order_relaxed);
    }
    delete[] cells;
  }
}

void RemoteEdges::attach(Owner owner, const RemoteForest& forest,
                         std::shared_ptr<const void> memory) {
  std::vector<Retired> garbage;
  const Lock lock(mutex_);
  garbage = retire(unlink(owner));
  const auto is_taken = [this](std::size_t index) TFDUDE_UNCHECKED_LOCKS {
    return std::any_of(owners_.begin(), owners_.end(),
                       [index](const auto& one) { return one.second.index == index; });
  };
  std::size_t index = 0;
  while (index < kMostOwners && is_taken(index)) ++index;
  if (index == kMostOwners) return;
  owners_[owner] = {std::make_unique<const RemoteForest>(forest), std::move(memory), index};
  attached_.store(owners_.size(), std::memory_order_relaxed);
}

void RemoteEdges::detach(Owner owner) {
  std::vector<Retired> garbage;
  const Lock lock(mutex_);
  garbage = retire(unlink(owner));
}

std::vector<RemoteEdges::Retired> RemoteEdges::unlink(Owner owner) {
  std::vector<Retired> unlinked;
  const auto found = owners_.find(owner);
  if (found == owners_.end()) return unlinked;
  for (std::size_t k = 0; k < segments_.size(); ++k) {
    Cell* cells = segments_[k].load(std::memory_order_relaxed);
    for (std::size_t i = 0; cells != nullptr && i < cells_in(k); ++i) {
      const Binding* binding = cells[i].load(std::memory_order_relaxed);
      if (binding == nullptr || binding->owner != owner) continue;
      cells[i].store(nullptr, std::memory_order_seq_cst);
      unlinked.push_back({0, std::unique_ptr<const Binding>(binding), {}});
    }
  }
  unlinked.push_back({0, nullptr, std::move(found->second)});
  owners_.erase(found);
  attached_.store(owners_.size(), std::memory_order_relaxed);
  return unlinked;
}

bool RemoteEdges::bind(const Version& edge, std::string_view id, std::string_view parent,
                       bool former) {
  std::vector<Retired> garbage;
  const Lock lock(mutex_);
  const auto owner = owners_.find(edge.owner);
  if (owner == owners_.end()) return false;
  // The owner may be writing at full speed.
  constexpr int kTries = 16;
  const RemoteForest& forest = *owner->second.forest;
  std::optional<RemotePlace> place;
  bool read = false;
  for (int tries = 0; tries < kTries && !read; ++tries) {
    const std::uint64_t commit = forest.snapshot();
    place = forest.find(id, parent, commit);
    read = forest.intact(commit);
    if (read && !place && former) place = forest.find_former(id, parent, commit);
  }
  if (!read || !place) return false;
  Cell& cell = make_cell(edge.slot);
  const Binding* before = cell.load(std::memory_order_relaxed);
  // The structure here may be far behind: it has the parent of now, of long ago. What was read of
  // that is later than what comes next here.
  const bool goes_back =
      before != nullptr && before->forest == &forest && before->place.head == place->head &&
      static_cast<std::int32_t>(place->attachment - before->place.attachment) < 0;
  if (goes_back) return false;
  cell.store(new Binding{edge.owner, edge.attachment, &forest, owner->second.index, *place},
             std::memory_order_seq_cst);
  std::vector<Retired> unlinked;
  if (before != nullptr) unlinked.push_back({0, std::unique_ptr<const Binding>(before), {}});
  garbage = retire(std::move(unlinked));
  return true;
}

RemoteEdges::Cell& RemoteEdges::make_cell(std::uint32_t slot) {
  if (Cell* there = cell_of(slot)) return *there;
  const std::uint32_t biased = slot + SlotArray::kFirst;
  const auto segment = static_cast<std::size_t>(31 - __builtin_clz(biased) - SlotArray::kFirstBits);
  segments_[segment].store(new Cell[cells_in(segment)](), std::memory_order_release);
  return *cell_of(slot);
}

std::vector<RemoteEdges::Retired> RemoteEdges::retire(std::vector<Retired> unlinked) {
  if (!unlinked.empty()) {
    const std::uint64_t tag = epoch::retire_tag();
    for (Retired& one : unlinked) {
      one.tag = tag;
      retired_.push_back(std::move(one));
    }
  }
  std::vector<Retired> garbage;
  if (retired_.empty()) return garbage;
  const std::uint64_t below = epoch::safe_below();
  const auto seen = std::partition(retired_.begin(), retired_.end(),
                                   [below](const Retired& one) { return one.tag >= below; });
  garbage.assign(std::make_move_iterator(seen), std::make_move_iterator(retired_.end()));
  retired_.erase(seen, retired_.end());
  return garbage;
}

}  // namespace tfdude
