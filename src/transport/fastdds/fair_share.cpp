#include "transport/fastdds/fair_share.hpp"

#include <algorithm>
#include <cstring>
#include <string>

#include "base/log.hpp"

namespace tfdude::fastdds {
namespace {

constexpr double kMemorySeconds = std::chrono::duration<double>(FairShare::kMemory).count();

constexpr double kGraceSeconds = std::chrono::duration<double>(FairShare::kGrace).count();

// A sender that takes less than this part of the time is not heavy.
constexpr double kLight = 0.05;

constexpr std::chrono::milliseconds kRecountEvery{1};

// Of the calling thread.
struct Load {
  FairShare::Clock::time_point busy_since;
  FairShare::Clock::time_point free_since;
  long waits = -1;           // until then; -1: none has been handled
  bool has_message = false;  // the datagram at hand
};
thread_local Load load;

// The address in the order of the network, and the port.
std::string name_of(FairShare::Sender sender) {
  const auto address = static_cast<std::uint32_t>(sender >> 32U);
  std::array<std::uint8_t, sizeof address> bytes{};
  std::memcpy(bytes.data(), &address, sizeof address);
  std::string name;
  for (const std::uint8_t byte : bytes) name += (name.empty() ? "" : ".") + std::to_string(byte);
  return name + ':' + std::to_string(static_cast<std::uint32_t>(sender));
}

}  // namespace

void FairShare::begin(Clock::time_point now, long waits) {
  if (now - load.free_since > kGap && waits != load.waits) load.busy_since = now;
  load.has_message = false;
}

void FairShare::has_message() { load.has_message = true; }

void FairShare::end(Clock::time_point now, long waits) {
  load.free_since = now;
  load.waits = waits;
}

double FairShare::owed(const Account& account, Clock::time_point now) const {
  const double passed = std::chrono::duration<double>(now - account.at).count();
  return std::max(0.0, account.seconds - passed * kShare / std::max(1, heavy_));
}

bool FairShare::is_contended(Sender sender, Clock::time_point now) {
  if (last_.sender != sender) last_other_ = last_;
  last_ = {sender, now};
  return last_other_.at != Clock::time_point{} && now - last_other_.at < kActive;
}

void FairShare::count(Clock::time_point now) {
  counted_ = now;
  heavy_ = active_ = 0;
  for (const auto& [sender, account] : accounts_) {
    if (owed(account, now) > kLight * kMemorySeconds) ++heavy_;
    if (now - account.active < kActive) ++active_;
  }
}

bool FairShare::is_due(const Account& account, Clock::time_point now) {
  return account.last < kCheap && now - account.at >= kDeafFor;
}

std::uint64_t FairShare::dropped() const {
  std::uint64_t sum = 0;
  for (const Dropped& kind : dropped_) sum += kind.count.load(std::memory_order_relaxed);
  return sum;
}

bool FairShare::drop(Reason reason, Sender sender, Clock::time_point now) {
  Dropped& kind = dropped_[static_cast<std::size_t>(reason)];
  const std::uint64_t count = kind.count.fetch_add(1, std::memory_order_relaxed) + 1;
  if (reason == Reason::kListening) return false;
  const Clock::rep time = now.time_since_epoch().count();
  Clock::rep before = kind.logged.load(std::memory_order_relaxed);
  if (before != 0 && time - before < Clock::duration(kLogEvery).count()) return false;
  if (!kind.logged.compare_exchange_strong(before, time)) return false;
  const std::uint64_t many = count - kind.told.exchange(count);
  if (reason == Reason::kPaysBack) {
    log().info(
        "messages of {} wait, since its last ones took long (datagrams dropped until now: {}). "
        "They are repeated; this is no error",
        name_of(sender), many);
  } else {
    log().warn(
        "senders take more than their share while others wait, now {} (datagrams dropped until "
        "now: {})",
        name_of(sender), many);
  }
  return false;
}

// Between its messages the thread may be idle, and each makes the others wait.
bool FairShare::admits_idle(Sender sender, Clock::time_point now) {
  if (now.time_since_epoch().count() >= grace_used_until_.load(std::memory_order_relaxed)) {
    return true;
  }
  const Lock lock(mutex_);
  const auto known = accounts_.find(sender);
  return known == accounts_.end() || is_due(known->second, now) ||
         owed(known->second, now) <= kGraceSeconds;
}

bool FairShare::admits(Sender sender, Clock::time_point now) {
  if (now - load.busy_since < kOverloadedAfter) {
    return admits_idle(sender, now) || drop(Reason::kPaysBack, sender, now);
  }
  Reason reason = Reason::kShare;
  {
    const Lock lock(mutex_);
    const auto known = accounts_.find(sender);
    if (known == accounts_.end() || is_due(known->second, now)) return true;
    if (now - counted_ > kRecountEvery || now < counted_) count(now);
    const double taken = owed(known->second, now);
    const int heavy = std::max(1, heavy_ + (taken > kLight * kMemorySeconds ? 0 : 1));
    const bool listens = (now - load.busy_since) % kListenEvery >= kListenEvery - kListenFor;
    const bool limited = active_ > 1 || listens;
    if (!limited || taken <= kShare / heavy * kMemorySeconds) return true;
    if (active_ <= 1) reason = Reason::kListening;
  }
  return drop(reason, sender, now);
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
  const double owed_before = owed(account, now);
  const bool delays = time > kOverloadedAfter || now - time - load.busy_since >= kOverloadedAfter;
  const double most = counts && is_contended(sender, now) && delays
                          ? std::chrono::duration<double>(kMostOwed).count()
                          : std::max(owed_before, kMemorySeconds);
  account.seconds = counts ? std::min(owed_before + seconds, most) : owed_before;
  account.at = now;
  account.last = time;
  if (counts) account.active = now;
  if (account.seconds > kGraceSeconds) {
    // At least for as long as it takes to pay it back.
    const auto until = now + std::chrono::seconds(1 + 2 * std::max(1, heavy_));
    grace_used_until_.store(until.time_since_epoch().count(), std::memory_order_relaxed);
  }
  if (!is_new || accounts_.size() <= kMost) return;
  accounts_.erase(
      std::min_element(accounts_.begin(), accounts_.end(),
                       [](const auto& a, const auto& b) { return a.second.at < b.second.at; }));
}

}  // namespace tfdude::fastdds
