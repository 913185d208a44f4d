#include "transport/fastdds/datagram_guard.hpp"

#include "base/log.hpp"

namespace tfdude::fastdds {
namespace {

using Clock = DatagramGuard::Clock;

class Received final : public NumberClaims {
 public:
  Received(NumberBounds& bounds, Clock::time_point now) : bounds_(bounds), now_(now) {}
  bool admit(const NumberClaim& claim) override { return bounds_.admit(claim, now_); }

 private:
  NumberBounds& bounds_;
  const Clock::time_point now_;
};

class Sent final : public NumberClaims {
 public:
  explicit Sent(NumberBounds& bounds) : bounds_(bounds) {}
  bool admit(const NumberClaim& claim) override {
    bounds_.send(claim);
    return true;
  }

 private:
  NumberBounds& bounds_;
};

}  // namespace

DatagramFlaw DatagramGuard::check(const std::uint8_t* datagram, std::size_t size,
                                  Clock::time_point now) {
  Received claims(bounds_, now);
  return check_datagram(datagram, size, secured_, claims);
}

void DatagramGuard::send(const std::uint8_t* datagram, std::size_t size) {
  if (!sees_sent_) return;
  Sent claims(bounds_);
  for_each_heartbeat(datagram, size, claims);
}

bool DatagramGuard::count(DatagramFlaw flaw, Clock::time_point now) {
  Kind& kind = kinds_[static_cast<std::size_t>(flaw)];
  kind.count.fetch_add(1, std::memory_order_relaxed);
  const Clock::rep time = now.time_since_epoch().count();
  Clock::rep before = kind.logged.load(std::memory_order_relaxed);
  if (before != 0 && time - before < Clock::duration(kLogEvery).count()) return false;
  return kind.logged.compare_exchange_strong(before, time);
}

void DatagramGuard::log(DatagramFlaw flaw, const std::string& from) const {
  const auto& kind = kinds_[static_cast<std::size_t>(flaw)];
  tfdude::log().warn("dropped a datagram from {}: {} ({} so far)", from, to_string(flaw),
                     kind.count.load(std::memory_order_relaxed));
}

std::uint64_t DatagramGuard::refused() const {
  std::uint64_t sum = 0;
  for (const Kind& kind : kinds_) sum += kind.count.load(std::memory_order_relaxed);
  return sum;
}

}  // namespace tfdude::fastdds
