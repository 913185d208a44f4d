#include <optional>

#include "tfdude/description/config.hpp"

#include "support/catch.hpp"

namespace tfdude {
namespace {

TEST_CASE("a configuration may name the clock of its stamps") {
  CHECK(parse_config("clock: external", "robot.yaml")->clock == ClockKind::kExternal);
  CHECK(parse_config("clock: system", "robot.yaml")->clock == ClockKind::kSystem);
  CHECK(parse_config("partition: a", "robot.yaml")->clock == std::nullopt);
  const auto unknown = parse_config("partition: a\nclock: sun", "robot.yaml");
  REQUIRE_FALSE(unknown);
  CHECK(unknown.error().code == Errc::kInvalidInput);
  CHECK(unknown.error().message == "robot.yaml:2: clock must be system or external, not 'sun'");
}

}  // namespace
}  // namespace tfdude
