#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>

#include "simulation/timeline.hpp"

namespace tfdude::simulation {

/// What is left of the run of a seed.
struct Remains {
  std::uint64_t seed = 0;
  std::set<std::size_t> without;   ///< decisions and operations, by their numbers
  Instant storm = Instant::max();  ///< the maximum duration of the phase with faults

  /// As options of scripts/simulate.
  [[nodiscard]] std::string options() const;
};

/// The rule that a run breaks first, or that it is not deterministic; empty: it does not fail. Runs
/// it twice, except if the rule to look for is given and it is broken.
[[nodiscard]] std::string failure_of(const Remains& remains);

/// A run that fails in the same way, with fewer decisions and operations, and shorter.
[[nodiscard]] Remains shrink(const Remains& failing);

/// "0-3,7" as a set of numbers; empty if it is none.
[[nodiscard]] std::set<std::size_t> numbers_of(const std::string& ranges);

}  // namespace tfdude::simulation
