#pragma once

#include <atomic>
#include <cstdint>
#include <string_view>
#include <vector>

#include "tree/arena.hpp"

namespace tfdude {

/// Counts of samples that an edge rejected.
struct Refused {
  std::atomic<std::uint64_t> old{0};    ///< older than the kept history
  std::atomic<std::uint64_t> equal{0};  ///< the stamp of another sample
  std::atomic<std::uint64_t> ahead{0};  ///< too far ahead of the clock

  /// Consecutive samples older than the span, while `newest` is the newest sample; for writers
  /// only.
  struct Behind {
    std::uint64_t count = 0;
    std::int64_t newest = 0;
    std::int64_t last = 0;
  } behind;
};

/// The counts of an edge. They are allocated with its first rejected sample, as most have none.
class RefusedSamples {
 public:
  RefusedSamples() = default;
  ~RefusedSamples() { delete own(); }
  RefusedSamples(const RefusedSamples&) = delete;
  RefusedSamples& operator=(const RefusedSamples&) = delete;

  /// Null: none was rejected.
  [[nodiscard]] const Refused* counts() const {
    return Veiled<Refused>::veiled_pointer(counts_.load(std::memory_order_acquire));
  }

  /// To count one; for writers only.
  [[nodiscard]] Refused& more() {
    Refused* counts = own();
    if (counts == nullptr) {
      counts = new Refused;
      counts_.store(Veiled<Refused>::veiled(counts), std::memory_order_release);
    }
    return *counts;
  }

  /// The next sample that is too old is the first one in a row; for writers only.
  void end_row() {
    if (Refused* counts = own()) counts->behind = {};
  }

 private:
  [[nodiscard]] Refused* own() const {
    return Veiled<Refused>::veiled_pointer(counts_.load(std::memory_order_relaxed));
  }

  std::atomic<std::uintptr_t> counts_{0};
};

/// An interned id and its slot. Immutable once in the table, except for `lamport_time` and
/// `refused`.
struct Name {
  Name() = default;
  Name(std::string_view id, std::uint32_t hashed, std::uint32_t number)
      : text(id), hash(hashed), slot(number) {}

  /// With its text behind it.
  [[nodiscard]] static const Name* create(Arena& arena, std::string_view id, std::uint32_t hashed,
                                          std::uint32_t number);
  static void destroy(Arena& arena, const Name* name);

  std::string_view text;
  std::uint32_t hash = 0;
  std::uint32_t slot = 0;
  /// When the frame got its parent. That of the newest commit, whichever a reader sees.
  mutable std::atomic<std::uint64_t> lamport_time{0};
  mutable RefusedSamples refused;

  void hung(std::uint64_t when) const { lamport_time.store(when, std::memory_order_relaxed); }
};

/// Maps an id to its Name, by open addressing. Readers need an epoch::Guard but no lock; one writer
/// at a time. Entries that a change makes unreachable wait in limbo until no reader can see them.
class IdTable {
 public:
  explicit IdTable(Arena& arena);
  ~IdTable();
  IdTable(const IdTable&) = delete;
  IdTable& operator=(const IdTable&) = delete;

  [[nodiscard]] const Name* find(std::string_view id) const;

  /// The id must not be in the table.
  const Name* insert(std::string_view id, std::uint32_t slot);

  /// The name must be in the table.
  void erase(const Name* name);

  /// Gives the tag (epoch::retire_tag) to everything erased since the last call, and frees what has
  /// a tag below safe_below.
  void collect(std::uint64_t tag, std::uint64_t safe_below);

  /// The hash of an id in Name.
  [[nodiscard]] static std::uint32_t hash_of(std::string_view id);

  /// With its cells behind it.
  struct Table {
    using Cell = std::atomic<const Name*>;

    [[nodiscard]] std::size_t size() const { return mask + 1; }
    [[nodiscard]] Cell* cells() {
      return reinterpret_cast<Cell*>(this + 1);  // NOLINT(*-reinterpret-cast): see above
    }

    std::uint64_t mask = 0;
  };

 private:
  // Erased, and waiting until no reader can see it; one of both.
  struct Limbo {
    std::uint64_t tag;
    const Name* name;
    Table* table;
  };

  [[nodiscard]] Table* table() const {
    return static_cast<Table*>(table_.load(std::memory_order_acquire));
  }
  [[nodiscard]] Table* new_table(std::size_t capacity);
  void destroy(const Limbo& one);
  void grow();
  /// @return whether it took a cell that was never used
  bool place(Table& table, const Name* name) const;

  Arena& arena_;
  std::atomic<void*>& table_;
  // Replaces an erased name, so that probing continues past it.
  const Name* const tombstone_;
  std::size_t names_ = 0;
  std::size_t used_ = 0;  // names and tombstones
  std::vector<Limbo> limbo_;
  std::size_t tagged_ = 0;  // number of tagged entries at the front of limbo_
};

}  // namespace tfdude
