#pragma once

#include <cstddef>
#include <vector>

#include "support/random.hpp"

namespace tfdude::faults {

enum class FaultKind {
  kKill,       ///< a daemon, which is started again at the end
  kPause,      ///< a daemon
  kCutDaemon,  ///< its host from all others, without a sign
  kCutClient,  ///< as that
  kUnplug,     ///< a daemon's host from all others, as it can see
  kPart,       ///< two daemons' hosts from each other
};

struct Fault {
  double begin = 0;  ///< since the run began [s]
  double end = 0;
  FaultKind kind = FaultKind::kKill;
  std::size_t target = 0;  ///< a partition, or a client
  std::size_t other = 0;   ///< the second partition that is parted
};

/// How long there are faults, then none, by turns [s].
inline constexpr double kStorm = 14.0;
inline constexpr double kCalm = 9.0;

/// All faults of a run, in the order in which they begin. A daemon is not killed and paused at once, nor is a
/// link cut twice; all else may happen at once. All are over as a calm begins.
[[nodiscard]] std::vector<Fault> schedule(testing::Random& random, double seconds,
                                          std::size_t partitions, std::size_t clients, bool links);

}  // namespace tfdude::faults
