#include "faults/schedule.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace tfdude::faults {
namespace {

// What a fault occupies: a daemon's process, or a link between two hosts (zero: to all others).
using Claim = std::pair<int, std::pair<std::size_t, std::size_t>>;

Claim claim_of(const Fault& fault) {
  switch (fault.kind) {
    case FaultKind::kKill:
    case FaultKind::kPause:
    // Fast DDS never hears of a network that comes after the participant was made.
    case FaultKind::kUnplug:
      return {0, {fault.target, 0}};
    case FaultKind::kCutDaemon:
      return {1, {fault.target, 0}};
    case FaultKind::kCutClient:
      return {2, {fault.target, 0}};
    case FaultKind::kPart:
      break;
  }
  return {3, std::minmax(fault.target, fault.other)};
}

// Too short to be noticed, as long as it takes to be given up by the service, or by DDS too.
double duration(testing::Random& random) {
  const std::size_t draw = random.index(10);
  if (draw < 4) return random.uniform(0.02, 0.45);
  if (draw < 9) return random.uniform(0.45, 4.0);
  return random.uniform(4.0, 12.0);
}

Fault draw(testing::Random& random, std::size_t partitions, std::size_t clients, bool links) {
  static constexpr std::array kKinds = {
      FaultKind::kKill,      FaultKind::kKill,   FaultKind::kPause,     FaultKind::kPause,
      FaultKind::kCutDaemon, FaultKind::kUnplug, FaultKind::kCutClient, FaultKind::kPart};
  Fault fault;
  fault.kind = kKinds[random.index(links ? kKinds.size() : 4)];
  fault.target = random.index(fault.kind == FaultKind::kCutClient ? clients : partitions);
  if (partitions > 1) fault.other = (fault.target + 1 + random.index(partitions - 1)) % partitions;
  return fault;
}

}  // namespace

std::vector<Fault> schedule(testing::Random& random, double seconds, std::size_t partitions,
                            std::size_t clients, bool links) {
  std::vector<Fault> faults;
  std::map<Claim, double> free_at;
  for (double storm = 0; storm < seconds; storm += kStorm + kCalm) {
    const double over = std::min(storm + kStorm, seconds);
    for (double at = storm; at < over; at += random.uniform(0.1, 1.5)) {
      Fault fault = draw(random, partitions, clients, links);
      fault.begin = at;
      fault.end = std::min(at + duration(random), over);
      if (fault.kind == FaultKind::kPart && partitions < 2) continue;
      double& free = free_at[claim_of(fault)];
      if (free > at) continue;
      // A daemon that starts may be hit again before it serves.
      free = fault.end + random.uniform(0.3, 3.0);
      faults.push_back(fault);
    }
  }
  return faults;
}

}  // namespace tfdude::faults
