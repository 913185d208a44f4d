// Programs that exit while a client is open.

#include <string>

#include "support/catch.hpp"
#include "support/thesis.hpp"

namespace tfdude {

TEST_CASE("exit: clients and nodes that are still open end with the process") {
  const testing::TestDomain domain;
  const testing::Process robot = domain.serve(testing::kRobotFile);
  const std::string how = GENERATE("exit", "exit in a callback", "optional", "unique", "watch",
                                   "node", "after loopback", "after an error");
  INFO(how);
  testing::Process program(
      {TFDUDE_EXIT_NODE, std::to_string(domain.number()), TFDUDE_LOOPBACK_PROFILE, how});
  const testing::CliResult result = testing::finish(program);
  INFO(result.err);
  CHECK(result.status == 0);
  CHECK(result.err.empty());
}

}  // namespace tfdude
