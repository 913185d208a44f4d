#include "faults/beside_attack.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "faults/attacker.hpp"
#include "faults/journal.hpp"
#include "support/forest_support.hpp"
#include "support/key_store.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude::faults {
namespace {

using testing::Clock;
using testing::Process;

constexpr std::size_t kMostMegabytes = 1024;
constexpr std::chrono::milliseconds kEvery{2};
constexpr std::size_t kUpdateEach = 10;

// [MB]
std::size_t memory_of(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) return std::stoul(line.substr(6)) / 1024;
  }
  return 0;
}

double percentile(std::vector<double> times, double share) {
  if (times.empty()) return std::nan("");
  std::sort(times.begin(), times.end());
  return times[static_cast<std::size_t>(share * static_cast<double>(times.size() - 1))];
}

struct Robot {
  explicit Robot(bool secured) {
    if (secured) {
      keys.emplace(std::chrono::system_clock::now());
      keys->add("base", testing::daemon_of("base"));
      keys->add("arm", testing::daemon_of("arm"));
      keys->add("honest", testing::moving("arm"));
      keys->add("attacker", testing::looking());
    }
    base.emplace(start("base", "frames: [{id: world}, {id: r1, parent: world, xyz: [1, 0, 0]}]\n"));
    arm.emplace(start("arm",
                      "frames: [{id: arm, parent: r1, xyz: [1, 0, 0]}, "
                      "{id: hand, parent: arm, xyz: [0, 0, 0]}]\n"));
    Options options = domain.options(Milliseconds(5000));
    options.shared_memory = false;
    if (keys) options.keys = keys->path("honest");
    client.emplace(Client::open(options).value());
  }
  [[nodiscard]] Process start(const std::string& name, const std::string& frames) const {
    const std::string config = files.write(name + ".yaml", "partition: " + name + "\n" + frames);
    std::vector<std::string> arguments{"--config", config, "--state", files.path() + "/" + name};
    if (keys) arguments.insert(arguments.end(), {"--keys", keys->path(name)});
    Process daemon = domain.start_daemon(arguments);
    testing::await_ready(daemon);
    return daemon;
  }
  [[nodiscard]] Process attacker(const std::string& kind) const {
    std::vector<std::string> command{"/proc/self/exe", "--attacker", kind, "--domain",
                                     std::to_string(domain.number())};
    if (keys) command.insert(command.end(), {"--keys", keys->path("attacker")});
    return Process(command);
  }

  testing::TestDomain domain;
  testing::TemporaryDirectory files;
  std::optional<testing::TestKeys> keys;
  std::optional<Process> base;
  std::optional<Process> arm;
  std::optional<Client> client;
  double written = 0;  // the acknowledged position of the hand
};

struct Waited {
  std::vector<double> times;  // [ms]
  std::size_t failed = 0;
  std::size_t most_memory = 0;  // of a daemon [MB]
};

// An honest client: looks up over both owners, and now and then changes what it looks up.
Waited work(Robot& robot, double seconds, Journal& journal) {
  Waited waited;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  for (std::size_t i = 0; Clock::now() < end; ++i) {
    if (i % kUpdateEach == 0) {
      const double x = robot.written + 1;
      if (robot.client->update("hand", testing::along_x(x))) {
        robot.written = x;
      } else {
        ++waited.failed;
      }
      waited.most_memory =
          std::max({waited.most_memory, memory_of(robot.base->pid()), memory_of(robot.arm->pid())});
    }
    const auto begin = Clock::now();
    const auto X_AB = robot.client->lookup("world", "hand");
    waited.times.push_back(std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
    if (!X_AB) {
      ++waited.failed;
    } else if (X_AB->pose.translation().x() < 2 + robot.written) {
      journal.violation("an acknowledged value was lost: " + std::to_string(robot.written) +
                        ", and the lookup says " + std::to_string(X_AB->pose.translation().x()));
      robot.written = X_AB->pose.translation().x() - 2;
    }
    std::this_thread::sleep_for(kEvery);
  }
  return waited;
}

void check_after(Robot& robot, const std::string& kind, Journal& journal) {
  for (const auto& [name, daemon] :
       {std::pair{"base", &robot.base}, std::pair{"arm", &robot.arm}}) {
    if (!(*daemon)->runs())
      journal.violation(kind + ": the daemon of " + name + " has ended: " + (*daemon)->err());
  }
  Options options = robot.domain.options(Milliseconds(5000));
  if (robot.keys) options.keys = robot.keys->path("honest");
  auto fresh = Client::open(options);
  if (!fresh) return journal.violation(kind + ": no client opens: " + fresh.error().message);
  const auto X_AB = fresh->lookup("world", "hand", {}, Milliseconds(5000));
  if (!X_AB) journal.violation(kind + ": a new client is not answered: " + X_AB.error().message);
}

}  // namespace

int run_attacks(double seconds, bool secured) {
  Journal journal;
  std::printf("%s\n%-13s %8s %8s %9s %9s %9s %7s %6s\n",
              secured ? "With keys; the attacker may only look" : "Without keys", "attack",
              "calm p50", "calm p99", "beside it", "p99 [ms]", "of burn's", "failed", "MB");
  double beside_burn = std::nan("");
  for (const std::string& kind : attacks()) {
    Robot robot(secured);
    (void)work(robot, 0.2, journal);
    const Waited calm = work(robot, seconds / 2, journal);
    Process attacker = robot.attacker(kind);
    if (!attacker.wait_for_line("ready", testing::in_time())) {
      const bool permitted = attacker.err().find(" may not ") == std::string::npos;
      if (permitted) journal.violation(kind + " did not begin: " + attacker.err());
      if (!permitted) std::printf("%-13s not permitted\n", kind.c_str());
      continue;
    }
    const Waited waited = work(robot, seconds, journal);
    if (!attacker.runs()) journal.violation(kind + " ended: " + attacker.err());
    attacker.kill();
    const double p99 = percentile(waited.times, 0.99);
    if (kind == "burn") beside_burn = p99;
    std::printf("%-13s %8.3f %8.3f %9.3f %9.3f %9.2f %7zu %6zu\n", kind.c_str(),
                percentile(calm.times, 0.5), percentile(calm.times, 0.99),
                percentile(waited.times, 0.5), p99, p99 / beside_burn, waited.failed,
                waited.most_memory);
    std::fflush(stdout);
    if (waited.failed > 0) {
      journal.violation(kind + ": " + std::to_string(waited.failed) + " calls failed beside it");
    }
    if (waited.most_memory > kMostMegabytes) {
      journal.violation(kind + ": a daemon takes " + std::to_string(waited.most_memory) + " MB");
    }
    check_after(robot, kind, journal);
  }
  std::printf("%zu violations\n", journal.violations());
  return journal.violations() == 0 ? 0 : 1;
}

}  // namespace tfdude::faults
