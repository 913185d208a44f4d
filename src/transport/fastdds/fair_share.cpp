#include "transport/fastdds/fair_share.hpp"

#include <algorithm>
#include <cmath>

#include "base/log.hpp"

namespace tfdude::fastdds {
namespace {

constexpr double kMemorySeconds = std::chrono::duration<double>(FairShare::kMemory).count();

// A sender that takes less than this part of the time is not heavy.
constexpr double kLight = 0.05;

constexpr std::chrono::milliseconds kRecountEvery{1};

// Of the calling thread.
struct Load {
  FairShare::Clock::time_point busy_since;
  FairShare::Clock::time_point free_since;
  bool has_message = false;  // the datagram at hand
};
thread_local Load load;

}  // namespace

void FairShare::begin(Clock::time_point now) {
  if (now - load.free_since > kGap) load.busy_since = now;
  load.has_message = false;
}

void FairShare::has_message() { load.has_message = true; }

void FairShare::end(Clock::time_point now) { load.free_since = now; }

double FairShare::Account::now(Clock::time_point now) const {
  return seconds * std::exp(-std::chrono::duration<double>(now - at).count() / kMemorySeconds);
}

void FairShare::count(Clock::time_point now) {
  counted_ = now;
  heavy_ = active_ = 0;
  for (const auto& [sender, account] : accounts_) {
    if (account.now(now) > kLight * kMemorySeconds) ++heavy_;
    if (now - account.active < kActive) ++active_;
  }
}

bool FairShare::admits(Sender sender, Clock::time_point now) {
  if (now - load.busy_since < kOverloadedAfter) return true;
  {
    const Lock lock(mutex_);
    const auto known = accounts_.find(sender);
    if (known == accounts_.end()) return true;
    if (now - counted_ > kRecountEvery || now < counted_) count(now);
    const double taken = known->second.now(now);
    const int heavy = std::max(1, heavy_ + (taken > kLight * kMemorySeconds ? 0 : 1));
    if (active_ <= 1 || taken <= kShare / heavy * kMemorySeconds) return true;
  }
  const std::uint64_t before = dropped_.fetch_add(1, std::memory_order_relaxed);
  if ((before & (before + 1)) == 0) {  // the 1st, 2nd, 4th, 8th...
    log().warn("dropped a datagram of a sender that takes more than its share ({} so far)",
               before + 1);
  }
  return false;
}

void FairShare::spent(Sender sender, Clock::duration time, Clock::time_point now) {
  const double seconds = std::chrono::duration<double>(time).count();
  const Lock lock(mutex_);
  const auto [there, is_new] = accounts_.try_emplace(sender, Account{0, now});
  Account& account = there->second;
  const double passed = std::chrono::duration<double>(now - account.at).count();
  account.allowance = std::min(kAllowance, account.allowance + passed * kAllowanceGrowth);
  const bool counts = load.has_message || account.allowance < seconds;
  if (!counts) account.allowance -= seconds;
  account.seconds = account.now(now) + (counts ? seconds : 0);
  account.at = now;
  if (counts) account.active = now;
  if (!is_new || accounts_.size() <= kMost) return;
  accounts_.erase(
      std::min_element(accounts_.begin(), accounts_.end(),
                       [](const auto& a, const auto& b) { return a.second.at < b.second.at; }));
}

}  // namespace tfdude::fastdds
