#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "simulation/timeline.hpp"
#include "support/memory_store.hpp"

namespace tfdude::simulation {

/// The stored state of a daemon, which outlives its process, and whether there is room for more.
/// The changes since the last checkpoint are in a journal: a power loss leaves a prefix of them.
class Disk {
 public:
  /// @param sync  each change is synced
  explicit Disk(bool sync) : sync_(sync) {}

  void set_full(bool full) { full_ = full; }
  [[nodiscard]] bool full() const { return full_; }

  [[nodiscard]] StoredState load() { return *store_.load(); }
  /// The epoch of the stored structure.
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }

  /// @return kState: it is full
  [[nodiscard]] Result<void> save(const StateChange& rows, Instant now);
  /// All changes so far survive a power loss.
  void checkpoint();

  /// Keeps a prefix of the changes that are not synced.
  /// @return the time of the first one that is lost
  std::optional<Instant> lose_power(testing::Random& random);

 private:
  struct Change {
    Instant when{};
    std::function<void(Disk&)> apply;
  };
  void put(Instant now, std::function<void(Disk&)> apply);

  const bool sync_;
  bool full_ = false;
  testing::MemoryStore store_;
  std::uint64_t epoch_ = 0;
  // As of the last checkpoint.
  testing::MemoryStore synced_;
  std::uint64_t synced_epoch_ = 0;
  std::vector<Change> journal_;
};

}  // namespace tfdude::simulation
