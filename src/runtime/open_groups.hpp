#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

namespace tfdude {

/// The groups of values that are pushed here. A group that no watched path needs stays open for a
/// while: if a path alternates between two owners, its reader is then still matched, and no
/// discovery is needed. Not thread-safe.
class OpenGroups {
 public:
  using Clock = std::chrono::steady_clock;

  /// How long an unused group stays open; the owner stops pushing to it earlier (kWatchLease).
  static constexpr std::chrono::seconds kKept{10};
  /// Maximum number of unused groups that stay open.
  static constexpr std::size_t kMostUnused = 8;

  [[nodiscard]] bool contains(std::uint64_t group) const { return last_used_.count(group) > 0; }

  [[nodiscard]] bool empty() const { return last_used_.empty(); }

  void insert(std::uint64_t group, Clock::time_point now) { last_used_[group] = now; }

  /// Removes the groups that must be closed.
  /// @param used  groups of watched paths
  /// @return those unused for kKept, and the longest unused ones beyond kMostUnused
  [[nodiscard]] std::vector<std::uint64_t> take_unused(const std::set<std::uint64_t>& used,
                                                       Clock::time_point now);

 private:
  std::map<std::uint64_t, Clock::time_point> last_used_;
};

}  // namespace tfdude
