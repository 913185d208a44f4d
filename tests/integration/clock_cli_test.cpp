// A simulated clock, with real daemons and the command line.

#include <atomic>
#include <chrono>
#include <csignal>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::await_ready;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::in_time;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;

// Publishes the time of a simulation: every 5 ms, also while it stands still.
class Simulator {
 public:
  explicit Simulator(const TestDomain& domain)
      : client_(Client::open(domain.options()).value()), thread_([this] { run(); }) {}
  ~Simulator() {
    stop_ = true;
    thread_.join();
  }
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  void jump_to(double seconds) { next_ = static_cast<std::int64_t>(seconds * 1e9); }
  void run_at(double rate) { rate_ = rate; }
  [[nodiscard]] double now() const { return 1e-9 * static_cast<double>(now_.load()); }

 private:
  void run() {
    auto last = std::chrono::steady_clock::now();
    while (!stop_) {
      const auto today = std::chrono::steady_clock::now();
      const double passed = std::chrono::duration<double>(today - last).count() * rate_;
      last = today;
      const std::int64_t jump = next_.exchange(-1);
      now_ = jump >= 0 ? jump : now_ + static_cast<std::int64_t>(passed * 1e9);
      (void)client_.publish_clock(ExternalTime(std::chrono::nanoseconds(now_)));
      std::this_thread::sleep_for(5ms);
    }
  }

  Client client_;
  std::atomic<std::int64_t> now_{0};  // [ns]
  std::atomic<std::int64_t> next_{-1};
  std::atomic<double> rate_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

constexpr const char* kBase = R"(
partition: base
clock: external
history: {moving: true}
frames:
  - {id: world}
  - {id: arm, parent: world}
)";

constexpr const char* kTool = R"(
partition: tool
history: {moving: true}
frames:
  - {id: hand, parent: arm}
  - {id: camera, parent: hand, xyz: [1, 0, 0], history: {moving: false}}
)";

// Two daemons with the external clock, given in the configuration and on the command line.
struct Simulated {
  TestDomain domain;
  TemporaryDirectory files;
  Process base = domain.start_daemon({"--config", files.write("base.yaml", kBase), "--no-state"});
  Process tool = domain.start_daemon(
      {"--config", files.write("tool.yaml", kTool), "--no-state", "--clock", "external"});

  Simulated() {
    (void)await_ready(base);
    (void)await_ready(tool);
  }

  [[nodiscard]] json ask(std::vector<std::string> arguments, int status = 0) const {
    arguments.insert(arguments.begin(), {"--json", "--clock", "external"});
    const CliResult result = domain.cli(arguments);
    INFO(result.out << result.err);
    CHECK(result.status == status);
    return json::parse(result.out);
  }
  void set(const std::string& id, const std::string& x) const {
    (void)ask({"update", id, "--xyz", x, "0", "0"});
  }
};

std::int64_t stamp_of(const json& answer) { return answer.at("stamp_ns").get<std::int64_t>(); }

}  // namespace

TEST_CASE("clock: daemons and the command line follow a simulation") {
  const Simulated sim;
  const json early = sim.ask({"--timeout", "300", "update", "arm", "--xyz", "1", "0", "0"}, 1);
  CHECK(early.at("error").at("code") == "not_yet");
  CHECK_THAT(early.at("error").at("message").get<std::string>(),
             ContainsSubstring("clock is external, and has no time yet"));
  CHECK(sim.ask({"--timeout", "300", "lookup", "world", "arm", "--at", "-0.5"}, 1)
            .at("error")
            .at("code") == "not_yet");

  Simulator simulator(sim.domain);
  // The simulation starts at zero and stands still there.
  REQUIRE(eventually([&] {
    const CliResult result =
        sim.domain.cli({"--json", "update", "arm", "--xyz", "0", "0", "0", "--rpy", "0", "0", "0"});
    return result.status == 0;
  }));
  sim.set("hand", "0");
  const json start = sim.ask({"lookup", "world", "hand"});
  CHECK(stamp_of(start) >= 0);
  CHECK(stamp_of(start) < 1000);  // [ns]: as little as possible, where stamps would be equal
  CHECK(sim.ask({"lookup", "world", "hand", "--at", "0"}).at("translation").at(0) == 0.0);

  // The simulation jumps ahead, and stands still again.
  simulator.jump_to(8);
  REQUIRE(eventually([&] { return simulator.now() == 8; }));
  REQUIRE(eventually([&] {
    sim.set("arm", "1");
    return stamp_of(sim.ask({"lookup", "world", "arm"})) >= 8'000'000'000;
  }));
  REQUIRE(eventually([&] {
    sim.set("hand", "1");
    return stamp_of(sim.ask({"lookup", "arm", "hand"})) >= 8'000'000'000;
  }));
  CHECK(sim.ask({"lookup", "world", "hand", "--at", "-4"}).at("translation").at(0).get<double>() ==
        testing::Approx(1).epsilon(0.01));
  const json history = sim.ask({"history", "arm"});
  CHECK(std::abs(history.at("age").get<double>()) < 0.001);
  const CliResult shown = sim.domain.cli({"--clock", "external", "lookup", "world", "hand"});
  CHECK_THAT(shown.out,
             ContainsSubstring("stamp        8.00000000") && ContainsSubstring("(0.000000 s ago)"));
}

TEST_CASE("clock: at ten times the speed ages grow ten times as fast") {
  const Simulated sim;
  Simulator simulator(sim.domain);
  simulator.run_at(10);
  REQUIRE(eventually([&] {
    return sim.domain.cli({"update", "arm", "--xyz", "1", "0", "0"}).status == 0;
  }));
  const auto began = std::chrono::steady_clock::now();
  const auto age = [&] { return sim.ask({"history", "arm"}).at("age").get<double>(); };
  const double first = age();
  double grown = 0;
  REQUIRE(eventually([&] {
    grown = age() - first;
    return grown >= 10;
  }));
  const double passed =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  CHECK(passed < grown);
  CHECK(grown < 10 * passed + 1);
}

TEST_CASE("clock: a jump back clears what is later, and a replay works") {
  Simulated sim;
  Simulator simulator(sim.domain);
  const auto play = [&](const std::string& x) {
    for (const char* stamp : {"1", "2", "3"}) {
      simulator.jump_to(std::stod(stamp));
      REQUIRE(eventually([&] {
        return sim.domain
                   .cli({"update", "arm", "--xyz", x, "0", "0", "--stamp", stamp, "--covariance",
                         "exact"})
                   .status == 0;
      }));
    }
    CHECK(sim.ask({"lookup", "world", "arm", "--at", "2.5"}).at("translation").at(0) ==
          std::stod(x));
  };
  play("1");
  simulator.jump_to(0);
  REQUIRE(eventually([&] {
    const json cleared = sim.ask({"history", "arm"});
    return cleared.at("samples") == 0 && cleared.at("moving") == true;
  }));
  CHECK(sim.ask({"lookup", "world", "arm"}, 1).at("error").at("code") == "not_yet");
  CHECK(sim.ask({"lookup", "hand", "camera"}).at("translation").at(0) == 1.0);
  CHECK(sim.ask({"frames"}).at("frames").size() == 4);
  play("5");
  sim.base.signal(SIGTERM);
  REQUIRE(sim.base.wait(in_time()));
  CHECK_THAT(sim.base.err(), ContainsSubstring("the external clock jumped back from 3 s to 0 s"));
}

TEST_CASE("clock: a daemon has one clock") {
  const TestDomain domain;
  const TemporaryDirectory files;
  const std::string base = files.write("base.yaml", kBase);
  Process conflict = domain.start_daemon({"--config", base, "--no-state", "--clock", "system"});
  CHECK(conflict.wait(in_time()) == 2);
  CHECK_THAT(conflict.err(), ContainsSubstring("clock 'external' is not the 'system' of --clock"));
  Process same = domain.start_daemon({"--config", base, "--no-state", "--clock", "external"});
  (void)await_ready(same);
  Process unknown = domain.start_daemon({"--partition", "a", "--no-state", "--clock", "sun"});
  CHECK(unknown.wait(in_time()) == 2);
}

TEST_CASE("clock: different clocks are shown and not mixed") {
  Simulated sim;
  Process real = sim.domain.start_daemon({"--partition", "real", "--no-state"});
  (void)await_ready(real);
  Simulator simulator(sim.domain);
  simulator.jump_to(50);
  REQUIRE(eventually([&] {
    return sim.domain.cli({"update", "arm", "--xyz", "1", "0", "0", "--stamp", "49"}).status == 0;
  }));
  const json partitions = sim.ask({"partitions"}).at("partitions");
  REQUIRE(partitions.size() == 3);
  CHECK(partitions[0].at("clock") == "external");
  CHECK(partitions[1].at("clock") == "system");
  CHECK_THAT(sim.domain.cli({"partitions"}).out, ContainsSubstring("\n  external clock\n"));
  // A command with the system's clock.
  const CliResult result = sim.domain.cli({"lookup", "world", "arm", "--at", "-0.5"});
  CHECK(result.status == 1);
  CHECK_THAT(result.err, ContainsSubstring("'base' uses the external clock"));
  CHECK_THAT(sim.domain.cli({"lookup", "world", "arm"}).out, ContainsSubstring("of another clock"));
  CHECK(sim.domain.cli({"lookup", "world", "arm", "--age-noise"}).status == 1);
  CHECK(eventually([&] {
    (void)real.wait(testing::Clock::now());  // reads what it has logged
    return real.err().find("the clocks differ") != std::string::npos;
  }));
  real.signal(SIGTERM);
  REQUIRE(real.wait(in_time()));
  const CliResult wrong = sim.domain.cli({"--clock", "sundial", "frames"});
  CHECK(wrong.status == 2);
}

}  // namespace tfdude
