// How long calls take beside daemons that hang.

#include <algorithm>
#include <chrono>
#include <csignal>
#include <future>
#include <string>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
#include "support/test_domain.hpp"
#include "support/thesis.hpp"

namespace tfdude {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using testing::ThesisDaemons;
using Clock = std::chrono::steady_clock;

TEST_CASE("bounds: beside a daemon that hangs a lookup waits no longer than it may") {
  ThesisDaemons d;
  auto client = *Client::open(d.domain.options());
  REQUIRE(client.lookup("world", "hand_left"));
  auto best = Clock::duration::max();
  for (int i = 0; i < 4; ++i) {
    d.arms->freeze();
    // Until it counts as gone, and then.
    for (const auto wait : {50ms, 50ms, 200ms, 500ms}) {
      const auto start = Clock::now();
      const auto found = client.lookup("world", "hand_left", {}, wait);
      best = std::min<Clock::duration>(best, Clock::now() - start - wait);
      REQUIRE_FALSE(found);
      CHECK((found.error().code == Errc::kTimeout || found.error().code == Errc::kUnreachable));
      CHECK_THAT(found.error().message, ContainsSubstring("'arms'"));
    }
    d.arms->signal(SIGCONT);
    REQUIRE(client.lookup("world", "hand_left", {}, 20'000ms));
  }
  CHECK(best < 20ms);
}

TEST_CASE("bounds: a lookup without end goes on once the daemon does") {
  ThesisDaemons d;
  auto client = *Client::open(d.domain.options());
  REQUIRE(client.lookup("world", "hand_left"));
  d.arms->freeze();
  auto pending = client.lookup_async("world", "hand_left", {}, Milliseconds::max());
  CHECK(pending.wait_for(1s) == std::future_status::timeout);
  d.arms->signal(SIGCONT);
  REQUIRE(pending.wait_for(20s) == std::future_status::ready);
  CHECK(pending.get());
}

}  // namespace tfdude
