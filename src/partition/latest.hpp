#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "tfdude/base/time.hpp"

#include "tree/forest.hpp"

// Finds the newest instant for which all partitions on a path have data, in one round trip.
//
// Each owner answers for its own newest instant and, if it has data, for an instant that the caller
// predicts. The latest common time T is the oldest of the newest ones. If all answers include T,
// they are used. Otherwise those at the prediction are used, if all have it and it is at most two
// periods of the slowest edge, and kOldestGuess, older than T. Otherwise all are asked again, for
// T.
namespace tfdude {

/// How much older than the latest common time an answer at a predicted instant may be, so that what
/// changes now and then is not answered from long ago: two samples at 100 Hz.
inline constexpr std::chrono::milliseconds kOldestGuess{20};

/// The result of combining the answers of a path's owners.
struct OneInstant {
  std::vector<SegmentValues> answers;  ///< all for one instant; empty: none yet
  std::optional<Time> ask_again;       ///< the instant to ask for
};

/// Looks for one instant in the answers to a lookup of the newest.
/// @param hint  the prediction sent with it
[[nodiscard]] OneInstant one_instant(std::vector<SegmentValues> answers, std::optional<Time> hint);

/// Predicts the instant for the next lookup of a path from the last one, assuming samples that keep
/// their rate. Wherever the two lookups lie between two samples of an owner, its newest one is at
/// most one period older than predicted. No prediction is before the latest common time that was
/// seen last: that has all data, and so no lookup goes back behind an earlier one. Not thread-safe.
class LatestHints {
 public:
  using Steady = std::chrono::steady_clock::time_point;

  /// Empty if the path's partitions keep having the same newest instant, or were not asked yet.
  [[nodiscard]] std::optional<Time> guess(std::string_view a, std::string_view b, Steady now) const;

  /// Records the newest instants of the owners.
  /// @param planned  when the lookup was begun: its answers may be older than those of others that
  ///   have ended since
  void note(std::string_view a, std::string_view b, Steady planned, Steady now,
            const std::vector<SegmentValues>& answers);

 private:
  struct Entry {
    std::size_t path = 0;         // hash
    std::optional<Time> certain;  // the instant that all have had at most one period later
    Time latest{};                // the latest common time then
    Steady seen;
    int together = 0;  // consecutive times that all had the same newest instant
  };

  static constexpr int kStreak = 8;
  static constexpr std::size_t kEntries = 256;
  std::array<Entry, kEntries> entries_{};  // by hash; the newer of two replaces the other
};

}  // namespace tfdude
