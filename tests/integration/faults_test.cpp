// Daemons that die, hang, return, or want the same name.

#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <unistd.h>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/test_domain.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using testing::await_ready;
using testing::ContainsSubstring;
using testing::eventually;
using testing::finish;
using testing::in_time;
using testing::kArmsFile;
using testing::kRobotFile;
using testing::Process;
using testing::ThesisDaemons;

/// Far longer than a partition may be silent.
constexpr Milliseconds kPatience{2000};

/// Calls that need the partition "arms" fail before their time is over and say why; others work.
void check_arms_missing(Client& client) {
  const auto lookup = client.lookup("world", "hand_left");
  const auto update = client.update("arm_1", {});
  const auto add = client.add("tool", "arm_2", {});
  const auto remove = client.remove("arm_1");
  for (const auto& result : {lookup.map([](const Transform&) {}), update, add, remove}) {
    REQUIRE_FALSE(result);
    CHECK(result.error().code == Errc::kUnreachable);
    CHECK_THAT(result.error().message, ContainsSubstring("'arms'"));
  }
  CHECK(client.lookup("world", "camera"));
  CHECK(client.update("robot_2", {}));
  CHECK(client.exists("robot_1"));
}

std::string host() {
  std::string name(256, '\0');
  gethostname(name.data(), name.size());
  return name.c_str();
}

}  // namespace

TEST_CASE("faults: calls that need a killed daemon fail early and others succeed") {
  ThesisDaemons d;
  auto client = Client::open(d.domain.options(kPatience)).value();
  REQUIRE(client.lookup("world", "hand_left"));
  d.arms->kill();
  check_arms_missing(client);
  check_arms_missing(client);
  const auto partitions = client.partitions().value();
  REQUIRE(partitions.size() == 2);
  CHECK(partitions[0].name == "arms");
  CHECK_FALSE(partitions[0].reachable);
  CHECK(partitions[1].reachable);
}

TEST_CASE("faults: a client that joins after a daemon was killed learns that it is unreachable") {
  ThesisDaemons d;
  d.arms->kill();
  auto joiner = Client::open(d.domain.options(kPatience)).value();
  // The joiner may come before the other daemon has noticed.
  REQUIRE(eventually([&] { return joiner.partitions().value().size() == 2; }));
  CHECK_FALSE(joiner.partitions().value().at(0).reachable);
  check_arms_missing(joiner);
}

TEST_CASE("faults: a longer lease in the profile delays the loss of a daemon") {
  testing::TestDomain domain;
  std::ifstream patient(TFDUDE_PATIENT_PROFILE);
  std::string text{std::istreambuf_iterator<char>(patient), {}};
  const std::string ten = "<sec>10</sec>";
  text.replace(text.find(ten), ten.size(), "<sec>2</sec>");
  const testing::TemporaryDirectory directory;
  Options options = domain.options();
  options.profile = directory.write("two_seconds.xml", text);
  options.shared_memory = false;  // through which the death would be known at once
  Process arms = domain.start_daemon({"--config", kArmsFile, "--profile", options.profile});
  testing::await_ready(arms);
  auto client = Client::open(options).value();
  REQUIRE(eventually([&] { return client.lookup("arm_1", "hand_left").has_value(); }));
  arms.kill();
  const auto killed = testing::Clock::now();
  // A client that uses the daemon notices after the lease of the profile, instead of 450 ms.
  REQUIRE(eventually([&] {
    const auto asked = client.lookup("arm_1", "hand_left");
    return !asked && asked.error().code == Errc::kUnreachable;
  }));
  CHECK(testing::Clock::now() - killed > std::chrono::milliseconds(1500));
}

TEST_CASE("faults: an owner reports a killed daemon and continues with its own frames") {
  testing::TestDomain domain;
  Process arms = domain.serve(kArmsFile);
  auto robot =
      Node::open("robot", {{"world", "", {}}, {"robot_1", "world", {}}}, domain.options()).value();
  REQUIRE(eventually([&] { return robot.lookup("world", "hand_left").has_value(); }));
  arms.kill();
  const auto lost = robot.lookup("world", "hand_left");
  REQUIRE_FALSE(lost);
  CHECK(lost.error().code == Errc::kUnreachable);
  CHECK_THAT(lost.error().message, ContainsSubstring("'arms'"));
  CHECK(robot.lookup("world", "robot_1"));
  CHECK(robot.add("tool", "robot_1", {}));
}

TEST_CASE("faults: a killed daemon answers again after a restart") {
  ThesisDaemons d;
  Options options = d.domain.options();
  options.shared_memory = false;  // answers in memory may differ in the last digit
  auto client = Client::open(options).value();
  for (int round = 0; round < 3; ++round) {
    const auto before = client.lookup("world", "hand_left");
    REQUIRE(before);
    REQUIRE(client.add("tool", "hand_left", {}));
    d.arms->kill();
    d.arms.emplace(d.domain.serve(kArmsFile));
    // The added frame is lost with its daemon.
    REQUIRE(eventually([&] { return client.exists("hand_left") && !client.exists("tool"); }));
    const auto after = client.lookup("world", "hand_left");
    INFO((after ? "" : after.error().message));
    REQUIRE(after);
    CHECK(after->pose.matrix() == before->pose.matrix());
    // Host and process come with the presence, which may be behind the pages.
    CHECK(eventually([&] {
      return client.partitions().value().at(0).pid == static_cast<std::uint32_t>(d.arms->pid());
    }));
  }
}

TEST_CASE("faults: a call to a hanging daemon times out and succeeds when it resumes") {
  ThesisDaemons d;
  // Shorter than the time until a partition counts as lost.
  Options options = d.domain.options(Milliseconds(50));
  options.shared_memory = false;  // lookups in memory do not notice at first that an owner hangs
  auto client = Client::open(options).value();
  REQUIRE(eventually([&] { return client.lookup("world", "hand_left").has_value(); }));
  const auto frozen = std::chrono::steady_clock::now();
  d.arms->freeze();
  const auto late = client.lookup("world", "hand_left");
  const bool quick = std::chrono::steady_clock::now() - frozen < std::chrono::milliseconds(250);
  REQUIRE_FALSE(late);
  // On a busy computer the loss may have been noticed in the meantime.
  const Errc code = late.error().code;
  CHECK((code == Errc::kTimeout || (!quick && code == Errc::kUnreachable)));
  CHECK_THAT(late.error().message, ContainsSubstring("'arms'"));
  CHECK(eventually([&] {
    const auto lost = client.lookup("world", "hand_left");
    return !lost && lost.error().code == Errc::kUnreachable;
  }));
  d.arms->signal(SIGCONT);
  CHECK(eventually([&] { return client.lookup("world", "hand_left").has_value(); }));
}

TEST_CASE("faults: a daemon that DDS had lost is discovered again") {
  ThesisDaemons d;
  auto client = Client::open(d.domain.options(kPatience)).value();
  for (int round = 0; round < 3; ++round) {
    REQUIRE(eventually([&] { return client.lookup("world", "hand_left").has_value(); }));
    d.arms->freeze();
    CHECK(eventually([&] {
      const auto lost = client.lookup("world", "hand_left");
      return !lost && lost.error().code == Errc::kUnreachable;
    }));
    d.arms->signal(SIGCONT);
  }
  CHECK(eventually([&] { return client.lookup("world", "hand_left").has_value(); }));
  CHECK(eventually([&] { return client.add("tool", "hand_left", {}).has_value(); }));
  CHECK(client.exists("tool"));
}

TEST_CASE("faults: a second daemon of the same name is rejected") {
  ThesisDaemons d;
  Process second = d.domain.start_daemon({"--config", kArmsFile});
  const auto result = finish(second);
  CHECK(result.status != 0);
  CHECK(result.out.empty());
  CHECK_THAT(result.err, ContainsSubstring("'arms'"));
  CHECK_THAT(result.err, ContainsSubstring("host " + host()));
  CHECK_THAT(result.err, ContainsSubstring("process " + std::to_string(d.arms->pid())));
  CHECK(d.arms->runs());
  CHECK(d.domain.cli({"lookup", "world", "hand_left"}).status == 0);
}

TEST_CASE("faults: of two daemons of one name that start at once exactly one serves") {
  for (int round = 0; round < 4; ++round) {
    testing::TestDomain domain;
    std::vector<Process> daemons;
    for (int i = 0; i < 2; ++i) daemons.push_back(domain.start_daemon({"--config", kArmsFile}));
    REQUIRE(eventually([&] { return !daemons[0].runs() || !daemons[1].runs(); }));
    const std::size_t loser = daemons[0].runs() ? 1 : 0;
    Process& winner = daemons[1 - loser];
    await_ready(winner);
    const auto lost = finish(daemons[loser]);
    CHECK(lost.status != 0);
    CHECK(lost.out.empty());
    CHECK_THAT(lost.err, ContainsSubstring("process " + std::to_string(winner.pid())));
    auto client = Client::open(domain.options()).value();
    CHECK(client.lookup("arm_1", "hand_left"));
    const auto partitions = client.partitions().value();
    REQUIRE(partitions.size() == 1);
    CHECK(partitions[0].pid == static_cast<std::uint32_t>(winner.pid()));
  }
}

TEST_CASE("faults: a daemon that gets SIGINT or SIGTERM announces its end and exits with 0") {
  const int signal = GENERATE(2, 15);  // SIGINT, SIGTERM
  ThesisDaemons d;
  auto client = Client::open(d.domain.options(kPatience)).value();
  REQUIRE(client.lookup("world", "hand_left"));
  d.arms->signal(signal);
  CHECK(d.arms->wait(in_time()) == 0);
  check_arms_missing(client);
  // Its name is free at once.
  d.arms.emplace(d.domain.serve(kArmsFile));
  CHECK(eventually([&] { return client.lookup("world", "hand_left").has_value(); }));
}

}  // namespace tfdude
