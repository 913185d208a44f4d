#include "tfdude/base/time.hpp"

#include "support/catch.hpp"

namespace tfdude {

TEST_CASE("a time is printed in UTC with milliseconds") {
  CHECK(to_string(Time(std::chrono::nanoseconds(1'700'000'000'123'456'789))) ==
        "2023-11-14 22:13:20.123 UTC");
  CHECK(to_string(Time(std::chrono::nanoseconds(-1))) == "1969-12-31 23:59:59.999 UTC");
}

TEST_CASE("durations are printed in the unit that fits") {
  const auto text = [](double seconds) {
    return readable(std::chrono::nanoseconds(static_cast<std::int64_t>(seconds * 1e9)));
  };
  CHECK(text(0.25) == "250.000 ms");
  CHECK(text(2.75) == "2.750 s");
  CHECK(text(-15.25) == "-15.2 s");
  CHECK(text(210) == "3.5 min");
  CHECK(text(25'200) == "7.0 h");
  CHECK(text(216'000) == "2.5 days");
}

TEST_CASE("stamps of a clock that started at zero are printed in seconds") {
  CHECK(readable(Time()) == "0.000 s");
  CHECK(readable(Time(std::chrono::milliseconds(15'200))) == "15.200 s");
  CHECK(readable(Time(std::chrono::seconds(1'700'000'000))) == "2023-11-14 22:13:20.000 UTC");
}

}  // namespace tfdude
