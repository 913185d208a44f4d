#pragma once

#include <algorithm>
#include <cstdint>

#include "tfdude/base/time.hpp"

#include "partition/counters.hpp"

namespace tfdude {

/// Numbers the successive processes that serve one partition. A number is greater than all known
/// ones, whatever the clock says; without known ones the clock gives the order. The low bits are
/// random, so that two processes that start at once with the same knowledge get different numbers.
/// Not thread-safe.
class IncarnationSource {
 public:
  /// Numbers from here on are invalid; received ones may be wrong.
  static constexpr std::uint64_t kEnd = kLastIncarnation + 1;

  /// Number of random low bits; the others count milliseconds, approximately.
  static constexpr unsigned kRandomBits = 20;

  /// Records an incarnation, or an epoch that started with one.
  void saw(std::uint64_t incarnation) {
    if (incarnation < kEnd && incarnation > latest_) latest_ = incarnation;
  }

  /// At the end of the range, only the random bits are new.
  /// @param random  any number, different for each process
  [[nodiscard]] std::uint64_t next(Time clock, std::uint64_t random) const {
    const auto nanoseconds = clock.time_since_epoch().count();
    const std::uint64_t time = nanoseconds > 0 ? static_cast<std::uint64_t>(nanoseconds) : 0;
    const std::uint64_t past = time > latest_ ? time : latest_;
    constexpr std::uint64_t kStep = 1ULL << kRandomBits;
    const std::uint64_t next = std::min(past / kStep + 1, kLastIncarnation / kStep - 1);
    return next * kStep + random % kStep;
  }

 private:
  std::uint64_t latest_ = 0;
};

}  // namespace tfdude
