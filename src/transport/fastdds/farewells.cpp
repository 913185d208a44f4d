#include "transport/fastdds/farewells.hpp"

#include <algorithm>
#include <utility>

namespace tfdude::fastdds {
namespace {

// RTPS 2.2, sections 9.4.4, 9.4.5.3 and 9.6.3. All numbers have the least byte first.
constexpr std::array<std::uint8_t, 8> kProtocol{'R', 'T', 'P', 'S', 2, 3, 1, 15};
// DATA with inline QoS, without payload; its length; flags; octets to the inline QoS; the reader,
// and the writer, which a participant uses to announce itself.
constexpr std::array<std::uint8_t, 16> kData{0x15, 0x03, 52, 0,    0, 0,    16, 0,
                                             0,    0x01, 0,  0xc7, 0, 0x01, 0,  0xc2};
// Beyond all numbers of its announcements.
constexpr std::array<std::uint8_t, 8> kNumber{0xff, 0xff, 0xff, 0x7f, 0, 0, 0, 0};
constexpr std::array<std::uint8_t, 4> kKeyHash{0x70, 0, 16, 0};
constexpr std::array<std::uint8_t, 4> kParticipant{0, 0, 1, 0xc1};
constexpr std::array<std::uint8_t, 8> kDisposed{0x71, 0, 4, 0, 0, 0, 0, 3};
constexpr std::array<std::uint8_t, 4> kSentinel{1, 0, 0, 0};

}  // namespace

Farewells::Datagram Farewells::farewell_of(const PeerId& peer) {
  Datagram datagram{};
  auto at = datagram.begin();
  const auto put = [&at](const auto& bytes) { at = std::copy(bytes.begin(), bytes.end(), at); };
  put(kProtocol);
  put(peer);
  put(kData);
  put(kNumber);
  put(kKeyHash);
  put(peer);
  put(kParticipant);
  put(kDisposed);
  put(kSentinel);
  return datagram;
}

void Farewells::say_for(const PeerId& peer) {
  const Lock lock(mutex_);
  left_.insert(peer);
  any_ = true;
}

Farewells::When Farewells::when_to_take(Clock::time_point now) {
  const Clock::time_point busy_at{Clock::duration(busy_at_.load(std::memory_order_relaxed))};
  if (now - busy_at >= kQuiet) return When::kNow;
  const Lock lock(mutex_);
  if (!waiting_since_) waiting_since_ = now;
  return now - *waiting_since_ < kPatience ? When::kLater : When::kOnceQuiet;
}

std::set<PeerId> Farewells::take_all() {
  const Lock lock(mutex_);
  waiting_since_.reset();
  any_ = false;
  return std::exchange(left_, {});
}

}  // namespace tfdude::fastdds
