#include "runtime/deadline.hpp"

#include "support/catch.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using Clock = Deadline::Clock;

const Clock::time_point kNow{1000s};

TEST_CASE("deadline: it ends after the wait and at once for a negative wait") {
  const Deadline deadline(50ms, kNow);
  CHECK(deadline.at() == kNow + 50ms);
  CHECK_FALSE(deadline.over(kNow + 49ms));
  CHECK(deadline.over(kNow + 50ms));
  CHECK(deadline.text() == "50 ms");
  CHECK(Deadline(-1ms, kNow).over(kNow));
  CHECK(Deadline(Milliseconds::min(), kNow).at() == kNow);
}

TEST_CASE("deadline: a wait beyond the clock's range has no end") {
  for (const Clock::time_point now :
       {Clock::time_point(), kNow, Clock::time_point::max() - 1ms, Clock::time_point::max()}) {
    CHECK(Deadline(Milliseconds::max(), now).at() == Clock::time_point::max());
    CHECK(Deadline(Milliseconds::max() - 1ms, now).at() == Clock::time_point::max());
    CHECK(Deadline(0ms, now).at() >= now);
  }
  CHECK_FALSE(Deadline(Milliseconds::max()).over());
}

TEST_CASE("deadline: a deadline within another one never ends later") {
  const Deadline call(50ms, kNow);
  CHECK(call.within(20ms, kNow).at() == kNow + 20ms);
  CHECK(call.within(20ms, kNow).text() == "20 ms");
  CHECK(call.within(20ms, kNow + 40ms).at() == call.at());
  CHECK(call.within(20ms, kNow + 40ms).text() == "50 ms");
  CHECK(call.within(Milliseconds::max(), kNow).at() == call.at());
  CHECK(Deadline(Milliseconds::max(), kNow).within(20ms, kNow).at() == kNow + 20ms);
}

TEST_CASE("deadline: the sum of two waits does not overflow") {
  CHECK(Deadline::sum(20ms, 30ms) == 50ms);
  CHECK(Deadline::sum(Milliseconds::max(), 1ms) == Milliseconds::max());
  CHECK(Deadline::sum(Milliseconds::max(), Milliseconds::max()) == Milliseconds::max());
  CHECK(Deadline::sum(0ms, Milliseconds::max()) == Milliseconds::max());
}

}  // namespace
}  // namespace tfdude
