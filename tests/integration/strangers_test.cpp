// Datagrams of programs that are no participants.

#include <chrono>
#include <csignal>
#include <cstdio>
#include <string>
#include <unistd.h>

#include "support/catch.hpp"
#include "support/process.hpp"
#include "support/stranger.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;

}  // namespace

// Without a check, threads of both daemons loop for good: what Fast DDS 2.9 does with such ranges.
TEST_CASE("strangers: huge ranges of sequence numbers silence no daemon") {
  const TestDomain domain;
  const TemporaryDirectory files;
  Process robot =
      domain.serve(files.write("robot.yaml",
                               "partition: robot\nframes:\n  - {id: base}\n  - {id: hand, parent: "
                               "base, covariance: exact}\n"));
  Process other =
      domain.serve(files.write("other.yaml", "partition: other\nframes:\n  - {id: room}\n"));
  testing::Stranger stranger(domain.number());
  testing::send_huge_ranges(stranger, stranger.await_participants(2));
  for (int i = 0; i < 3; ++i) {
    CHECK(domain.cli({"lookup", "base", "hand"}).status == 0);
    CHECK(domain.cli({"exists", "room"}).status == 0);
    testing::send_huge_ranges(stranger, stranger.await_participants(2));
  }
  for (Process* daemon : {&robot, &other}) {
    daemon->signal(SIGTERM);
    CHECK(daemon->wait(testing::Clock::now() + 5s) == 0);
  }
}

}  // namespace tfdude
