#pragma once

#include <cstdint>

#include "tfdude/base/time.hpp"

namespace tfdude {

/// Numbers the processes that serve one partition one after the other. A number is greater than all that are known of,
/// whatever the clock says; where nothing is known of the past the clock keeps the order. Its low bits are random, so
/// that of two processes which start at once, knowing the same, each has its own. Not thread-safe.
class IncarnationSource {
 public:
  /// Numbers from here on are nobody's: what is heard may be wrong.
  static constexpr std::uint64_t kEnd = 1ULL << 63U;

  /// How many of the low bits are random: what is left counts milliseconds, more or less.
  static constexpr unsigned kRandomBits = 20;

  /// That there was one of this number, or a count that began with one.
  void saw(std::uint64_t incarnation) {
    if (incarnation < kEnd && incarnation > latest_) latest_ = incarnation;
  }

  /// @param random  any number, another one for each process
  [[nodiscard]] std::uint64_t next(Time clock, std::uint64_t random) const {
    const auto nanoseconds = clock.time_since_epoch().count();
    const std::uint64_t time = nanoseconds > 0 ? static_cast<std::uint64_t>(nanoseconds) : 0;
    const std::uint64_t past = time > latest_ ? time : latest_;
    constexpr std::uint64_t kStep = 1ULL << kRandomBits;
    return (past / kStep + 1) * kStep + random % kStep;
  }

 private:
  std::uint64_t latest_ = 0;
};

}  // namespace tfdude
