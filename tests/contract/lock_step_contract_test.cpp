// Simulators that advance the time of all owners step by step.

#include <memory>
#include <type_traits>
#include <utility>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/networks.hpp"
#include "support/relay.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;

// A network that loses the first times that are published.
class LosesTime final : public testing::Relay {
 public:
  LosesTime(TransportPtr real, int& to_lose) : Relay(std::move(real)), to_lose_(to_lose) {}

  Result<void> publish_clock(Time now) override {
    if (to_lose_ == 0) return Relay::publish_clock(now);
    --to_lose_;
    return {};
  }

 private:
  int& to_lose_;
};

// Wall time does not compile as the time of a simulation.
template <class T>
using Advance = decltype(std::declval<Client&>().advance_to(std::declval<T>(), 1ms));
template <class T, class = void>
constexpr bool kAdvances = false;
template <class T>
constexpr bool kAdvances<T, std::void_t<Advance<T>>> = true;
static_assert(kAdvances<ExternalTime>);
static_assert(!kAdvances<Time> && !kAdvances<std::chrono::steady_clock::time_point>);
static_assert(!std::is_convertible_v<Time, ExternalTime> &&
              !std::is_convertible_v<ExternalTime, Time>);

}  // namespace

TEST_CASE("a simulator advances the time of all owners in lock-step") {
  const testing::Join join = testing::joined_by(GENERATE(from_range(testing::networks())));
  Options external;
  external.clock = ClockKind::kExternal;
  Node base = Node::open(join("base"), "base", {{"world", "", {}}}, external).value();
  Node arm = Node::open(join("arm"), "arm", {{"hand", "world", {}}}, external).value();
  Node camera = Node::open(join("camera"), "camera", {{"lens", "world", {}}}).value();
  Client simulator = Client::open(join(""), external).value();
  for (const auto t : {0ms, 20ms, 40ms, 10ms, 50ms}) {  // also back
    const ExternalTime now(t);
    REQUIRE(simulator.advance_to(now, 10s));
    // At once, without waiting.
    CHECK(base.now() == stamp_of(now));
    CHECK(arm.now() == stamp_of(now));
    CHECK(simulator.now() == stamp_of(now));
    CHECK(arm.wait_until(now, 0ms));
  }
  CHECK(simulator.advance_to(ExternalTime(-1ms), 10s).error().code == Errc::kInvalidInput);
}

TEST_CASE("a time that is lost is sent again, and an owner that does not get it is named") {
  const testing::Join join = testing::join_loopback();
  Options external;
  external.clock = ClockKind::kExternal;
  Node arm = Node::open(join("arm"), "arm", {{"hand", "", {}}}, external).value();
  int to_lose = 3;
  Client simulator = Client::open(std::make_unique<LosesTime>(join(""), to_lose), external).value();
  REQUIRE(simulator.advance_to(ExternalTime(1s), 10s));
  CHECK(to_lose == 0);
  CHECK(arm.now() == stamp_of(ExternalTime(1s)));
  to_lose = 1 << 30;
  const auto lost = simulator.advance_to(ExternalTime(2s), 30ms);
  REQUIRE_FALSE(lost);
  CHECK(lost.error().code == Errc::kTimeout);
  CHECK(lost.error().partition == "arm");
  CHECK(arm.now() == stamp_of(ExternalTime(1s)));
}

}  // namespace tfdude
