#include "base/loop.hpp"

#include <atomic>
#include <chrono>
#include <future>

#include "support/catch.hpp"
#include "support/no_threads.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;

constexpr auto kSoon = 20s;

}  // namespace

TEST_CASE("loop: without a thread, to begin is an error that names it") {
  Loop loop("tfdude-test");
  {
    const testing::NoThreads none;
    const auto begun = loop.begin();
    REQUIRE_FALSE(begun);
    CHECK(begun.error().code == Errc::kTransport);
    CHECK_THAT(begun.error().message, ContainsSubstring("'tfdude-test'"));
  }
  CHECK(loop.begin());
  CHECK(loop.begin());
  loop.stop();
  CHECK(loop.begin());
}

TEST_CASE("loop: what was asked for without a thread runs once there is one") {
  Loop loop("tfdude-test");
  std::promise<void> soon;
  std::promise<void> timed;
  std::atomic<int> runs{0};
  Loop::Job first(loop, [&] {
    if (++runs == 1) soon.set_value();
    return Loop::kNever;
  });
  Loop::Job second(loop, [&] {
    timed.set_value();
    return Loop::kNever;
  });
  {
    const testing::NoThreads none;
    first.ask();
    second.ask_by(Loop::Clock::now());
    first.ask();
  }
  SECTION("with the next request") { first.ask(); }
  SECTION("when it is begun") { CHECK(loop.begin()); }
  CHECK(soon.get_future().wait_for(kSoon) == std::future_status::ready);
  CHECK(timed.get_future().wait_for(kSoon) == std::future_status::ready);
  loop.stop();
  CHECK(runs >= 1);
}

}  // namespace tfdude
