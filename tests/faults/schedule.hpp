#pragma once

#include <cstddef>
#include <vector>

#include "support/random.hpp"

namespace tfdude::faults {

enum class FaultKind {
  kKill,         ///< kills a daemon, and restarts it at the end
  kPause,        ///< pauses a daemon
  kCutDaemon,    ///< cuts its host off from all others; the host does not notice
  kCutClient,    ///< the same for a client's host
  kUnplug,       ///< cuts a daemon's host off from all others; the host sees that
  kPart,         ///< separates the hosts of two daemons
  kReconfigure,  ///< kills a daemon, and restarts it with another configuration
  kStepClock,    ///< sets the clock of a daemon, and sets it back at the end
  kFillDisk,     ///< fills the disk on which all daemons store their state
};

/// The faults that are possible here, besides killing and pausing.
struct Means {
  bool links = false;
  bool clocks = false;
  bool disks = false;
};

/// The configuration of a daemon. The first two contain its usual frame, which is already stored.
enum class Variant {
  kUsual,
  kWithSpare,  ///< and another frame below that
  kNone,       ///< no configuration, only its stored state
};

struct Fault {
  double begin = 0;  ///< since the run began [s]
  double end = 0;
  FaultKind kind = FaultKind::kKill;
  std::size_t target = 0;             ///< a partition, or a client
  std::size_t other = 0;              ///< the second partition of kPart
  Variant variant = Variant::kUsual;  ///< of the next configuration
  int step = 0;                       ///< of the clock [s]
};

/// The durations of alternating phases with and without faults [s].
inline constexpr double kStorm = 14.0;
inline constexpr double kCalm = 9.0;

/// All faults of a run, in the order in which they begin. A daemon is not killed and paused at the
/// same time, a link is not cut twice at the same time, and no daemon starts on a full disk. All
/// other faults may overlap. All are over when a phase without faults begins.
[[nodiscard]] std::vector<Fault> schedule(testing::Random& random, double seconds,
                                          std::size_t partitions, std::size_t clients,
                                          const Means& means);

}  // namespace tfdude::faults
