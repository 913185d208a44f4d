#include "tfdude/base/time.hpp"

#include "support/catch.hpp"

namespace tfdude {

TEST_CASE("a time is printed in UTC with milliseconds") {
  CHECK(to_string(Time(std::chrono::nanoseconds(1'700'000'000'123'456'789))) ==
        "2023-11-14 22:13:20.123 UTC");
  CHECK(to_string(Time(std::chrono::nanoseconds(-1))) == "1969-12-31 23:59:59.999 UTC");
}

}  // namespace tfdude
