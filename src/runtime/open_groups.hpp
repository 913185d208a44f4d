#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

namespace tfdude {

/// The groups of values that are pushed here. One that no watched path needs any more stays open for a while: a path that
/// goes back and forth between two owners then finds its reader matched, and discovery has nothing to do. Not thread-safe.
class OpenGroups {
 public:
  using Clock = std::chrono::steady_clock;

  /// How long an unused group stays open; the owner stops pushing to it before (kWatchLease).
  static constexpr std::chrono::seconds kKept{10};
  /// How many unused groups stay open.
  static constexpr std::size_t kMostUnused = 8;

  [[nodiscard]] bool contains(std::uint64_t group) const { return last_used_.count(group) > 0; }

  void insert(std::uint64_t group, Clock::time_point now) { last_used_[group] = now; }

  /// Removes the groups that are to be closed.
  /// @param used  by watched paths
  /// @return those unused for kKept, and those longest unused beyond kMostUnused
  [[nodiscard]] std::vector<std::uint64_t> take_unused(const std::set<std::uint64_t>& used,
                                                       Clock::time_point now);

 private:
  std::map<std::uint64_t, Clock::time_point> last_used_;
};

}  // namespace tfdude
