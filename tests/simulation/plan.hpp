#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "simulation/timeline.hpp"

namespace tfdude::simulation {

enum class FaultKind {
  kKill,         ///< kills a daemon; it is restarted at the end, from its stored state
  kStop,         ///< the same, but the daemon announces its end
  kPause,        ///< pauses a daemon
  kCut,          ///< cuts a computer off from all others
  kCutOneWay,    ///< others do not hear a computer, but it hears them
  kPart,         ///< separates two computers
  kStepClock,    ///< sets the clock of a daemon, permanently
  kFillDisk,     ///< fills the disk of a daemon
  kReplace,      ///< a daemon hangs, and another is started in its place; then the first continues
  kRename,       ///< kills a daemon, and starts another partition with its configuration
  kReconfigure,  ///< kills a daemon, and restarts it with one more frame, or without that frame
};
inline constexpr std::size_t kFaultKinds = 11;
[[nodiscard]] const char* name_of(FaultKind kind);

struct Fault {
  FaultKind kind = FaultKind::kKill;
  Instant begin{};
  Instant end{};
  std::size_t target = 0;
  std::size_t other = 0;
  milliseconds step{};  ///< of the clock
};

/// The parameters of a run; all of them are determined by its seed.
struct Plan {
  std::uint64_t seed = 0;
  std::size_t owners = 2;
  std::size_t clients = 1;    ///< clients that own no frames
  std::size_t followers = 0;  ///< clients that read watched paths
  Instant storm{};            ///< duration of the phase with faults
  double loss = 0;            ///< of datagrams, and of samples that are repeated then
  double repeats = 0;         ///< share of datagrams that arrive twice
  Instant delay{};            ///< mean delay of the network
  Instant disk{};             ///< maximum time of storing
  double contest = 0;         ///< share of changes of frames that all clients change
  bool stores = true;         ///< daemons store their frames
  bool wild_stores =
      true;  ///< and so does the last, which may be renamed and replaced, and nobody relies on
  /// Killed as the storm ends, for good: the others have to agree without it. The number of owners:
  /// nobody.
  std::size_t lost = 0;
  double loss_after = 0;      ///< of datagrams, after the phase with faults
  std::vector<Fault> faults;  ///< in the order in which they begin

  [[nodiscard]] bool stores_of(std::size_t owner) const {
    return owner + 1 == owners ? wild_stores : stores;
  }

  [[nodiscard]] std::string text() const;
};

[[nodiscard]] Plan draw_plan(std::uint64_t seed);

/// A plan with fewer faults and milder parameters, for which `fails` is still true.
[[nodiscard]] Plan shrink(Plan plan, const std::function<bool(const Plan&)>& fails);

}  // namespace tfdude::simulation
