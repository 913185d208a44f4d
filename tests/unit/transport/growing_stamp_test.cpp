#include "transport/fastdds/growing_stamp.hpp"

#include "support/catch.hpp"

namespace tfdude::fastdds {

TEST_CASE("source timestamps follow the clock and grow even if it is set back") {
  GrowingStamp stamp;
  CHECK(stamp.next(5'000'000) == 5'000'000);
  CHECK(stamp.next(9'000'000) == 9'000'000);
  CHECK(stamp.next(9'000'000) > 9'000'000);
  std::int64_t before = stamp.next(9'000'000);
  for (const std::int64_t clock : {1'000'000, 2'000'000, -7, 8'999'999}) {
    const std::int64_t now = stamp.next(clock);
    CHECK(now > before);
    CHECK(now < 10'000'000);
    before = now;
  }
  CHECK(stamp.next(20'000'000) == 20'000'000);
}

}  // namespace tfdude::fastdds
