#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>

#include "tfdude/math/transform.hpp"

#include "tree/arena.hpp"
#include "tree/epoch.hpp"
#include "tree/forest.hpp"
#include "tree/id_table.hpp"
#include "tree/sample_history.hpp"
#include "tree/shared_correlation.hpp"

namespace tfdude {

inline constexpr std::uint32_t kNoSlot = 0xFFFFFFFF;

struct Version;

/// Points to a slot's newest version; never moves.
using Head = std::atomic<Version*>;

/// The state of the frame in one slot, as of one commit. Immutable once its commit is visible.
struct Version {
  std::uint64_t commit = 0;
  Version* older = nullptr;
  const Name* name = nullptr;   // null: the slot has no id
  const Head* above = nullptr;  // of the slot `parent`, so that a climb needs no lookup
  std::uint32_t parent = kNoSlot;
  std::int32_t depth = kAbsent;  // parent's depth + 1; 0 without a parent or if it is absent
  Owner owner = kHeldHere;
  std::uint32_t slot = kNoSlot;
  // Identifies the frame: a new number whenever one appears, even under the same name.
  std::uint32_t generation = 0;
  // Identifies the edge: a new number whenever the frame appears, gets another parent, or another
  // owner. 0: there is none.
  std::uint32_t attachment = 0;

  /// The depth of a slot that others name as their parent, while that frame does not exist.
  static constexpr std::int32_t kAbsent = -1;

  [[nodiscard]] bool present() const { return depth != kAbsent; }
  /// Whether this is a HeldVersion.
  [[nodiscard]] bool held() const { return present() && owner == kHeldHere; }
};

/// A version of an edge whose value is held here. The fields are ordered for lookups: a climb needs
/// the first two cache lines, which end with the pose, and then the covariance.
struct alignas(64) HeldVersion : Version {
  std::int64_t stamp = kAlways;            // of the newest sample
  EdgeCorrelation* correlation = nullptr;  // null: independent
  Transform X_PC;
  std::uint64_t number = 0;          // of the newest sample in the history
  SampleHistory* samples = nullptr;  // null: no history and no timing of its own
  // The commit with which its values began; earlier values belong to another edge.
  std::uint64_t history = 0;

  [[nodiscard]] bool moving() const { return stamp != kAlways; }
  /// Whether it has no value at any instant: it had no sample yet, or its history was cleared.
  [[nodiscard]] bool lacks_sample() const { return stamp == kNoSample || unsampled(); }
  /// Whether it is dynamic, and had no sample yet.
  [[nodiscard]] bool unsampled() const { return stamp == kUnsampled; }
  /// Whether its stamp limits the latest common time.
  [[nodiscard]] bool limits() const { return stamp > kUnsampled; }
  /// Whether its only sample is the last one of an earlier process.
  [[nodiscard]] bool left_behind() const { return samples != nullptr && samples->left_behind; }
};

/// The newest version of each slot. Grows without moving memory that readers access: segment k
/// holds 1024 · 2^k slots.
class SlotArray {
 public:
  static constexpr int kFirstBits = 10;
  static constexpr std::uint32_t kFirst = 1U << kFirstBits;

  explicit SlotArray(Arena& arena) : arena_(arena), segments_(arena.roots().heads) {}
  ~SlotArray() {
    for (std::size_t k = 0; k < segments_.size(); ++k) {
      void* heads = segments_[k].load(std::memory_order_relaxed);
      if (heads != nullptr) arena_.release(heads, sizeof(Head) * (std::size_t{kFirst} << k));
    }
  }
  SlotArray(const SlotArray&) = delete;
  SlotArray& operator=(const SlotArray&) = delete;

  [[nodiscard]] Head& operator[](std::uint32_t slot) const {
    const std::uint32_t biased = slot + kFirst;
    const int segment = 31 - __builtin_clz(biased) - kFirstBits;
    auto* heads = static_cast<Head*>(
        segments_[static_cast<std::size_t>(segment)].load(std::memory_order_acquire));
    return heads[biased - (kFirst << segment)];
  }

  [[nodiscard]] std::uint32_t size() const { return size_.load(std::memory_order_acquire); }

  /// Appends a slot with its first version; one writer at a time.
  std::uint32_t append(Version* first) {
    const std::uint32_t slot = size_.load(std::memory_order_relaxed);
    const std::uint32_t biased = slot + kFirst;
    const int segment = 31 - __builtin_clz(biased) - kFirstBits;
    auto& memory = segments_[static_cast<std::size_t>(segment)];
    if (memory.load(std::memory_order_relaxed) == nullptr) {
      const std::size_t count = std::size_t{kFirst} << static_cast<unsigned>(segment);
      auto* heads = static_cast<Head*>(arena_.allocate(sizeof(Head) * count));
      std::uninitialized_value_construct_n(heads, count);
      memory.store(heads, std::memory_order_release);
    }
    first->slot = slot;
    (*this)[slot].store(first, std::memory_order_release);
    size_.store(slot + 1, std::memory_order_release);
    return slot;
  }

 private:
  Arena& arena_;
  std::array<std::atomic<void*>, SharedRoots::kMostHeads>& segments_;
  std::atomic<std::uint32_t> size_{0};
};

}  // namespace tfdude
