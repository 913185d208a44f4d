#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "base/mutex.hpp"
#include "tree/remote_forest.hpp"

namespace tfdude {

/// The edges of others that a forest reads in the memory of their owners, by their slots in this
/// forest. It has the structure of all frames, and each edge is bound to its place in the memory of
/// its owner. Both places tell whether the edge has become another one since.
/// @par Thread safety  All functions are thread-safe. find() takes no lock, and needs an
///   epoch::Guard for as long as what it has found is used.
class RemoteEdges {
 public:
  /// An edge that is bound.
  struct Binding {
    Owner owner = kHeldHere;
    std::uint32_t attachment = 0;  // of this forest's edge
    const RemoteForest* forest = nullptr;
    std::size_t index = 0;  // of the forest, below kMostOwners
    RemotePlace place{};
  };
  /// Of those that are attached at the same time.
  static constexpr std::size_t kMostOwners = 256;

  RemoteEdges() = default;
  ~RemoteEdges();
  RemoteEdges(const RemoteEdges&) = delete;
  RemoteEdges& operator=(const RemoteEdges&) = delete;

  /// Whether the memory of any owner is attached.
  [[nodiscard]] bool any() const { return attached_.load(std::memory_order_relaxed) > 0; }

  /// Whether anybody has read since this was asked last.
  [[nodiscard]] bool take_used() { return used_.exchange(false, std::memory_order_relaxed); }
  void note_used() const {
    if (!used_.load(std::memory_order_relaxed)) used_.store(true, std::memory_order_relaxed);
  }

  /// Null: not bound.
  [[nodiscard]] const Binding* find(const Version& edge) const {
    const std::atomic<const Binding*>* cell = cell_of(edge.slot);
    const Binding* found = cell != nullptr ? cell->load(std::memory_order_acquire) : nullptr;
    const bool same =
        found != nullptr && found->attachment == edge.attachment && found->owner == edge.owner;
    return same ? found : nullptr;
  }

  /// Lets the memory of an owner be read, unless that of too many is.
  /// @param memory  is kept until nobody reads it any more
  void attach(Owner owner, const RemoteForest& forest, std::shared_ptr<const void> memory);
  /// From now on, its edges are not bound.
  void detach(Owner owner);

  /// Binds an edge, to the one of now or a later one than before.
  /// @param former  also if its owner has made it another one since; see RemoteReading::go_back()
  /// @return whether it could be found
  bool bind(const Version& edge, std::string_view id, std::string_view parent, bool former = false);

 private:
  static constexpr int kSegments = 22;
  using Cell = std::atomic<const Binding*>;

  struct Attached {
    std::unique_ptr<const RemoteForest> forest;
    std::shared_ptr<const void> memory;
    std::size_t index = 0;
  };
  // What nobody may use any more, once all readers have left.
  struct Retired {
    std::uint64_t tag;
    std::unique_ptr<const Binding> binding;
    Attached attached;
  };

  // As in SlotArray; null: no such segment.
  [[nodiscard]] Cell* cell_of(std::uint32_t slot) const {
    const std::uint32_t biased = slot + SlotArray::kFirst;
    const auto segment =
        static_cast<std::size_t>(31 - __builtin_clz(biased) - SlotArray::kFirstBits);
    Cell* cells = segments_[segment].load(std::memory_order_acquire);
    return cells != nullptr ? cells + (biased - (SlotArray::kFirst << segment)) : nullptr;
  }
  [[nodiscard]] Cell& make_cell(std::uint32_t slot) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] std::vector<Retired> unlink(Owner owner) TFDUDE_REQUIRES(mutex_);
  // What can be deleted now, of these and earlier ones: without the lock, as the memory of others
  // may take another one when it is released.
  [[nodiscard]] std::vector<Retired> retire(std::vector<Retired> unlinked) TFDUDE_REQUIRES(mutex_);

  mutable Mutex mutex_;
  std::array<std::atomic<Cell*>, kSegments> segments_{};
  std::atomic<std::size_t> attached_{0};
  mutable std::atomic<bool> used_{false};
  std::map<Owner, Attached> owners_ TFDUDE_GUARDED_BY(mutex_);
  std::vector<Retired> retired_ TFDUDE_GUARDED_BY(mutex_);
};

/// What one lookup reads of others: each of them at one commit.
class RemoteReading {
 public:
  static constexpr bool kNone = false;

  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): `taken_` says which owners are written
  explicit RemoteReading(const RemoteEdges& edges) : edges_(edges) {}

  /// The edge; without a version if it cannot be read. Its commit is taken with the first edge of
  /// its owner.
  [[nodiscard]] RemoteEdge find(const Version& here) {
    const RemoteEdges::Binding* binding = edges_.find(here);
    if (binding == nullptr) return {};
    const RemoteForest* forest = binding->forest;
    if (!has(binding->index)) take_up(binding->index, *forest);
    const Snapshot& of = owners_[binding->index];
    // The place of one that was detached meanwhile may be that of another one.
    if (of.forest != forest) return {};
    return {forest->at(binding->place, of.commit), forest, &common_errors_left_};
  }

  /// Reads the owner of this edge at the last commit at which the edge was the one that is known
  /// here, if that is not the newest.
  void go_back(const Version& here) {
    const RemoteEdges::Binding* binding = edges_.find(here);
    if (binding == nullptr) return;
    if (!has(binding->index)) take_up(binding->index, *binding->forest);
    Snapshot& of = owners_[binding->index];
    if (of.forest == binding->forest) {
      of.commit = binding->forest->last_commit_of(binding->place, of.commit);
    }
  }

  /// Whether nothing that was found since clear() was overwritten.
  [[nodiscard]] bool intact() const {
    for (std::size_t word = 0; word < taken_.size(); ++word) {
      for (std::uint64_t left = taken_[word]; left != 0; left &= left - 1) {
        const Snapshot& of = owners_[64 * word + static_cast<std::size_t>(__builtin_ctzll(left))];
        if (!of.forest->intact(of.commit)) return false;
      }
    }
    return true;
  }
  void clear() {
    taken_ = {};
    used_ = false;
    begin_walk();
  }
  /// What is read from now on is added up by itself.
  void begin_walk() { common_errors_left_ = kMostCommonErrors; }
  /// Whether anything was found since then.
  [[nodiscard]] bool used() const { return used_; }
  /// At which commit the owner was read; 0: none was, or several.
  [[nodiscard]] std::uint64_t commit() const {
    std::uint64_t commit = 0;
    for (std::size_t word = 0; word < taken_.size(); ++word) {
      for (std::uint64_t left = taken_[word]; left != 0; left &= left - 1) {
        if (commit != 0) return 0;
        commit = owners_[64 * word + static_cast<std::size_t>(__builtin_ctzll(left))].commit;
      }
    }
    return commit;
  }

 private:
  // Of all edges of a walk together, as the time to add them up is that of their square.
  static constexpr std::size_t kMostCommonErrors = 1024;

  struct Snapshot {
    const RemoteForest* forest;
    std::uint64_t commit;
  };

  [[nodiscard]] bool has(std::size_t index) const {
    return (taken_[index / 64] >> (index % 64) & 1U) != 0;
  }
  void take_up(std::size_t index, const RemoteForest& forest) {
    edges_.note_used();
    used_ = true;
    taken_[index / 64] |= std::uint64_t{1} << (index % 64);
    owners_[index] = {&forest, forest.snapshot()};
  }

  const RemoteEdges& edges_;
  bool used_ = false;
  std::size_t common_errors_left_ = kMostCommonErrors;
  std::array<std::uint64_t, RemoteEdges::kMostOwners / 64> taken_{};
  // Those that are taken are set.
  std::array<Snapshot, RemoteEdges::kMostOwners> owners_;  // NOLINT(*-member-init): see above
};

}  // namespace tfdude
