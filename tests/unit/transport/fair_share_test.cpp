#include "transport/fastdds/fair_share.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "support/captured_log.hpp"
#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

using namespace std::chrono_literals;

constexpr FairShare::Sender kFlood = 1;
constexpr FairShare::Sender kOther = 2;

/// A thread that handles messages one after the other, each of which takes so long.
struct Thread {
  // Later than in other tests: the load is of the thread of the test.
  FairShare::Clock::time_point now = last += std::chrono::hours(1);
  static inline FairShare::Clock::time_point last{};
  static inline long waits = 0;
  FairShare::Clock::time_point ended{};
  bool preempted = false;  // in each gap, instead of waiting
  FairShare shares;

  bool handle(FairShare::Sender sender, std::chrono::microseconds time,
              std::chrono::microseconds gap, bool has_message = true) {
    now += gap;
    if (now - ended > FairShare::kGap && !preempted) ++waits;
    FairShare::begin(now, waits);
    const bool admitted = shares.admits(sender, now);
    if (admitted) {
      if (has_message) FairShare::has_message();
      now += time;
      shares.spent(sender, time, now);
    } else {
      now += 2us;
    }
    FairShare::end(ended = now, waits);
    return admitted;
  }
};

TEST_CASE("fair share: a sender may use all of a thread that is idle in between") {
  Thread thread;
  for (int i = 0; i < 20'000; ++i) CHECK(thread.handle(kFlood, 20us, 20us));
  CHECK(thread.shares.dropped() == 0);
}

TEST_CASE("fair share: a flood gets half of the time, and others are never dropped") {
  Thread thread;
  const auto start = thread.now;
  auto spent = 0us;
  for (int i = 0; i < 100'000; ++i) {
    if (thread.handle(kFlood, 20us, 1us)) spent += 20us;
    if (i % 100 == 0) CHECK(thread.handle(kOther, 20us, 1us));
  }
  const double share = std::chrono::duration<double>(spent) / (thread.now - start);
  CHECK(share > 0.3);
  CHECK(share < 0.6);
  CHECK(thread.shares.dropped() > 0);
}

TEST_CASE("fair share: a lone sender may use nearly all of a thread") {
  Thread thread;
  const auto start = thread.now;
  auto spent = 0us;
  for (int i = 0; i < 100'000; ++i) {
    if (thread.handle(kFlood, 20us, 1us)) spent += 20us;
  }
  CHECK(std::chrono::duration<double>(spent) / (thread.now - start) > 0.9);
  // In between, those are noticed whose datagrams found no room in the queue.
  CHECK(thread.shares.dropped() > 1000);
}

TEST_CASE("fair share: the log names who takes more than its share, and no lone sender") {
  const testing::CapturedLog captured;
  const FairShare::Sender flood = FairShare::Sender{0x0200007F} << 32U | 7411;  // 127.0.0.2
  const auto run = [&](Thread& thread, bool beside, std::chrono::microseconds time,
                       std::chrono::microseconds gap) {
    for (int i = 0; i < 20'000; ++i) {
      (void)thread.handle(flood, time, gap);
      if (beside && i % 100 == 0) (void)thread.handle(kOther, 20us, gap);
    }
    REQUIRE(thread.shares.dropped() > 0);
  };
  Thread alone;
  run(alone, false, 20us, 1us);
  CHECK(captured.text().empty());
  Thread crowded;
  run(crowded, true, 20us, 1us);
  CHECK(captured.count("senders take more than their share while others wait, now 127.0.0.2:7411 "
                       "(datagrams dropped until now: 1)") == 1);
  CHECK(captured.count("\n") == 1);
  const std::uint64_t before = crowded.shares.dropped();
  crowded.now += FairShare::kLogEvery;
  run(crowded, true, 20us, 1us);
  CHECK(captured.count("now 127.0.0.2:7411") == 2);
  CHECK(captured.count("until now: " + std::to_string(before) + ")") == 1);
}

TEST_CASE("fair share: a thread whose processor others take is as busy as before") {
  Thread thread;
  (void)thread.handle(kOther, 20us, 1us);
  thread.preempted = true;
  for (int i = 0; i < 20'000; ++i) {
    const auto gap = i % 10 == 0 ? 100us : 1us;
    (void)thread.handle(kFlood, 20us, gap);
    if (i % 100 == 0) CHECK(thread.handle(kOther, 20us, gap));
  }
  CHECK(thread.shares.dropped() > 0);
}

TEST_CASE("fair share: what is no message has an allowance") {
  Thread thread;
  // Nearly a second.
  for (int i = 0; i < 49'000; ++i) {
    CHECK(thread.handle(kFlood, 20us, 1us, false));
    if (i % 100 == 0) CHECK(thread.handle(kOther, 20us, 1us));
  }
  CHECK(thread.shares.dropped() == 0);
  const auto start = thread.now;
  auto spent = 0us;
  for (int i = 0; i < 100'000; ++i) {
    if (thread.handle(kFlood, 20us, 1us, false)) spent += 20us;
    if (i % 100 == 0) CHECK(thread.handle(kOther, 20us, 1us));
  }
  const double share = std::chrono::duration<double>(spent) / (thread.now - start);
  CHECK(share > 0.3);
  CHECK(share < 0.75);
  // The allowance has grown again.
  thread.now += 10s;
  for (int i = 0; i < 40'000; ++i) {
    CHECK(thread.handle(kFlood, 20us, 1us, false));
    if (i % 100 == 0) CHECK(thread.handle(kOther, 20us, 1us));
  }
}

TEST_CASE("fair share: the allowance grows beside messages, too") {
  Thread thread;
  constexpr auto kEach = 20us;
  for (int i = 0; i < 50'000; ++i) (void)thread.handle(kFlood, kEach, 1us, false);  // it is spent
  for (int i = 0; i < 10'000; ++i) CHECK(thread.handle(kFlood, kEach, 1ms));        // for 10 s
  for (int i = 0; i < 40'000; ++i) {
    CHECK(thread.handle(kFlood, kEach, 1us, false));
    if (i % 100 == 0) CHECK(thread.handle(kOther, kEach, 1us));
  }
}

TEST_CASE("fair share: a flood of ever new senders takes no memory, and forgets no flood") {
  Thread thread;
  for (FairShare::Sender i = 0; i < 100'000; ++i) {
    (void)thread.handle(kFlood, 20us, 1us);
    (void)thread.handle(kOther + i, 1us, 1us);
  }
  // The other senders need little, so that it is the only heavy one.
  CHECK(thread.shares.dropped() > 10'000);
}

// The share of a sender of costly messages that pauses for so long after each, beside another one
// that sends each 10 ms, and how many of this one's were dropped.
struct Paused {
  double share = 0;
  int dropped = 0;
};
Paused beside_pauses(std::chrono::milliseconds cost, std::chrono::milliseconds pause) {
  Thread thread;
  Paused result;
  const auto start = thread.now;
  auto spent = 0ms;
  auto next_other = thread.now;
  const auto others = [&] {
    for (; next_other <= thread.now; next_other += 10ms) {
      if (!thread.handle(kOther, 20us, 1us)) ++result.dropped;
    }
  };
  while (thread.now - start < 60s) {
    // What was dropped is repeated.
    if (thread.handle(kFlood, cost, 100us)) spent += cost;
    const auto again = thread.now + pause;
    others();
    for (; thread.now < again; thread.now += 1ms) others();
  }
  result.share = std::chrono::duration<double>(spent) / (thread.now - start);
  return result;
}

// Before, what it took was forgotten after 140 ms, however much that was.
TEST_CASE("fair share: who pauses between costly messages pays them back") {
  for (const auto cost : {30ms, 100ms, 400ms}) {
    for (const auto pause : {1ms, 20ms, 150ms}) {
      CAPTURE(cost.count(), pause.count());
      const Paused one = beside_pauses(cost, pause);
      CHECK(one.share < 0.57);
      CHECK(one.dropped == 0);
    }
  }
  CHECK(beside_pauses(400ms, 100ms).share > 0.4);
}

TEST_CASE("fair share: costly messages are not dropped while their sender is within its share") {
  for (const auto cost : {10ms, 100ms, 200ms}) {
    CAPTURE(cost.count());
    const double share = beside_pauses(cost, 2 * cost).share;
    CHECK(share > 0.3);
  }
}

// Before, one of eight was dropped for ten seconds, with all that it repeated.
TEST_CASE("fair share: who sends many small messages is handled again soon, however many do") {
  Thread thread;
  constexpr std::size_t kSenders = 8;
  std::array<FairShare::Clock::time_point, kSenders> last{};
  last.fill(thread.now);
  FairShare::Clock::duration longest{0};
  const auto start = thread.now;
  for (std::size_t i = 0; thread.now - start < 30s; ++i) {
    // One after the other sends the most.
    const std::size_t one = (i % 4 == 0 ? i / 4 : i / 20'000) % kSenders;
    // Some are interrupted.
    const auto time = i % 50 == 0 ? 4ms : 100us;
    if (!thread.handle(kFlood + one, time, 1us)) continue;
    longest = std::max(longest, thread.now - std::exchange(last[one], thread.now));
  }
  CHECK(thread.shares.dropped() > 1000);
  CHECK(longest < 200ms);
}

TEST_CASE("fair share: what was taken alone is not owed") {
  Thread thread;
  for (int i = 0; i < 600; ++i) CHECK(thread.handle(kFlood, 100ms, 100us));
  CHECK(thread.handle(kOther, 20us, 1us));
  thread.now += 60ms;
  CHECK(thread.handle(kFlood, 100ms, 100us));
  CHECK(thread.shares.dropped() == 0);
}

TEST_CASE("fair share: a flood that ends is forgotten") {
  Thread thread;
  for (int i = 0; i < 100'000; ++i) {
    (void)thread.handle(kFlood, 20us, 1us);
    if (i % 1000 == 0) (void)thread.handle(kOther, 20us, 1us);
  }
  CHECK_FALSE(thread.handle(kFlood, 20us, 1us));
  thread.now += 500ms;
  for (int i = 0; i < 100; ++i) CHECK(thread.handle(kFlood, 20us, 1us));
}

}  // namespace
}  // namespace tfdude::fastdds
