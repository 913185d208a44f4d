// Datagrams of programs that are no participants.

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_of.hpp"
#include "support/process.hpp"
#include "support/stranger.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::memory_of;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;

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

// Says to everybody, in the name of each participant, that all its endpoints are gone: Fast DDS
// numbers them from 1. What a writer announces next has a number within the first ones.
void dispose_of_endpoints(testing::Stranger& stranger,
                          const std::vector<testing::Prefix>& participants) {
  constexpr std::uint8_t kEndpoints = 24;
  constexpr std::uint64_t kAnnounced = 128;
  const auto dispose = [&](const testing::Prefix& of, std::uint8_t announcements,
                           std::uint64_t number, std::uint8_t kind) {
    const auto endpoint = static_cast<std::uint8_t>(1 + number % kEndpoints);
    stranger.send(testing::Datagram(of).dispose(
        {0, 0, announcements, 0xC7}, {0, 0, announcements, 0xC2}, number, {0, 0, endpoint, kind}));
  };
  for (const testing::Prefix& of : participants) {
    for (std::uint64_t number = 1; number <= kAnnounced; ++number) {
      const bool has_key = number / kEndpoints % 2 == 0;
      dispose(of, 3, number, has_key ? 2 : 3);
      dispose(of, 4, number, has_key ? 7 : 4);
    }
  }
}

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

// Without the comparison of endpoints, daemons and clients exchange nothing more.
TEST_CASE("strangers: who says that endpoints of others are gone cuts nobody off") {
  TwoDaemons d;
  testing::Stranger stranger(d.domain.number());
  auto client = Client::open(d.domain.options()).value();
  const auto participants = stranger.await_participants(3);
  auto stream = client.stream({"hand"}).value();
  const auto watch = client.watch("base", "hand").value();
  for (int i = 0; i < 2; ++i) {
    REQUIRE(client.add("tool" + std::to_string(2 * i), "hand", {}));
    dispose_of_endpoints(stranger, participants);
    const auto begin = testing::Clock::now();
    CHECK(client.add("tool" + std::to_string(2 * i + 1), "hand", {}));
    CHECK(client.add("chair" + std::to_string(i), "room", {}));
    const std::chrono::duration<double> waited = testing::Clock::now() - begin;
    INFO("it took " << waited.count() << " s");
    CHECK(waited < 5s);  // about one, and more on a busy machine
    const auto X_BH = testing::along_x(i + 1);
    CHECK(testing::eventually([&] {
      (void)stream.try_publish({X_BH});
      return testing::x_of(watch.latest()) == i + 1;
    }));
  }
}

}  // namespace tfdude
