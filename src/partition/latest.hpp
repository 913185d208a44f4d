#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "tfdude/base/time.hpp"

#include "tree/forest.hpp"

// The newest instant of which all partitions on a path have data, and how it is found in one round trip.
//
// Each owner answers of its own newest instant and, where it has it, of the one that the caller guesses. The newest
// common instant T is the oldest of these. Where all answered of T, that is the answer. Else it is that of the guess, if
// all had it and it is no older than T by two periods of the slowest edge. Else all are asked once more, of T.
namespace tfdude {

/// What the answers of a path's owners come to.
struct OneInstant {
  std::vector<SegmentValues> answers;  ///< all of one instant; empty: there is none yet
  std::optional<Time> ask_again;       ///< of this
};

/// Looks for one instant in the answers to a lookup of the newest.
/// @param hint  the guess that was sent with it
[[nodiscard]] OneInstant one_instant(std::vector<SegmentValues> answers, std::optional<Time> hint);

/// Guesses for the next lookup of a path, from the last: samples go on coming as they did, and whichever way the two
/// lookups lie between two samples of an owner, its newest is at most a period older than that would make it. Not
/// thread-safe.
class LatestHints {
 public:
  using Steady = std::chrono::steady_clock::time_point;

  /// Nothing where the path's partitions have the same newest instant time after time, or were not asked yet.
  [[nodiscard]] std::optional<Time> guess(std::string_view a, std::string_view b, Steady now) const;

  /// Takes note of what the owners said of their newest.
  void note(std::string_view a, std::string_view b, Steady now,
            const std::vector<SegmentValues>& answers);

 private:
  struct Entry {
    std::size_t path = 0;         // hash
    std::optional<Time> certain;  // what all have had a period later, at the latest
    Steady seen;
    int together = 0;  // how many times in a row all had the same newest
  };

  static constexpr int kStreak = 8;
  static constexpr std::size_t kEntries = 256;
  std::array<Entry, kEntries> entries_{};  // by hash; the later of two takes the place
};

}  // namespace tfdude
