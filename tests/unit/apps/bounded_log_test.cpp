#include "bounded_log.hpp"

#include <chrono>
#include <memory>
#include <sstream>
#include <string>

#include <spdlog/sinks/ostream_sink.h>

#include "support/catch.hpp"

namespace tfdude::cli {

TEST_CASE("log: lines without end are left out, and their number is told") {
  std::ostringstream text;
  const auto to = std::make_shared<spdlog::sinks::ostream_sink_mt>(text);
  BoundedSink sink(to);
  sink.set_pattern("%v");
  const auto lines = [&] {
    const std::string all = text.str();
    return static_cast<std::uint64_t>(std::count(all.begin(), all.end(), '\n'));
  };
  BoundedSink::Clock::time_point now{std::chrono::hours(1)};
  for (int i = 0; i < 5000; ++i) sink.log({"x", spdlog::level::warn, "again"}, now);
  CHECK(lines() == BoundedSink::kLinesPerMinute);
  now += std::chrono::minutes(1);
  sink.log({"x", spdlog::level::warn, "later"}, now);
  CHECK(lines() == BoundedSink::kLinesPerMinute + 2);
  CHECK(text.str().find("4000 lines of the log were left out\nlater\n") != std::string::npos);
  now += std::chrono::minutes(1);
  sink.log({"x", spdlog::level::warn, "calm"}, now);
  CHECK(lines() == BoundedSink::kLinesPerMinute + 3);
}

}  // namespace tfdude::cli
