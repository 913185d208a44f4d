#include "transport/fastdds/fair_share.hpp"

#include <cmath>

#include "base/log.hpp"

namespace tfdude::fastdds {
namespace {

constexpr double kMemorySeconds = std::chrono::duration<double>(FairShare::kMemory).count();

// A sender that takes less than this part of the time is not heavy.
constexpr double kLight = 0.05;

// Of the calling thread.
struct Load {
  FairShare::Clock::time_point busy_since;
  FairShare::Clock::time_point free_since;
};
thread_local Load load;

}  // namespace

void FairShare::begin(Clock::time_point now) {
  if (now - load.free_since > kGap) load.busy_since = now;
}

void FairShare::end(Clock::time_point now) { load.free_since = now; }

double FairShare::Account::now(Clock::time_point now) const {
  return seconds * std::exp(-std::chrono::duration<double>(now - at).count() / kMemorySeconds);
}

bool FairShare::admits(const PeerId& sender, Clock::time_point now) {
  if (now - load.busy_since < kOverloadedAfter) return true;
  {
    const Lock lock(mutex_);
    const auto known = accounts_.find(sender);
    if (known == accounts_.end()) return true;
    int heavy = 1;
    bool alone = true;
    for (const auto& [other, account] : accounts_) {
      if (other == sender) continue;
      if (account.now(now) > kLight * kMemorySeconds) ++heavy;
      if (now - account.at < kActive) alone = false;
    }
    if (alone || known->second.now(now) <= kShare / heavy * kMemorySeconds) return true;
  }
  const std::uint64_t before = dropped_.fetch_add(1, std::memory_order_relaxed);
  if ((before & (before + 1)) == 0) {  // the 1st, 2nd, 4th, 8th...
    log().warn("dropped a message of a sender that takes more than its share ({} so far)",
               before + 1);
  }
  return false;
}

void FairShare::spent(const PeerId& sender, Clock::duration time, Clock::time_point now) {
  const Lock lock(mutex_);
  Account& account = accounts_[sender];
  account = {account.now(now) + std::chrono::duration<double>(time).count(), now};
}

void FairShare::left(const PeerId& sender) {
  const Lock lock(mutex_);
  accounts_.erase(sender);
}

}  // namespace tfdude::fastdds
