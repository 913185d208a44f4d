// Datagrams of programs that are no participants.

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <unistd.h>
#include <vector>

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

// Resident memory of a process [MiB].
long memory_of(const Process& process) {
  std::ifstream file("/proc/" + std::to_string(process.pid()) + "/statm");
  long total = 0;
  long resident = 0;
  file >> total >> resident;
  return resident * sysconf(_SC_PAGESIZE) / (1024 * 1024);
}

struct TwoDaemons {
  TestDomain domain;
  TemporaryDirectory files;
  Process robot =
      domain.serve(files.write("robot.yaml",
                               "partition: robot\nframes:\n  - {id: base}\n  - {id: hand, parent: "
                               "base, covariance: exact}\n"));
  Process other =
      domain.serve(files.write("other.yaml", "partition: other\nframes:\n  - {id: room}\n"));
};

// The built-in writers of endpoints, and those of the first topics, as Fast DDS numbers them.
std::vector<testing::Entity> writers() {
  std::vector<testing::Entity> all{{0, 0, 3, 0xC2}, {0, 0, 4, 0xC2}};
  for (std::uint8_t number = 1; number <= 12; ++number) {
    for (const std::uint8_t kind : {std::uint8_t{2}, std::uint8_t{3}}) {
      all.push_back({0, 0, number, kind});
    }
  }
  return all;
}

constexpr testing::Entity kAnyReader{0, 0, 0, 0};

}  // namespace

// Without a check, threads of both daemons loop for good: what Fast DDS 2.9 does with such ranges.
TEST_CASE("strangers: huge ranges of sequence numbers silence no daemon") {
  TwoDaemons d;
  const TestDomain& domain = d.domain;
  testing::Stranger stranger(domain.number());
  testing::send_huge_ranges(stranger, stranger.await_participants(2));
  for (int i = 0; i < 3; ++i) {
    CHECK(domain.cli({"lookup", "base", "hand"}).status == 0);
    CHECK(domain.cli({"exists", "room"}).status == 0);
    testing::send_huge_ranges(stranger, stranger.await_participants(2));
  }
  for (Process* daemon : {&d.robot, &d.other}) {
    daemon->signal(SIGTERM);
    CHECK(daemon->wait(testing::Clock::now() + 5s) == 0);
  }
}

// Fast DDS 2.9 allocates a sample when its first fragment comes, and ends by an assertion when its
// number then comes as a whole.
TEST_CASE("strangers: the first fragment of a sample that comes as a whole ends no daemon") {
  TwoDaemons d;
  testing::Stranger stranger(d.domain.number());
  const auto participants = stranger.await_participants(2);
  for (const testing::Prefix& from : participants) {
    for (const testing::Entity& writer : writers()) {
      for (std::uint64_t number = 1; number <= 16; ++number) {
        stranger.send(
            testing::Datagram(from).fragment(kAnyReader, writer, number, 1, 1, 64, 4096, 64));
      }
    }
  }
  // Each of these is a page, and a first one of another daemon a new endpoint.
  int made = 0;
  for (const char* below : {"hand", "room", "hand", "room"}) {
    const std::string id = "tool" + std::to_string(made++);
    CHECK(d.domain.cli({"add", id, "--parent", below}).status == 0);
  }
  CHECK(d.robot.runs());
  CHECK(d.other.runs());
  CHECK(d.domain.cli({"exists", "tool3"}).status == 0);
}

TEST_CASE("strangers: fragments of samples that never end take the memory of what is sent") {
  TwoDaemons d;
  testing::Stranger stranger(d.domain.number());
  const auto participants = stranger.await_participants(2);
  const long before = memory_of(d.robot) + memory_of(d.other);
  constexpr std::uint32_t kSample = 16 << 20;
  for (const testing::Prefix& from : participants) {
    for (const testing::Entity& writer : writers()) {
      for (std::uint64_t number = 1; number <= 16; ++number) {
        stranger.send(
            testing::Datagram(from).fragment(kAnyReader, writer, number, 1, 1, 64, kSample, 64));
      }
    }
  }
  CHECK(d.domain.cli({"lookup", "base", "hand"}).status == 0);
  CHECK(d.domain.cli({"exists", "room"}).status == 0);
  // Each of the 800 samples would take 16 MiB.
  CHECK(memory_of(d.robot) + memory_of(d.other) < before + 100);
}

}  // namespace tfdude
