#pragma once

#include "tfdude/base/time.hpp"

#include "simulation/timeline.hpp"

namespace tfdude::simulation {

/// The wall clock of a computer.
struct Clock {
  Instant ahead{};   ///< by how much, from the start or since it was set
  double drift = 0;  ///< by how much it gains [s/s]

  [[nodiscard]] Time at(Instant now) const {
    // So late that a clock may be hours behind.
    constexpr std::chrono::seconds kBeginning{1'700'000'000};
    const auto gained =
        static_cast<std::chrono::nanoseconds::rep>(drift * static_cast<double>(now.count()));
    return Time(kBeginning + now + ahead + Instant(gained));
  }
};

}  // namespace tfdude::simulation
