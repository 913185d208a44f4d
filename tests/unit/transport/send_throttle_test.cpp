#include "transport/fastdds/send_throttle.hpp"

#include <memory>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kHost = 0x0A4D0001;
constexpr std::uint32_t kPort = 7411;
constexpr std::uint32_t kOther = 0x0A4D0002;

}  // namespace

TEST_CASE("throttle: a silent host gets single datagrams until it is heard again") {
  const auto reach = std::make_unique<SendThrottle>();
  const auto start = SendThrottle::Clock::now();
  const auto after = [start](int ms) { return start + milliseconds(ms); };
  reach->heard(kHost, start);
  reach->heard(kOther, after(900));
  for (int i = 0; i < 3; ++i) CHECK(reach->may_send(kHost, kPort, after(499)));
  CHECK(reach->may_send(kHost, kPort, after(1000)));
  CHECK_FALSE(reach->may_send(kHost, kPort, after(1000)));
  CHECK_FALSE(reach->may_send(kHost, kPort, after(1049)));
  CHECK(reach->may_send(kHost, kPort + 1, after(1049)));  // another who listens there
  CHECK(reach->may_send(kHost, kPort, after(1050)));
  for (int i = 0; i < 3; ++i) CHECK(reach->may_send(kOther, kPort, after(1000)));
  reach->heard(kHost, after(1060));
  for (int i = 0; i < 3; ++i) CHECK(reach->may_send(kHost, kPort, after(1061)));
}

TEST_CASE("throttle: a host that was never heard gets the time to answer") {
  const auto reach = std::make_unique<SendThrottle>();
  const auto start = SendThrottle::Clock::now();
  for (int i = 0; i < 3; ++i) CHECK(reach->may_send(kHost, kPort, start + milliseconds(i)));
  CHECK(reach->may_send(kHost, kPort, start + milliseconds(600)));
  CHECK_FALSE(reach->may_send(kHost, kPort, start + milliseconds(601)));
}

TEST_CASE("throttle: hosts beyond the capacity get all datagrams") {
  const auto reach = std::make_unique<SendThrottle>();
  const auto start = SendThrottle::Clock::now();
  for (std::uint32_t i = 0; i < 512; ++i) reach->heard(kHost + i, start);
  const auto late = start + milliseconds(1000);
  for (std::uint32_t i = 0; i < 512; ++i) {
    CHECK(reach->may_send(kHost + i, kPort, late));
    CHECK_FALSE(reach->may_send(kHost + i, kPort, late));
  }
  for (int i = 0; i < 3; ++i) CHECK(reach->may_send(kHost + 512, kPort, late));
}

}  // namespace tfdude::fastdds
