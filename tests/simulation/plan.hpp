#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "simulation/timeline.hpp"

namespace tfdude::simulation {

enum class FaultKind {
  kKill,         ///< a daemon; it is started again at the end, from what it stored
  kStop,         ///< the same after a last word
  kPause,        ///< a daemon
  kCut,          ///< a computer from all others
  kCutOneWay,    ///< nobody hears it, but it hears the others
  kPart,         ///< two computers from each other
  kStepClock,    ///< of a daemon; for good
  kFillDisk,     ///< of a daemon
  kReplace,      ///< a daemon hangs, and another is started in its place; then it goes on
  kRename,       ///< a daemon is killed, and another partition is started with its configuration
  kReconfigure,  ///< a daemon is killed, and started again with a frame more, or without that one
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

/// What a run is like; all of it is drawn from its seed.
struct Plan {
  std::uint64_t seed = 0;
  std::size_t owners = 2;
  std::size_t clients = 1;    ///< that own nothing
  std::size_t followers = 0;  ///< clients that read watched paths
  Instant storm{};            ///< how long there are faults
  double loss = 0;            ///< of datagrams, and of samples that are repeated then
  double repeats = 0;         ///< of datagrams that come twice
  Instant delay{};            ///< at the mean
  Instant disk{};             ///< how long storing takes, at most
  double contest = 0;         ///< share of changes of frames that all fight over
  bool stores = true;         ///< daemons keep their frames
  bool wild_stores =
      true;  ///< and so does the last, which may be renamed and replaced, and nobody relies on
  /// Killed as the storm ends, for good: the others have to agree without it. The number of owners:
  /// nobody.
  std::size_t lost = 0;
  double loss_after = 0;      ///< of datagrams, when the storm is over
  std::vector<Fault> faults;  ///< in the order in which they begin

  [[nodiscard]] bool stores_of(std::size_t owner) const {
    return owner + 1 == owners ? wild_stores : stores;
  }

  [[nodiscard]] std::string text() const;
};

[[nodiscard]] Plan draw_plan(std::uint64_t seed);

/// A plan with fewer faults, and otherwise milder, for which `fails` is still true.
[[nodiscard]] Plan shrink(Plan plan, const std::function<bool(const Plan&)>& fails);

}  // namespace tfdude::simulation
