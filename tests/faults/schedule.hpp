#pragma once

#include <cstddef>
#include <vector>

#include "support/random.hpp"

namespace tfdude::faults {

enum class FaultKind {
  kKill,         ///< a daemon, which is started again at the end
  kPause,        ///< a daemon
  kCutDaemon,    ///< its host from all others, without a sign
  kCutClient,    ///< as that
  kUnplug,       ///< a daemon's host from all others, as it can see
  kPart,         ///< two daemons' hosts from each other
  kReconfigure,  ///< a daemon is killed, and started again with another configuration
  kStepClock,    ///< of a daemon, and back at the end
  kFillDisk,     ///< on which all daemons keep their state
};

/// What can be done here besides killing and pausing.
struct Means {
  bool links = false;
  bool clocks = false;
  bool disks = false;
};

/// What a daemon is configured with. Its usual frame is in the first two, and was stored by then.
enum class Variant {
  kUsual,
  kWithSpare,  ///< and a frame more below that
  kNone,       ///< no configuration: its state alone
};

struct Fault {
  double begin = 0;  ///< since the run began [s]
  double end = 0;
  FaultKind kind = FaultKind::kKill;
  std::size_t target = 0;             ///< a partition, or a client
  std::size_t other = 0;              ///< the second partition that is parted
  Variant variant = Variant::kUsual;  ///< of the next configuration
  int step = 0;                       ///< of the clock [s]
};

/// How long there are faults, then none, by turns [s].
inline constexpr double kStorm = 14.0;
inline constexpr double kCalm = 9.0;

/// All faults of a run, in the order in which they begin. A daemon is not killed and paused at
/// once, nor is a link cut twice, and no daemon starts on a full disk; all else may happen at once.
/// All are over as a calm begins.
[[nodiscard]] std::vector<Fault> schedule(testing::Random& random, double seconds,
                                          std::size_t partitions, std::size_t clients,
                                          const Means& means);

}  // namespace tfdude::faults
