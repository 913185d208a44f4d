#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "simulation/author.hpp"
#include "simulation/follower.hpp"

namespace tfdude::simulation {

/// The result of a run.
struct Run {
  std::vector<std::string> violations;
  std::vector<std::uint64_t> hashes;          ///< of the steps so far, after each
  std::map<std::string, std::size_t> counts;  ///< of outcomes, faults, and rare states
  Instant duration{};
};

/// Runs a plan: first the phase with faults, then the checks after the remaining participants have
/// had time to agree.
/// @param trace  prints each step
[[nodiscard]] Run run(const Plan& plan, bool trace = false);

}  // namespace tfdude::simulation
