// Owners that die and return while clients wait, stream and watch.

#include <atomic>
#include <chrono>
#include <csignal>
#include <future>
#include <optional>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::Clock;
using testing::eventually;
using testing::outcome;
using testing::Process;

constexpr const char* kBase =
    "partition: base\n"
    "frames:\n"
    "  - {id: world}\n"
    "  - {id: shoulder, parent: world, xyz: [1, 0, 0]}\n";
constexpr const char* kArm =
    "partition: arm\n"
    "frames:\n"
    "  - {id: arm, parent: shoulder, xyz: [10, 0, 0]}\n"
    "  - {id: hand, parent: arm, xyz: [100, 0, 0]}\n";
constexpr const char* kTool = "  - {id: tool, parent: hand, xyz: [1000, 0, 0]}\n";

/// The arm, and a finger that this joint moves.
std::string jointed(const testing::TemporaryDirectory& files, const std::string& joint) {
  const std::string robot =
      "<robot name=\"r\"><link name=\"palm\"/><link name=\"finger\"/><joint name=\"" + joint +
      "\" type=\"continuous\"><parent link=\"palm\"/><child link=\"finger\"/></joint></robot>";
  return std::string(kArm) + "urdf:\n  - {file: " + files.write(joint + ".urdf", robot) +
         ", root: hand}\n";
}

/// A base that stays, and an arm that is killed and returns.
struct Robot {
  explicit Robot(const std::string& arms) : Robot() { start(arms); }
  Robot() : base(domain.serve(files.write("base.yaml", kBase))) {}
  void start(const std::string& arms) {
    arm.emplace(domain.start_daemon(
        {"--config", files.write("arm.yaml", arms), "--state", files.path() + "/state"}));
    (void)testing::await_ready(*arm);
  }
  void end(bool killed) {
    if (killed) return arm->kill();
    arm->signal(SIGTERM);
    REQUIRE(arm->wait(testing::in_time()) == 0);
  }
  [[nodiscard]] Client client() const { return Client::open(domain.options()).value(); }

  testing::TestDomain domain;
  testing::TemporaryDirectory files;
  Process base;
  std::optional<Process> arm;
};

bool is_lost(Client& client) { return outcome(client.lookup("world", "hand")) == "unreachable"; }

double x_of(const Result<StampedTransform>& found) {
  INFO((found ? "" : found.error().message));
  REQUIRE(found);
  return found->pose.translation().x();
}

/// Waiting lookups need this long at most once the owner serves again: far less than they wait.
constexpr Milliseconds kSoon{3000};
constexpr Milliseconds kLong{60000};

}  // namespace

TEST_CASE("returning: waiting lookups of all kinds are answered once their owner is back") {
  const bool killed = GENERATE(true, false);
  CAPTURE(killed);
  Robot robot(kArm);
  Client client = robot.client();
  REQUIRE(eventually([&] { return client.lookup("world", "hand").has_value(); }));
  robot.end(killed);
  REQUIRE(eventually([&] { return is_lost(client); }));
  auto future = client.lookup_async("world", "hand", {}, kLong);
  std::promise<Result<StampedTransform>> called;
  const auto pending =
      client.lookup_async("world", "hand", {}, kLong, [&](const auto& X) { called.set_value(X); });
  auto waits =
      std::async(std::launch::async, [&] { return client.lookup("world", "hand", {}, kLong); });
  Query extrapolated;
  extrapolated.at = Time(std::chrono::system_clock::now());
  auto past = client.lookup_async("arm", "hand", extrapolated, kLong);
  robot.start(kArm);
  const auto soon = Clock::now() + kSoon;
  auto by_callback = called.get_future();
  REQUIRE(future.wait_until(soon) == std::future_status::ready);
  REQUIRE(by_callback.wait_until(soon) == std::future_status::ready);
  REQUIRE(waits.wait_until(soon) == std::future_status::ready);
  REQUIRE(past.wait_until(soon) == std::future_status::ready);
  CHECK(x_of(future.get()) == 111);
  CHECK(x_of(by_callback.get()) == 111);
  CHECK(x_of(waits.get()) == 111);
  CHECK(x_of(past.get()) == 100);
}

TEST_CASE("returning: a lookup waits for a frame that only the next configuration has") {
  Robot robot(kArm);
  Client client = robot.client();
  REQUIRE(eventually([&] { return client.lookup("world", "hand").has_value(); }));
  auto future = client.lookup_async("world", "tool", {}, kLong);
  robot.end(true);
  robot.start(std::string(kArm) + kTool);
  REQUIRE(future.wait_for(kSoon) == std::future_status::ready);
  CHECK(x_of(future.get()) == 1111);
}

TEST_CASE("returning: a stream goes to the frames of the next configuration and to no others") {
  const bool killed = GENERATE(true, false);
  const bool appears = GENERATE(true, false);
  CAPTURE(killed, appears);
  const std::string with = std::string(kArm) + kTool;
  Robot robot(appears ? kArm : with);
  Client client = robot.client();
  auto stream = client.stream({"hand", "tool"}).value();
  const std::vector<Transform> values{along_x(5), along_x(6)};
  const auto sent = [&] { return stream.try_publish(values); };
  const auto lacks_tool = [&] {
    const auto& missing = sent();
    return missing.size() == 1 && missing[0].index == 1 && missing[0].why == Errc::kUnknownFrame;
  };
  const auto all = [&] { return sent().empty(); };
  if (appears) {
    REQUIRE(eventually(lacks_tool));
  } else {
    REQUIRE(eventually(all));
  }
  robot.end(killed);
  robot.start(appears ? with : kArm);
  if (appears) {
    CHECK(eventually(all));
  } else {
    CHECK(eventually(lacks_tool));
  }
}

TEST_CASE("returning: a stream goes to the joints of the next configuration and to no others") {
  Robot robot;
  robot.start(jointed(robot.files, "bend"));
  Client client = robot.client();
  auto stream = client.stream_joints({"bend", "turn"}).value();
  const std::vector<double> positions{0.1, 0.2};
  const std::vector<double> variances{1e-6, 1e-6};
  const auto misses_only = [&](std::size_t index) {
    const auto& missing = stream.try_publish(positions, variances);
    return missing.size() == 1 && missing[0].index == index &&
           missing[0].why == Errc::kUnknownJoint;
  };
  REQUIRE(eventually([&] { return misses_only(1); }));
  robot.end(true);
  robot.start(jointed(robot.files, "turn"));
  CHECK(eventually([&] { return misses_only(0); }));
}

TEST_CASE("returning: a client that only streams notices the death of its owner soon") {
  const std::string which = GENERATE("edges", "joints");
  CAPTURE(which);
  Robot robot;
  robot.start(jointed(robot.files, "bend"));
  Client client = robot.client();
  auto edges = client.stream({"arm"}).value();
  auto joints = client.stream_joints({"bend"}).value();
  const std::vector<Transform> values{along_x(5)};
  const std::vector<double> position{0.1};
  const std::vector<double> variance{1e-6};
  const auto not_sent = [&] {
    return which == "edges" ? edges.try_publish(values) : joints.try_publish(position, variance);
  };
  // Long enough that the owner has been asked for a sign of life.
  const auto began = Clock::now();
  REQUIRE(eventually([&] {
    const bool sent = not_sent().empty();
    return sent && Clock::now() - began > Milliseconds(1000);
  }));
  robot.end(true);
  const auto killed = Clock::now();
  REQUIRE(eventually([&] {
    const auto& missing = not_sent();
    return !missing.empty() && missing[0].why == Errc::kUnreachable;
  }));
  // 450 ms, and time for a busy machine; who depends on nobody notices after 1.9 s.
  CHECK(Clock::now() - killed < Milliseconds(1200));
}

TEST_CASE("returning: a watch is well only with values of its owner's new process") {
  Robot robot(std::string(kArm) + kTool);
  Client client = robot.client();
  const auto path = client.watch("world", "hand").value();
  const auto sample = [&](double x) {
    (void)client.publish({{"hand", along_x(x)}}, Time(std::chrono::system_clock::now()));
  };
  REQUIRE(eventually([&] {
    sample(100);
    const auto latest = path.latest();
    return latest && latest->stamp && path.health();
  }));
  robot.end(true);
  REQUIRE(eventually([&] { return !path.health(); }));
  std::atomic<bool> done{false};
  const auto before = path.latest().value().stamp;
  auto watched = std::async(std::launch::async, [&] {
    int wrong = 0;
    while (!done) {
      // The value first: it may be replaced before the health is read, but not after.
      const bool well = path.health().has_value();
      const auto latest = path.latest();
      if (well && latest && latest->stamp == before) ++wrong;
    }
    return wrong;
  });
  robot.start(std::string(kArm) + kTool);
  CHECK(eventually([&] { return path.health().has_value(); }));
  done = true;
  CHECK(watched.get() == 0);
}

}  // namespace tfdude
