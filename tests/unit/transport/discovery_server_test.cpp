#include <string>

#include "tfdude/transport/fastdds.hpp"

#include "support/catch.hpp"

namespace tfdude {

TEST_CASE("discovery server: an address is a host and a port") {
  for (const char* good : {"10.0.0.1:11811", "robot:1", "base.robot.local:65535"}) {
    CHECK(check_discovery_server(good));
    CHECK(make_fastdds_transport({0, "", "", nullptr, good}));
  }
}

TEST_CASE("discovery server: an invalid address is rejected by name") {
  for (const std::string bad : {"robot", "robot:", ":11811", "robot:0", "robot:65536", "robot:-1",
                                "robot:11811x", "two words:1", "[::1]:11811", "::1:11811"}) {
    INFO(bad);
    const auto checked = check_discovery_server(bad);
    REQUIRE_FALSE(checked);
    CHECK(checked.error().code == Errc::kInvalidInput);
    CHECK_THAT(checked.error().message, testing::ContainsSubstring("'" + bad + "'"));
    CHECK_FALSE(make_fastdds_transport({0, "", "", nullptr, bad}));
  }
}

}  // namespace tfdude
