// Messages and behaviour of a daemon while its disk is full or slow.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/small_disk.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::await_ready;
using testing::Clock;
using testing::ContainsSubstring;
using testing::eventually;
using testing::outcome;
using testing::Process;
using testing::SmallDisk;
using testing::TemporaryDirectory;
using testing::TestDomain;
using testing::x_of;

constexpr const char* kArms = R"(partition: arms
frames:
  - {id: arm}
  - {id: hand, parent: arm, xyz: [10, 0, 0]}
)";

// A daemon that keeps its state on a disk, and can be killed and started again.
struct Arms {
  explicit Arms(const SmallDisk& disk)
      : arguments{"--config", files.write("arms.yaml", kArms), "--state", disk.path()},
        daemon(domain.start_daemon(arguments)) {
    await_ready(*daemon);
  }

  void restart() {
    daemon->kill();
    daemon.emplace(domain.start_daemon(arguments));
    await_ready(*daemon);
  }

  TestDomain domain;
  TemporaryDirectory files;
  std::vector<std::string> arguments;
  std::optional<Process> daemon;
};

// Adds frames until the owner takes no more. @return those that were acknowledged
std::vector<std::string> add_until_full(Client& client, const std::string& name,
                                        std::string& refused) {
  std::vector<std::string> there;
  for (int i = 0; i < 1000; ++i) {
    refused = name + std::to_string(i);
    const auto added = client.add(refused, "hand", along_x(i));
    if (added) {
      there.push_back(refused);
      continue;
    }
    CHECK(added.error().code == Errc::kState);
    CHECK_THAT(added.error().message, ContainsSubstring("accepts no changes until it can store"));
    CHECK_THAT(added.error().message, ContainsSubstring("no room on its disk"));
    break;
  }
  return there;
}

// The longest time in which no new streamed value became visible to lookups.
Clock::duration longest_silence(Client& client, const std::atomic<bool>& stop) {
  Clock::duration longest{0};
  auto last = Clock::now();
  for (int i = 1; !stop; ++i) {
    (void)client.publish({{"hand", along_x(i)}});
    while (!stop && x_of(client.lookup("arm", "hand")) != i) {
      (void)client.publish({{"hand", along_x(i)}});
    }
    longest = std::max(longest, Clock::now() - last);
    last = Clock::now();
  }
  return longest;
}

}  // namespace

TEST_CASE("storing: changes that a full disk would not take are not made") {
  const SmallDisk disk(700);
  if (!disk.mounted()) {
    WARN("SKIPPED: " << disk.missing());
    return;
  }
  Arms arms(disk);
  const TestDomain& domain = arms.domain;
  auto client = Client::open(domain.options()).value();
  REQUIRE(client.add("kept", "hand", {}));
  REQUIRE(client.add("gone", "hand", {}));
  REQUIRE(client.remove("gone"));
  disk.fill();
  std::string refused;
  auto there = add_until_full(client, "f", refused);

  const auto removal = domain.cli({"remove", "kept"});
  CHECK(removal.status == 1);
  CHECK(removal.out.empty());
  CHECK_THAT(removal.err, ContainsSubstring("accepts no changes until it can store"));
  CHECK_THAT(removal.err, ContainsSubstring("no room on its disk"));
  CHECK(outcome(client.remove("kept")) == "state");
  CHECK(outcome(client.move("kept", "arm")) == "state");
  CHECK(outcome(client.update("kept", along_x(3))) == "state");
  CHECK(outcome(client.add(refused, "hand", {})) == "state");
  auto joiner = Client::open(domain.options()).value();
  CHECK_FALSE(joiner.exists(refused));
  CHECK(joiner.exists("kept"));
  CHECK(x_of(joiner.lookup("arm", "kept")) == 10);

  disk.make_room();
  SECTION("they are taken once there is room") {
    CHECK(eventually([&] { return client.remove("kept").has_value(); }));
    CHECK_FALSE(joiner.exists(refused));
    REQUIRE(client.add(refused, "hand", {}));
    there.push_back(refused);
  }
  SECTION("what was taken survives the end of the process") {}
  arms.restart();
  for (const std::string& id : there) CHECK(eventually([&] { return client.exists(id); }));
  auto fresh = Client::open(domain.options()).value();
  CHECK_FALSE(fresh.exists("gone"));
}

TEST_CASE("storing: whoever looks finds a frame whose move or removal is rejected") {
  const SmallDisk disk(700);
  if (!disk.mounted()) {
    WARN("SKIPPED: " << disk.missing());
    return;
  }
  Arms arms(disk);
  auto client = Client::open(arms.domain.options()).value();
  auto other = Client::open(arms.domain.options()).value();
  REQUIRE(client.add("tool", "hand", along_x(1)));
  REQUIRE(client.add("cup", "tool", along_x(1)));
  disk.fill();
  bool below_arm = false;
  int frames = 0;
  const auto refused = [&] {
    const auto moved = client.move("tool", below_arm ? "hand" : "arm");
    if (!moved) return true;
    below_arm = !below_arm;
    // Moves alone need no room.
    return !client.add("f" + std::to_string(frames++), "hand", {}).has_value();
  };
  while (!refused()) REQUIRE(frames < 1000);
  for (int i = 0; i < 3; ++i) {
    CHECK(outcome(client.move("tool", below_arm ? "hand" : "arm")) == "state");
    CHECK(outcome(client.remove("tool")) == "state");
    CHECK(eventually([&] { return x_of(other.lookup("arm", "cup")) == (below_arm ? 2 : 12); }));
    CHECK(x_of(other.lookup("arm", "cup")) == (below_arm ? 2 : 12));
  }
  disk.make_room();
  CHECK(eventually([&] { return client.remove("tool").has_value(); }));
  CHECK(eventually([&] { return !other.exists("cup"); }));
}

TEST_CASE("storing: a rejected removal has not happened after a kill") {
  const SmallDisk disk(700);
  if (!disk.mounted()) {
    WARN("SKIPPED: " << disk.missing());
    return;
  }
  Arms arms(disk);
  auto client = Client::open(arms.domain.options()).value();
  disk.fill();
  int acknowledged = 0;
  std::string last;
  // Each removal is the first change that may meet the full disk.
  for (int i = 0; i < 1000; ++i) {
    const auto removed = client.remove("hand");
    if (!removed) {
      last = "hand";
      CHECK(removed.error().code == Errc::kState);
      break;
    }
    if (!client.add("hand", "arm", along_x(10))) break;
    ++acknowledged;
  }
  INFO(acknowledged << " removals were stored");
  disk.make_room();
  arms.restart();
  auto fresh = Client::open(arms.domain.options()).value();
  CHECK(fresh.exists("hand") == (last == "hand"));
}

#ifdef TFDUDE_SLOW_SYNC
Process start_on_slow_disk(const TestDomain& domain, const TemporaryDirectory& files,
                           const std::string& sync_ms, const std::vector<std::string>& more) {
  std::vector<std::string> command{"/usr/bin/env",
                                   "LD_PRELOAD=" TFDUDE_SLOW_SYNC,
                                   "TFDUDE_SYNC_MS=" + sync_ms,
                                   TFDUDE_DAEMON,
                                   "--config",
                                   files.write("arms.yaml", kArms),
                                   "--state",
                                   files.path(),
                                   "--domain",
                                   std::to_string(domain.number()),
                                   "--profile",
                                   TFDUDE_LOOPBACK_PROFILE};
  command.insert(command.end(), more.begin(), more.end());
  Process daemon(command);
  await_ready(daemon);
  return daemon;
}
#endif

TEST_CASE("storing: with --sync a change is acknowledged after the disk has synced it") {
#ifndef TFDUDE_SLOW_SYNC
  WARN("SKIPPED: a library cannot be preloaded into a program with sanitizers");
#else
  const TestDomain domain;
  const TemporaryDirectory files;
  Process daemon = start_on_slow_disk(domain, files, "300", {"--sync"});
  Options patient = domain.options();
  patient.timeout = Milliseconds(20000);
  auto client = Client::open(patient).value();
  for (const std::string id : {"a", "b"}) {
    const auto start = Clock::now();
    REQUIRE(client.add(id, "hand", {}));
    CHECK(Clock::now() - start >= std::chrono::milliseconds(300));
  }
#endif
}

TEST_CASE("storing: lookups and streams continue while the disk takes a second for a sync") {
#ifndef TFDUDE_SLOW_SYNC
  WARN("SKIPPED: a library cannot be preloaded into a program with sanitizers");
#else
  const TestDomain domain;
  const TemporaryDirectory files;
  Process daemon = start_on_slow_disk(domain, files, "1000", {});
  auto client = Client::open(domain.options()).value();
  auto other = Client::open(domain.options()).value();
  REQUIRE(other.exists("hand"));
  std::atomic<bool> stop{false};
  Clock::duration silence{0};
  std::thread streaming([&] { silence = longest_silence(other, stop); });
  Clock::duration longest{0};
  std::string failed;
  // The log is synced each thousand pages, and a change that waits for that is answered after it.
  for (int i = 0; i < 5000 && failed.empty() && longest < std::chrono::seconds(1); ++i) {
    const auto start = Clock::now();
    const auto added = client.add("f" + std::to_string(i), "hand", {});
    if (!added) failed = added.error().message;
    longest = std::max(longest, Clock::now() - start);
  }
  stop = true;
  streaming.join();
  CHECK(failed == "");
  CHECK(longest >= std::chrono::seconds(1));
  CHECK(silence < std::chrono::milliseconds(600));
#endif
}

}  // namespace tfdude
