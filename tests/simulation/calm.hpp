#pragma once

#include <cstddef>

#include "tfdude/base/result.hpp"

#include "simulation/traffic.hpp"

namespace tfdude::simulation {

struct CalmSize {
  std::size_t partitions = 2;
  std::size_t frames = 2;  ///< of all partitions, which share them evenly
};

/// What the participants have sent and received in some time, or for each change.
struct Spent {
  Load all;   ///< the sum
  Load mean;  ///< of one participant
  Load most;  ///< the greatest of each number, over all changes of a kind
};

/// What a system costs in which nothing fails and nothing is lost.
struct CalmRun {
  double served_s = 0;  ///< simulated time from the start of all until all serve
  double known_s = 0;   ///< until each knows all frames
  Spent start;          ///< until then, and until all is quiet
  Spent idle;           ///< per second
  // Per change, or lookup. Each is made by one participant, and concerns another one's frame. No
  // participant makes two of a kind, and none is asked twice.
  Spent add;
  Spent update;
  Spent lookup;
  Spent join;  ///< one more owner starts, with one frame
};

/// Simulates owners that all start at once, are idle, and then make a few changes. Each has its
/// replica of all frames. The first frames of all partitions form a chain.
/// @return kInvalidInput: fewer than two partitions, or fewer frames than partitions; kState: a
///   participant does not know all, or a rule is broken; the error of a change that failed
[[nodiscard]] Result<CalmRun> run_calm(const CalmSize& size);

}  // namespace tfdude::simulation
