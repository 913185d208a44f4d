#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "simulation/plan.hpp"
#include "simulation/steps.hpp"

namespace tfdude::simulation {

/// A rule that was broken.
struct Failure {
  std::string kind;  ///< two runs with the same one fail in the same way
  std::string what;
  Instant when{};
};

/// The result of a run.
struct Run {
  std::vector<Failure> failures;  ///< the first ones
  Steps steps;
  std::vector<std::size_t> operations;        ///< the numbers of those that were made
  std::map<std::string, std::size_t> counts;  ///< of outcomes, faults, and rare states
  Instant duration{};
};

/// Runs a plan: first the phase with faults, then the checks after the remaining participants have
/// had time to agree.
/// @param trace  prints each step
[[nodiscard]] Run run(const Plan& plan, bool trace = false);

}  // namespace tfdude::simulation
