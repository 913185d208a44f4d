#include "transport/fastdds/reach.hpp"

namespace tfdude::fastdds {
namespace {

std::int64_t ticks(Reach::Clock::duration duration) { return duration.count(); }

}  // namespace

Reach::Host* Reach::find(std::uint32_t address, std::int64_t now) {
  const std::size_t wish = (address * 2654435761U) >> 24U;  // its neighbours in the net far apart
  for (std::size_t i = 0; i < hosts_.size(); ++i) {
    Host& host = hosts_[(wish + i) % hosts_.size()];
    std::uint32_t known = host.address.load(std::memory_order_relaxed);
    if (known == address) return &host;
    if (known != 0) continue;
    if (host.address.compare_exchange_strong(known, address, std::memory_order_relaxed)) {
      // Nobody is silent who had no time to speak.
      host.heard.store(now, std::memory_order_relaxed);
      return &host;
    }
    if (known == address) return &host;
  }
  return nullptr;
}

void Reach::heard(std::uint32_t host, Clock::time_point now) {
  const std::int64_t at = ticks(now.time_since_epoch());
  if (Host* known = find(host, at)) known->heard.store(at, std::memory_order_relaxed);
}

bool Reach::may_send(std::uint32_t host, Clock::time_point now) {
  const std::int64_t at = ticks(now.time_since_epoch());
  Host* known = find(host, at);
  if (known == nullptr) return true;
  if (at - known->heard.load(std::memory_order_relaxed) < ticks(kSilence)) return true;
  std::int64_t tried = known->tried.load(std::memory_order_relaxed);
  return at - tried >= ticks(kTryEvery) &&
         known->tried.compare_exchange_strong(tried, at, std::memory_order_relaxed);
}

}  // namespace tfdude::fastdds
