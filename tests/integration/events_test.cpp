// Reports of changes, and which owner has to yield.

#include <csignal>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::await_ready;
using testing::ContainsSubstring;
using testing::eventually;
using testing::finish;
using testing::in_time;
using testing::kArmsFile;
using testing::Process;
using testing::ThesisDaemons;

}  // namespace

TEST_CASE("events: the command line prints each change as one line") {
  ThesisDaemons d;
  Process events = d.domain.start_cli({"--json", "events"});
  auto client = Client::open(d.domain.options()).value();
  REQUIRE(client.exists("hand_left"));
  // Repeats a change until the command prints it: only then does it listen.
  REQUIRE(eventually([&] {
    (void)client.move("camera", "robot_1");
    (void)client.move("camera", "world");
    return events
        .wait_for_line(R"({"event":"frame_moved")", testing::Clock::now() + Milliseconds(200))
        .has_value();
  }));
  const auto next = [&](const std::string& event) {
    const auto line = events.wait_for_line(R"({"event":")" + event, in_time());
    REQUIRE(line);
    return json::parse(*line);
  };
  REQUIRE(client.add("tool", "hand_left", {}));
  const json added = next("frame_added");
  CHECK(added["frame"] == "tool");
  CHECK(added["parent"] == "hand_left");
  CHECK(added["partition"] == "arms");
  CHECK(added["time"].get<double>() > 1.7e9);
  REQUIRE(client.remove("tool"));
  CHECK(next("frame_removed")["frame"] == "tool");
  d.arms->kill();
  CHECK(next("partition_down")["partition"] == "arms");
  d.arms.emplace(d.domain.serve(kArmsFile));
  CHECK(next("partition_up")["partition"] == "arms");
  events.signal(SIGTERM);
  CHECK(finish(events).status == 0);
}

TEST_CASE("events: commands that run until interrupted say that no partition answers") {
  const testing::TestDomain domain;
  const auto start = [&](const std::string& command) {
    return Process({TFDUDE_CLI, "--local", "--domain", std::to_string(domain.number()), "--timeout",
                    "300", command});
  };
  Process monitor = start("monitor");
  CHECK(monitor.wait_for_line("no partition answers in domain", in_time()));
  Process events = start("events");
  CHECK(eventually([&] {
    (void)events.wait(testing::Clock::now());  // reads what it has printed
    return events.err().find("same domain, profile and discovery server") != std::string::npos;
  }));
}

TEST_CASE("events: a daemon whose name was taken while it hung ends and names its successor") {
  ThesisDaemons d;
  auto client = Client::open(d.domain.options()).value();
  REQUIRE(client.exists("hand_left"));
  d.arms->freeze();
  REQUIRE(eventually([&] { return !client.partitions().value().at(0).reachable; }));
  Process successor = d.domain.serve(kArmsFile);
  d.arms->signal(SIGCONT);
  const auto result = finish(*d.arms);
  CHECK(result.status == 1);
  CHECK_THAT(result.err, ContainsSubstring("partition 'arms' was taken over by process " +
                                           std::to_string(successor.pid())));
  CHECK_THAT(result.err,
             ContainsSubstring("did not hear process " + std::to_string(d.arms->pid())));
  CHECK(successor.runs());
  CHECK(eventually([&] { return client.lookup("world", "hand_left").has_value(); }));
  CHECK(client.partitions().value().at(0).pid == static_cast<std::uint32_t>(successor.pid()));
}

}  // namespace tfdude
