// Five owners and three clients, each a process of its own, that call each other all at once.

#include <csignal>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/test_domain.hpp"
#include "support/topology.hpp"

namespace tfdude {
namespace {

using testing::in_time;
using testing::Process;

constexpr int kClients = 3;
constexpr const char* kSeconds = "10";

}  // namespace

TEST_CASE("busy: five owners and three clients call each other without error or deadlock") {
  testing::Random random(10);
  INFO("seed " << random.seed());
  const testing::TestDomain domain;
  const testing::TemporaryDirectory directory;
  const std::string number = std::to_string(domain.number());
  std::vector<Process> processes;
  for (const auto& partition : testing::five_partitions(random, false)) {
    const auto config = directory.write(partition.name + ".yaml", partition.yaml());
    processes.emplace_back(std::vector<std::string>{TFDUDE_BUSY_NODE, number, kSeconds,
                                                    "owner_" + partition.name, config});
  }
  for (int i = 0; i < kClients; ++i) {
    processes.emplace_back(std::vector<std::string>{TFDUDE_BUSY_NODE, number, kSeconds,
                                                    "client_" + std::to_string(i)});
  }
  for (Process& process : processes) {
    const auto done = process.wait_for_line("done ", in_time());
    INFO(process.err());
    REQUIRE(done);
    CHECK(*done != "done calls=0 errors=0");
  }
  // Only now, as each was called until the last had done.
  for (const Process& process : processes) process.signal(SIGTERM);
  for (Process& process : processes) {
    const auto status = process.wait(in_time());
    INFO(process.out() << process.err());
    CHECK(status == 0);
  }
}

}  // namespace tfdude
