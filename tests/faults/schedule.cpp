#include "faults/schedule.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace tfdude::faults {
namespace {

// The target of a fault: a daemon's process, or a link between two hosts (zero: to all others).
using Claim = std::pair<int, std::pair<std::size_t, std::size_t>>;

std::vector<Claim> claims_of(const Fault& fault, std::size_t partitions) {
  std::vector<Claim> all;
  switch (fault.kind) {
    case FaultKind::kFillDisk:
      for (std::size_t i = 0; i < partitions; ++i) all.push_back({0, {i, 0}});
      return all;
    case FaultKind::kStepClock:
      return {{4, {fault.target, 0}}};
    case FaultKind::kKill:
    case FaultKind::kReconfigure:
    case FaultKind::kPause:
    // Fast DDS does not notice a network that appears after the participant was created.
    case FaultKind::kUnplug:
      return {{0, {fault.target, 0}}};
    case FaultKind::kCutDaemon:
      return {{1, {fault.target, 0}}};
    case FaultKind::kCutClient:
      return {{2, {fault.target, 0}}};
    case FaultKind::kPart:
      break;
  }
  return {{3, std::minmax(fault.target, fault.other)}};
}

// Too short to be noticed, or long enough for the service, or also for DDS, to consider it lost.
double duration(testing::Random& random) {
  const std::size_t draw = random.index(10);
  if (draw < 4) return random.uniform(0.02, 0.45);
  if (draw < 9) return random.uniform(0.45, 4.0);
  return random.uniform(4.0, 12.0);
}

// The possible faults; one that is listed several times is more frequent.
std::vector<FaultKind> kinds(const Means& means) {
  std::vector<FaultKind> kinds{FaultKind::kKill, FaultKind::kKill, FaultKind::kPause,
                               FaultKind::kPause, FaultKind::kReconfigure};
  if (means.links) {
    kinds.insert(kinds.end(), {FaultKind::kCutDaemon, FaultKind::kUnplug, FaultKind::kCutClient,
                               FaultKind::kPart});
  }
  if (means.clocks) kinds.push_back(FaultKind::kStepClock);
  if (means.disks) kinds.push_back(FaultKind::kFillDisk);
  return kinds;
}

Fault draw(testing::Random& random, std::size_t partitions, std::size_t clients,
           const std::vector<FaultKind>& kinds) {
  Fault fault;
  fault.kind = kinds[random.index(kinds.size())];
  fault.target = random.index(fault.kind == FaultKind::kCutClient ? clients : partitions);
  fault.variant = static_cast<Variant>(random.index(3));
  // Also larger than the tolerated error of a clock.
  fault.step = static_cast<int>(random.index(2) == 0 ? random.index(7200) : random.index(20)) *
               (random.index(2) == 0 ? 1 : -1);
  if (partitions > 1) fault.other = (fault.target + 1 + random.index(partitions - 1)) % partitions;
  return fault;
}

}  // namespace

std::vector<Fault> schedule(testing::Random& random, double seconds, std::size_t partitions,
                            std::size_t clients, const Means& means) {
  std::vector<Fault> faults;
  std::map<Claim, double> free_at;
  const std::vector<FaultKind> possible = kinds(means);
  for (double storm = 0; storm < seconds; storm += kStorm + kCalm) {
    const double over = std::min(storm + kStorm, seconds);
    for (double at = storm; at < over; at += random.uniform(0.1, 1.5)) {
      Fault fault = draw(random, partitions, clients, possible);
      fault.begin = at;
      fault.end = std::min(at + duration(random), over);
      if (fault.kind == FaultKind::kPart && partitions < 2) continue;
      const std::vector<Claim> claims = claims_of(fault, partitions);
      const bool free = std::all_of(claims.begin(), claims.end(),
                                    [&](const Claim& claim) { return free_at[claim] <= at; });
      if (!free) continue;
      // A daemon that starts may be hit again before it serves.
      const double pause = random.uniform(0.3, 3.0);
      for (const Claim& claim : claims) free_at[claim] = fault.end + pause;
      faults.push_back(fault);
    }
  }
  return faults;
}

}  // namespace tfdude::faults
