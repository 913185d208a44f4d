// Partitions that are gone for good, and those that come back: with real daemons.

#include <chrono>
#include <csignal>
#include <filesystem>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::await_ready;
using testing::Clock;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;
using testing::x_of;

std::string owner_of(Client& client, const std::string& id) {
  const auto frames = client.frames();
  for (const Frame& frame : frames.value()) {
    if (frame.id == id) return frame.partition;
  }
  return "nobody";
}

// A base, and an arm whose frames another daemon may serve instead.
struct Robot {
  Robot() {
    const std::string frames =
        "frames:\n  - {id: arm, parent: world, xyz: [1, 0, 0]}\n"
        "  - {id: hand, parent: arm, xyz: [10, 0, 0]}\n";
    base_config = directory.write("base.yaml", "partition: base\nframes:\n  - {id: world}\n");
    arm_config = directory.write("arm.yaml", "partition: arm\n" + frames);
    left_config = directory.write("left.yaml", "partition: left_arm\n" + frames);
    base.emplace(start(base_config));
    arm.emplace(start(arm_config));
  }
  [[nodiscard]] Process start(const std::string& config,
                              const std::vector<std::string>& wrapper = {}) const {
    Process daemon =
        domain.start_daemon({"--config", config, "--state", directory.path()}, wrapper);
    await_ready(daemon);
    return daemon;
  }

  TestDomain domain;
  TemporaryDirectory directory;
  std::string base_config;
  std::string arm_config;
  std::string left_config;
  std::optional<Process> base;
  std::optional<Process> arm;
  std::optional<Process> left;
};

}  // namespace

TEST_CASE("absences: another daemon owns the frames of a dead one within three seconds") {
  // The shortest of several attempts, because the computer may be busy.
  auto least = Clock::duration::max();
  for (int attempt = 0; attempt < 3 && least > std::chrono::seconds(3); ++attempt) {
    Robot robot;
    auto client = Client::open(robot.domain.options()).value();
    REQUIRE(client.lookup("world", "hand"));
    const auto death = Clock::now();
    robot.arm->kill();
    robot.left.emplace(robot.start(robot.left_config));
    REQUIRE(eventually([&] { return owner_of(client, "hand") == "left_arm"; }));
    least = std::min(least, Clock::now() - death);
  }
  CHECK(least < std::chrono::seconds(3));
}

TEST_CASE("absences: a daemon keeps the frames that it took over when their first owner returns") {
  Robot robot;
  auto client = Client::open(robot.domain.options()).value();
  REQUIRE(client.lookup("world", "hand"));
  std::mutex mutex;
  std::vector<Change> heard;
  Subscription subscription = client.on_change([&](const Change& change) {
    const std::lock_guard lock(mutex);
    heard.push_back(change);
  });
  const bool orderly = GENERATE(false, true);
  if (orderly) {
    robot.arm->signal(SIGTERM);
    REQUIRE(robot.arm->wait(testing::in_time()));
  } else {
    robot.arm->kill();
  }
  robot.left.emplace(robot.start(robot.left_config));
  REQUIRE(eventually([&] { return owner_of(client, "hand") == "left_arm"; }));
  REQUIRE(client.lookup("world", "hand"));
  const auto fresh = robot.domain.cli({"--json", "partitions"});
  CHECK_THAT(fresh.out,
             ContainsSubstring(orderly ? R"("reason":"stopped")" : R"("reason":"lost")"));
  const auto told = [&](const Change& expected) {
    const std::lock_guard lock(mutex);
    return std::any_of(heard.begin(), heard.end(), [&](const Change& one) {
      return one.kind == expected.kind && one.partition == expected.partition &&
             one.rival == expected.rival &&
             (one.kind != ChangeKind::kPartitionDown || one.stopped == orderly);
    });
  };
  CHECK(eventually([&] { return told({ChangeKind::kPartitionDown, "arm", {}, {}, {}, {}, {}}); }));
  CHECK(eventually([&] {
    return told({ChangeKind::kFrameTakenOver, "left_arm", {}, {}, "arm", {}, {}});
  }));
  // Changes that were acknowledged in the meantime survive the return of the first owner.
  REQUIRE(client.update("hand", along_x(77)));
  REQUIRE(client.add("tool", "hand", along_x(5)));
  robot.arm.emplace(robot.start(robot.arm_config));
  CHECK(eventually([&] {
    return told({ChangeKind::kConflict, "arm", {}, {}, "left_arm", {}, {}});
  }));
  CHECK(owner_of(client, "hand") == "left_arm");
  const auto X = client.lookup("world", "tool");
  REQUIRE(X);
  CHECK(x_of(X) == 83);
  auto late = Client::open(robot.domain.options()).value();
  CHECK(late.exists("tool"));
  CHECK(owner_of(late, "hand") == "left_arm");
}

TEST_CASE("absences: a client that starts after a loss knows the frames of the lost owner") {
  Robot robot;
  const std::string tool_config = robot.directory.write(
      "tool.yaml", "partition: tool\nframes:\n  - {id: tool, parent: hand, xyz: [5, 0, 0]}\n");
  const Process tool = robot.start(tool_config);
  auto early = Client::open(robot.domain.options()).value();
  REQUIRE(early.lookup("world", "tool"));
  robot.arm->kill();
  REQUIRE(eventually([&] {
    const auto X = early.lookup("world", "tool");
    return !X && X.error().code == Errc::kUnreachable;
  }));
  auto late = Client::open(robot.domain.options()).value();
  using Ids = std::vector<std::string>;
  for (Client* client : {&early, &late}) {
    CHECK(client->roots().value() == Ids{"world"});
    CHECK(client->children("world").value() == Ids{"arm"});
    CHECK(client->children("arm").value() == Ids{"hand"});
    CHECK(client->children("hand").value() == Ids{"tool"});
    CHECK(client->children("tool").value().empty());
    CHECK(client->children("head").error().code == Errc::kUnknownFrame);
    const auto X = client->lookup("world", "tool");
    REQUIRE_FALSE(X);
    CHECK(X.error().partition == "arm");
    const auto many = client->lookup_many({{"world", "arm"}, {"world", "world"}}, {});
    REQUIRE_FALSE(many[0]);
    CHECK(many[0].error().code == Errc::kUnreachable);
    CHECK(many[1]);
    // The late one first hears only that it is silent.
    Explanation why;
    CHECK(eventually([&] {
      why = client->why("world", "tool");
      return why.cause && why.cause->obstacle == Obstacle::kOwnerLost;
    }));
    REQUIRE(why.cause);
    CHECK(why.cause->partition == "arm");
    CHECK(why.cause->frame == (client == &early ? "arm" : "hand"));
  }
}

TEST_CASE("absences: a daemon that hung yields its frames to the one that took them over") {
  Robot robot;
  auto client = Client::open(robot.domain.options()).value();
  REQUIRE(client.lookup("world", "hand"));
  robot.arm->freeze();
  robot.left.emplace(robot.start(robot.left_config));
  REQUIRE(eventually([&] { return owner_of(client, "hand") == "left_arm"; }));
  REQUIRE(eventually([&] { return client.update("hand", along_x(77)).has_value(); }));
  robot.arm->signal(SIGCONT);
  REQUIRE(eventually([&] {
    const auto partitions = client.partitions();
    for (const PartitionInfo& one : partitions.value()) {
      if (one.name == "arm") return one.reachable && one.frames == 0;
    }
    return false;
  }));
  CHECK(owner_of(client, "hand") == "left_arm");
  CHECK(x_of(client.lookup("world", "hand")) == 78);
}

TEST_CASE("absences: a daemon that was away learns that a partition was forgotten") {
  Robot robot;
  const auto refused = robot.domain.cli({"forget", "arm"});
  CHECK(refused.status != 0);
  CHECK_THAT(refused.err, ContainsSubstring("partition 'arm' is reachable"));
  auto client = Client::open(robot.domain.options()).value();
  REQUIRE(client.exists("hand"));
  const std::string head_config = robot.directory.write(
      "head.yaml", "partition: head\nframes:\n  - {id: neck, parent: world}\n");
  Process head = robot.start(head_config);
  robot.arm->kill();
  REQUIRE(eventually([&] { return !(client.partitions().value())[0].reachable; }));
  head.kill();
  // Until the base misses the head, a command cannot know whether it has discovered all.
  REQUIRE(eventually([&] { return robot.domain.cli({"forget", "arm"}).status == 0; }));
  CHECK(eventually([&] { return !client.exists("hand"); }));
  const Process again = robot.start(head_config);
  CHECK(eventually([&] { return client.exists("neck"); }));
  const auto partitions = robot.domain.cli({"partitions"});
  CHECK(partitions.out.find("arm") == std::string::npos);
  CHECK_FALSE(client.exists("hand"));
}

TEST_CASE("absences: a process that starts after an orderly stop is told of no loss") {
  Robot robot;
  auto client = Client::open(robot.domain.options()).value();
  REQUIRE(client.lookup("world", "hand"));
  robot.arm->signal(SIGTERM);
  REQUIRE(robot.arm->wait(testing::in_time()));
  std::set<std::string> reasons;
  REQUIRE(eventually([&] {
    const auto lookup = robot.domain.cli({"lookup", "world", "hand"});
    CHECK(lookup.status == 3);
    CHECK(lookup.err.find("is lost") == std::string::npos);
    const auto listed = nlohmann::json::parse(robot.domain.cli({"--json", "partitions"}).out);
    for (const auto& one : listed.at("partitions")) {
      if (one.at("name") == "arm") reasons.insert(one.value("reason", "none"));
    }
    return lookup.err.find("was stopped") != std::string::npos;
  }));
  CHECK(reasons.count("lost") == 0);
}

TEST_CASE("absences: a program that asks why just after a loss never takes the frame for unknown") {
  Robot robot;
  robot.arm->kill();
  const auto why = robot.domain.cli({"--timeout", "1000", "why", "world", "hand"});
  INFO(why.out << why.err);
  CHECK(why.status == 3);
  CHECK_THAT(why.out, !ContainsSubstring("unknown frame"));
}

TEST_CASE("absences: ages by a clock that is an hour behind are said to be so") {
  const std::string fake = TFDUDE_FAKETIME;
  if (!std::filesystem::exists(fake)) {
    WARN("SKIPPED: needs the package faketime");
    return;
  }
  Robot robot;
  robot.arm->kill();
  robot.arm.emplace(robot.start(
      robot.arm_config,
      {"/usr/bin/env", "FAKETIME=-1h", "FAKETIME_DONT_FAKE_MONOTONIC=1", "LD_PRELOAD=" + fake}));
  auto client = Client::open(robot.domain.options()).value();
  const Time then =
      std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now()) -
      std::chrono::hours(1);
  REQUIRE(eventually([&] { return client.update("hand", along_x(1), then).has_value(); }));
  const std::string hint = "the clock of partition 'arm' is ";
  const auto says = [&](const std::vector<std::string>& args, const std::string& text) {
    const auto result = robot.domain.cli(args);
    INFO(result.out << result.err);
    CHECK_THAT(result.out + result.err, ContainsSubstring(text));
  };
  says({"lookup", "world", "hand", "--at", "-0.5"}, hint);
  says({"why", "world", "hand", "--at", "-0.5"}, hint);
  says({"why", "world", "hand"}, hint);
  const auto why = nlohmann::json::parse(robot.domain.cli({"--json", "why", "world", "hand"}).out);
  for (const auto& owner : why.at("owners")) {
    INFO(owner.dump());
    CHECK(owner.at("clock_ahead_ns").is_null() == (owner.at("partition") == "base"));
  }
}

TEST_CASE("absences: a daemon is accepted although its clock is behind that of its predecessor") {
  const std::string fake = TFDUDE_FAKETIME;
  if (!std::filesystem::exists(fake)) {
    WARN("SKIPPED: needs the package faketime");
    return;
  }
  Robot robot;
  auto client = Client::open(robot.domain.options()).value();
  REQUIRE(client.lookup("world", "hand"));
  robot.arm->kill();
  const std::string state =
      robot.directory.path() + "/domain-" + std::to_string(robot.domain.number()) + "/arm.sqlite";
  const bool keeps = GENERATE(true, false);
  if (!keeps) std::filesystem::remove(state);
  robot.arm.emplace(robot.start(
      robot.arm_config,
      {"/usr/bin/env", "FAKETIME=-10d", "FAKETIME_DONT_FAKE_MONOTONIC=1", "LD_PRELOAD=" + fake}));
  CHECK(eventually([&] { return client.lookup("world", "hand").has_value(); }));
}

}  // namespace tfdude
