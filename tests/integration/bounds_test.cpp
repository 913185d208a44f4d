// The time of calls while other daemons hang.

#include <algorithm>
#include <chrono>
#include <csignal>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

#include "support/captured_log.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"
#include "support/thesis.hpp"

namespace tfdude {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using testing::ThesisDaemons;
using Clock = std::chrono::steady_clock;

namespace {

// Lookups in memory would not notice at first that an owner hangs.
Options over_dds(Options options) {
  options.shared_memory = false;
  return options;
}

}  // namespace

TEST_CASE("bounds: a lookup ends at its maximum wait although a daemon hangs") {
  ThesisDaemons d;
  auto client = Client::open(over_dds(d.domain.options())).value();
  REQUIRE(client.lookup("world", "hand_left"));
  // Some before the daemon counts as lost, and some after.
  const std::vector<std::chrono::milliseconds> waits{50ms, 50ms, 200ms, 500ms, 50ms};
  // The shortest of several runs of each wait, because the computer may be busy.
  std::vector<Clock::duration> beyond(waits.size(), Clock::duration::max());
  for (int i = 0; i < 4; ++i) {
    d.arms->freeze();
    for (std::size_t k = 0; k < waits.size(); ++k) {
      const auto start = Clock::now();
      const auto found = client.lookup("world", "hand_left", {}, waits[k]);
      beyond[k] = std::min<Clock::duration>(beyond[k], Clock::now() - start - waits[k]);
      REQUIRE_FALSE(found);
      CHECK((found.error().code == Errc::kTimeout || found.error().code == Errc::kUnreachable));
      CHECK_THAT(found.error().message, ContainsSubstring("'arms'"));
    }
    d.arms->signal(SIGCONT);
    REQUIRE(client.lookup("world", "hand_left", {}, 20'000ms));
  }
  for (std::size_t k = 0; k < waits.size(); ++k) {
    INFO("wait " << k);
    CHECK(beyond[k] < 20ms);
  }
}

// Its caller has given up, and may have done something else instead.
TEST_CASE("bounds: a daemon that hung does not apply what came meanwhile, and then all others") {
  ThesisDaemons d;
  auto client = Client::open(d.domain.options()).value();
  REQUIRE(client.update("hand_left", testing::along_x(1)));
  const std::string parent = client.parent("hand_left").value();
  const auto x = [&] {
    return client.lookup(parent, "hand_left", {}, 20'000ms).value().pose.translation().x();
  };
  d.arms->freeze();
  const auto moved = client.update("hand_left", testing::along_x(2));
  REQUIRE_FALSE(moved);
  CHECK_THAT(moved.error().message, ContainsSubstring("'arms'"));
  const auto added = client.add("late", "world", {}, "arms");
  REQUIRE_FALSE(added);
  // Long enough, whenever it has looked last.
  const auto frozen = Clock::now();
  REQUIRE(testing::eventually([&] { return Clock::now() - frozen > 500ms; }));
  d.arms->signal(SIGCONT);
  CHECK(x() == 1);
  CHECK_FALSE(client.exists("late"));
  CHECK(testing::eventually(
      [&] { return client.update("hand_left", testing::along_x(3)).has_value(); }));
  CHECK(x() == 3);
}

TEST_CASE("bounds: a flush names the daemon that hangs and has not acknowledged") {
  ThesisDaemons d;
  auto client = Client::open(d.domain.options()).value();
  const std::vector<EdgeUpdate> edge{{"hand_left", testing::along_x(1)}};
  REQUIRE(client.publish(edge));
  REQUIRE(client.flush(20'000ms));
  d.arms->freeze();
  REQUIRE(client.publish(edge));
  const auto start = Clock::now();
  const auto at_once = client.flush(50ms);
  CHECK(Clock::now() - start >= 50ms);
  REQUIRE_FALSE(at_once);
  CHECK(at_once.error().code == Errc::kTimeout);
  CHECK_THAT(at_once.error().message, ContainsSubstring("'arms'"));
  REQUIRE(testing::eventually([&] {
    const auto found = client.lookup("world", "hand_left");
    return !found && found.error().code == Errc::kUnreachable;
  }));
  // A flush does not wait for a lost owner.
  const auto gone = Clock::now();
  const auto later = client.flush(20'000ms);
  CHECK(Clock::now() - gone < 10s);
  REQUIRE_FALSE(later);
  CHECK(later.error().code == Errc::kUnreachable);
  d.arms->signal(SIGCONT);
  CHECK(testing::eventually([&] { return client.flush(100ms).has_value(); }));
}

TEST_CASE("bounds: neither a flush nor the end of a client waits for a process that was killed") {
  ThesisDaemons d;
  const testing::CapturedLog log;
  std::optional<Client> client = Client::open(d.domain.options()).value();
  const std::vector<EdgeUpdate> edge{{"hand_left", testing::along_x(1)}};
  const auto publish = [&] { return client->publish(edge).has_value(); };
  REQUIRE(testing::eventually(publish));
  REQUIRE(client->flush(20'000ms));
  const bool killed = GENERATE(true, false);
  d.arms->signal(killed ? SIGKILL : SIGTERM);
  // The last ones are sent to nobody.
  REQUIRE(testing::eventually([&] { return !publish(); }));
  d.arms.reset();
  d.arms.emplace(d.domain.serve(testing::kArmsFile));
  REQUIRE(testing::eventually(publish));
  const auto restarted = Clock::now();
  CHECK(client->flush(20'000ms));
  // DDS keeps the killed process for 30 s.
  CHECK(Clock::now() - restarted < 10s);
  REQUIRE(client->publish({{"hand_left", testing::along_x(2)}}));
  const auto again = Clock::now();
  CHECK(client->flush(20'000ms));
  CHECK(Clock::now() - again < 5s);
  const auto end = Clock::now();
  client.reset();
  CHECK(Clock::now() - end < 5s);
  CHECK(log.count("leaving") == 0);
}

// The process that returns was sent nothing, so it has nothing to acknowledge.
TEST_CASE("bounds: a flush after the return of an owner waits for nothing that came before it") {
  ThesisDaemons d;
  std::optional<Client> client = Client::open(d.domain.options()).value();
  const std::vector<EdgeUpdate> edge{{"hand_left", testing::along_x(7)}};
  REQUIRE(testing::eventually([&] { return client->publish(edge).has_value(); }));
  const auto arrived = [&] {
    const auto X = client->lookup(client->parent("hand_left").value(), "hand_left");
    return X && X->pose.translation().x() == 7;
  };
  REQUIRE(testing::eventually(arrived));
  d.arms->signal(SIGKILL);
  REQUIRE(testing::eventually([&] { return !client->lookup("world", "hand_left"); }));
  d.arms.reset();
  d.arms.emplace(d.domain.serve(testing::kArmsFile));
  REQUIRE(testing::eventually([&] { return client->lookup("world", "hand_left").has_value(); }));
  CHECK(client->flush(10'000ms));
  const auto end = Clock::now();
  client.reset();
  CHECK(Clock::now() - end < 5s);
}

TEST_CASE("bounds: no flush succeeds while another one still waits for an acknowledgement") {
  ThesisDaemons d;
  auto client = Client::open(d.domain.options()).value();
  REQUIRE(client.publish({{"hand_left", testing::along_x(1)}}));
  REQUIRE(client.flush(20'000ms));
  d.arms->freeze();
  REQUIRE(client.publish({{"hand_left", testing::along_x(2)}}));
  auto first = std::async(std::launch::async, [&] { return client.flush(2000ms); });
  // The first one has begun to wait when one of these begins.
  for (int i = 0; i < 4; ++i) {
    const auto meanwhile = client.flush(50ms);
    REQUIRE_FALSE(meanwhile);
    CHECK_THAT(meanwhile.error().message, ContainsSubstring("'arms'"));
  }
  CHECK_FALSE(first.get());
}

TEST_CASE("bounds: a client that has streamed to a hanging daemon still ends") {
  ThesisDaemons d;
  // The end waits 100 ms for streamed values, or as long as `linger` says, up to the time-out.
  Options options = d.domain.options();
  const bool wished = GENERATE(false, true);
  if (wished) {
    options.linger = 10s;
    options.timeout = 150ms;
  }
  std::optional<Client> client = Client::open(options).value();
  const auto publish = [&] {
    return client->publish({{"hand_left", testing::along_x(1)}}).has_value();
  };
  REQUIRE(testing::eventually(publish));
  REQUIRE(client->flush(20'000ms));
  d.arms->freeze();
  REQUIRE(publish());
  const auto start = Clock::now();
  client.reset();
  const auto took = Clock::now() - start;
  CHECK(took >= (wished ? 150ms : 100ms));
  // The rest is what a busy computer may take.
  CHECK(took < 2s);
}

TEST_CASE("bounds: a lookup without a limit succeeds when the daemon resumes") {
  ThesisDaemons d;
  auto client = Client::open(over_dds(d.domain.options())).value();
  REQUIRE(client.lookup("world", "hand_left"));
  d.arms->freeze();
  auto pending = client.lookup_async("world", "hand_left", {}, Milliseconds::max());
  CHECK(pending.wait_for(1s) == std::future_status::timeout);
  d.arms->signal(SIGCONT);
  REQUIRE(pending.wait_for(20s) == std::future_status::ready);
  CHECK(pending.get());
}

}  // namespace tfdude
