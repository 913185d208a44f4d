#include "transport/fastdds/send_throttle.hpp"

namespace tfdude::fastdds {
namespace {

std::int64_t ticks(SendThrottle::Clock::duration duration) { return duration.count(); }

// Ports begin at one: zero stands for the host.
std::uint64_t key_of(std::uint32_t host, std::uint32_t port) {
  return static_cast<std::uint64_t>(host) << 32U | port;
}

}  // namespace

std::atomic<std::int64_t>* SendThrottle::find(std::uint64_t key, std::int64_t first) {
  // Neighbours in the net are far apart in the table.
  const std::uint64_t wish = (key * 0x9E3779B97F4A7C15U) >> 32U;
  for (std::size_t i = 0; i < entries_.size(); ++i) {
    Entry& entry = entries_[(wish + i) % entries_.size()];
    std::uint64_t known = entry.key.load(std::memory_order_relaxed);
    if (known == key) return &entry.time;
    if (known != 0) continue;
    if (entry.key.compare_exchange_strong(known, key, std::memory_order_relaxed)) {
      entry.time.store(first, std::memory_order_relaxed);
      return &entry.time;
    }
    if (known == key) return &entry.time;
  }
  return nullptr;
}

void SendThrottle::heard(std::uint32_t host, Clock::time_point now) {
  const std::int64_t at = ticks(now.time_since_epoch());
  if (auto* known = find(key_of(host, 0), at)) known->store(at, std::memory_order_relaxed);
}

bool SendThrottle::may_send(std::uint32_t host, std::uint32_t port, Clock::time_point now) {
  const std::int64_t at = ticks(now.time_since_epoch());
  // A host that is checked for the first time counts as heard now: it had no time to send yet.
  const auto* known = find(key_of(host, 0), at);
  if (known == nullptr) return true;
  if (at - known->load(std::memory_order_relaxed) < ticks(kSilence)) return true;
  auto* last = find(key_of(host, port), 0);
  if (last == nullptr) return true;
  std::int64_t tried = last->load(std::memory_order_relaxed);
  return at - tried >= ticks(kTryEvery) &&
         last->compare_exchange_strong(tried, at, std::memory_order_relaxed);
}

}  // namespace tfdude::fastdds
