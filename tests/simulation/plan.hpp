#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "simulation/timeline.hpp"

namespace tfdude::simulation {

enum class FaultKind {
  kKill,         ///< kills a daemon; it is restarted at the end, from its stored state
  kStop,         ///< the same, but the daemon announces its end
  kPowerLoss,    ///< the same, but what was not synced may be lost, from some change on
  kPause,        ///< pauses a daemon
  kCut,          ///< cuts a computer off from all others
  kMute,         ///< others do not hear a computer, but it hears them
  kDeafen,       ///< a computer does not hear others, but they hear it
  kPart,         ///< separates two computers
  kStepClock,    ///< sets the clock of a computer, permanently
  kFillDisk,     ///< fills the disk of a daemon
  kReplace,      ///< a daemon hangs, and another is started in its place; then the first continues
  kRename,       ///< kills a daemon, and starts another partition with its configuration
  kReconfigure,  ///< kills a daemon, and restarts it with another configuration
  kDeputize,     ///< the same, with a frame of the last one, which is down and later returns
};
inline constexpr std::size_t kFaultKinds = 14;
[[nodiscard]] const char* name_of(FaultKind kind);

struct Fault {
  FaultKind kind = FaultKind::kKill;
  Instant begin{};
  Instant end{};
  std::size_t target = 0;
  std::size_t other = 0;
  milliseconds step{};  ///< of the clock
  bool left_out = false;
};

/// What authors do.
enum class OperationKind {
  kLookup,
  kUpdate,
  kAdd,
  kMove,
  kRemove,
  kJoint,   ///< moves a joint, and the one that follows it
  kForget,  ///< forgets a partition that is not reachable
};
inline constexpr std::size_t kOperationKinds = 7;
[[nodiscard]] const char* name_of(OperationKind kind);

/// The parameters of a run; all of them are determined by its seed.
struct Plan {
  std::uint64_t seed = 0;
  std::size_t owners = 2;
  std::size_t clients = 1;    ///< clients that own no frames
  std::size_t followers = 0;  ///< clients that read watched paths
  std::size_t samplers = 0;   ///< clients that write stamped samples
  std::size_t waiters = 0;    ///< clients whose lookups wait
  std::size_t measurers = 0;  ///< clients that observe paths
  std::size_t pacers = 0;     ///< clients that look for the latest common time
  std::size_t streamers = 0;  ///< clients that stream what comes and goes
  Instant storm{};            ///< duration of the phase with faults
  double loss = 0;            ///< of datagrams, and of samples that are repeated then
  double repeats = 0;         ///< share of datagrams that arrive twice
  Instant delay{};            ///< mean delay of the network
  Instant disk{};             ///< maximum time of storing
  bool sync = false;          ///< each stored change survives a power loss
  Instant offset{};           ///< maximum by which a clock is wrong from the start
  double drift = 0;           ///< maximum by which a clock is too fast or too slow
  double contest = 0;         ///< share of changes of frames that all clients change
  /// Weights of the kinds of operations; some do not occur.
  std::array<double, kOperationKinds> weights{};
  bool stores = true;  ///< daemons store their frames
  bool wild_stores =
      true;  ///< and so does the last, which may be renamed and replaced, and nobody relies on
  double loss_after = 0;       ///< of datagrams, after the phase with faults
  std::vector<Fault> faults;   ///< in the order in which they begin
  std::vector<Fault> lasting;  ///< begin after the others, and do not end
  /// Owners tell how many others they hear. In runs with faults they do not: no rule depends on it.
  bool tells_count = false;
  bool forgets = false;  ///< a partition that such a fault keeps away is forgotten
  /// Faults of others at that time, and those that belong together.
  std::vector<Fault> beside;
  /// The numbers of decisions and of operations that are left out.
  std::set<std::size_t> left_out;

  [[nodiscard]] bool stores_of(std::size_t owner) const {
    return owner + 1 == owners ? wild_stores : stores;
  }
  /// Whether a process of this owner may not have what its predecessor has stored.
  [[nodiscard]] bool may_lack_state(std::size_t owner) const;
  [[nodiscard]] double weight(OperationKind kind) const {
    return weights.at(static_cast<std::size_t>(kind));
  }

  /// How many make operations that are counted.
  [[nodiscard]] std::size_t actors() const {
    return clients + followers + samplers + waiters + measurers + pacers;
  }
  /// For the random numbers of one operation.
  [[nodiscard]] std::uint64_t seed_of(std::size_t actor, std::size_t operation) const;
  [[nodiscard]] bool leaves_out(std::size_t actor, std::size_t operation) const;
  /// Whether stored changes may be lost.
  [[nodiscard]] bool may_lose_power() const;
  /// Whether a deputy takes something over, and nothing else happens from then on.
  [[nodiscard]] bool deputizes_in_peace() const;

  [[nodiscard]] std::string text() const;
};

[[nodiscard]] Plan draw_plan(std::uint64_t seed);

/// Something that the seed decided, and that may be left out.
struct Decision {
  std::string text;
  std::function<void(Plan&)> leave_out;
};

/// The decisions of a plan, by their numbers. Operations have greater ones.
[[nodiscard]] std::vector<Decision> decisions_of(const Plan& plan);

/// The number of an operation, counted by actor; each has at most so many that can be left out.
inline constexpr std::size_t kOperationsEach = 1000;
[[nodiscard]] constexpr std::size_t number_of(std::size_t actor, std::size_t operation) {
  return (actor + 1) * kOperationsEach + operation;
}

/// The plan of a seed without these decisions, and with a phase of faults of at most this length.
[[nodiscard]] Plan plan_without(std::uint64_t seed, const std::set<std::size_t>& numbers,
                                Instant storm);

}  // namespace tfdude::simulation
