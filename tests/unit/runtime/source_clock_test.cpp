#include "runtime/source_clock.hpp"

#include <thread>

#include "support/catch.hpp"
#include "support/forest_support.hpp"

namespace tfdude {
namespace {

using testing::outcome;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

TEST_CASE("source clock: the system's clock always has a time and cannot be set") {
  SourceClock clock(ClockKind::kSystem);
  const Time before = wall_clock();
  REQUIRE(clock.now());
  CHECK(*clock.now() >= before);
  CHECK(outcome(clock.await(Deadline(Milliseconds(0)))) == "ok");
  CHECK(outcome(clock.set(ms(1))) == "invalid_input");
}

TEST_CASE("source clock: an external clock has no time until it is set") {
  SourceClock clock(ClockKind::kExternal);
  CHECK_FALSE(clock.now());
  CHECK(outcome(clock.await(Deadline(Milliseconds(5)))) == "not_yet");
  CHECK(outcome(clock.set(ms(-1))) == "invalid_input");
  CHECK_FALSE(clock.now());
  CHECK(*clock.set(ms(0)) == std::nullopt);
  CHECK(clock.now() == ms(0));
  CHECK(*clock.set(ms(10)) == std::nullopt);
  CHECK(*clock.set(ms(10)) == std::nullopt);  // it stands still
  CHECK(*clock.set(ms(3)) == ms(10));
  CHECK(clock.now() == ms(3));
}

TEST_CASE("source clock: a thread that waits is woken by the first time") {
  SourceClock clock(ClockKind::kExternal);
  Result<Time> time = fail(Errc::kNotYet, "");
  std::thread waiting([&] { time = clock.await(Deadline(Milliseconds(20000))); });
  REQUIRE(clock.set(ms(7)));
  waiting.join();
  CHECK(time == ms(7));
}

}  // namespace
}  // namespace tfdude
