// A daemon is killed while it is recorded, and started again.

#include <atomic>
#include <chrono>
#include <csignal>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/client.hpp"

#include "support/catch.hpp"
#include "support/cli_json.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Process;
using testing::TemporaryDirectory;

constexpr const char* kArm = R"(
partition: arm
frames:
  - {id: arm_1, parent: world, xyz: [10, 0, 0]}
  - {id: hand, parent: arm_1, xyz: [100, 0, 0], history: {moving: true, span: 60}}
)";

Time now() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

std::string seconds(Time time) {
  const std::string ns = std::to_string(nanoseconds(time));
  return ns.substr(0, ns.size() - 9) + "." + ns.substr(ns.size() - 9);
}

// Streams samples of the hand all the time.
class Stream {
 public:
  explicit Stream(Client& client) : thread_([this, &client] { run(client); }) {}
  ~Stream() {
    stop_ = true;
    thread_.join();
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

 private:
  void run(Client& client) {
    while (!stop_) {
      Transform X_PC;
      X_PC.covariance = StatedCovariance::exact();
      (void)client.publish({{"hand", X_PC}}, now());
      std::this_thread::sleep_for(20ms);
    }
  }

  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// @param stored  whether the arm has its last sample when it returns; otherwise it has the value of
// its configuration
void check_gap(bool stored) {
  const testing::TestDomain domain;
  const TemporaryDirectory files;
  const Process base =
      domain.serve(files.write("base.yaml", "partition: base\nframes: [{id: world}]\n"));
  std::vector<std::string> start{"--config", files.write("arm.yaml", kArm)};
  if (stored) {
    start.insert(start.end(), {"--state", files.path()});
  } else {
    start.emplace_back("--no-state");
  }
  std::optional<Process> arm = domain.start_daemon(start);
  (void)testing::await_ready(*arm);
  auto client = Client::open(domain.options());
  REQUIRE(client);
  const Stream stream(*client);
  const std::string file = files.path() + "/robot.mcap";
  Process recorder = domain.start_cli({"record", file});

  const auto ask = [&](std::vector<std::string> arguments, Time at) {
    arguments.insert(arguments.begin(), {"--json", "lookup", "world"});
    arguments.insert(arguments.end(), {"--at", seconds(at)});
    const json found = json::parse(domain.cli(arguments).out);
    return found.contains("error") ? found.at("error").at("code").get<std::string>() : "ok";
  };
  const auto recorded = [&](const char* frame, Time at) {
    return ask({frame, "--recording", file}, at);
  };
  // An instant before the beginning of the file would be looked up at its end.
  const Time started = now();
  Time before{};
  REQUIRE(eventually([&] {
    before = now() - 1s;
    return before > started + 1s && recorded("hand", before) == "ok";
  }));
  arm->kill();
  REQUIRE(eventually([&] {
    return domain.cli({"tree", "--recording", file}).out.find("[arm, unreachable]") !=
           std::string::npos;
  }));
  const Time gap = now();
  CHECK_THAT(domain.cli({"lookup", "world", "hand", "--recording", file}).err,
             ContainsSubstring("arm"));
  CHECK(recorded("hand", before) == "ok");
  arm.emplace(domain.start_daemon(start));
  (void)testing::await_ready(*arm);
  Time after{};
  REQUIRE(eventually([&] {
    after = now() - 1s;
    return after > gap + 1s && recorded("hand", after) == "ok";
  }));
  // A live lookup that waits is not answered either.
  CHECK(ask({"hand"}, gap) == "too_old");
  recorder.signal(SIGINT);
  CHECK(testing::finish(recorder).status == 0);
  CHECK(recorded("hand", gap) == "unreachable");
  CHECK(recorded("arm_1", gap) == "unreachable");
  CHECK(recorded("hand", before) == "ok");
  CHECK(recorded("hand", after) == "ok");
  // How old a value is, is told from the end of the file.
  CHECK_THAT(
      domain.cli({"lookup", "world", "hand", "--recording", file, "--at", seconds(after)}).out,
      ContainsSubstring("s before the end)"));
}

}  // namespace

TEST_CASE("record: within the gap of a death no pose is invented") { check_gap(false); }

TEST_CASE("record: within the gap of a death no pose is invented from the state") {
  check_gap(true);
}

}  // namespace tfdude
