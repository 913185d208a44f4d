// Clients that change frames at random and check every answer, while daemons are killed, restarted,
// paused and cut off. Prints the seed, counts, and each violation with its history; exits with 1 if
// there is one.
//
//   faults --seed 7 --seconds 60
//   faults --rounds 100
//   faults --endings 30000
//   faults --attack 10 [--secured]

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "faults/attacker.hpp"
#include "faults/beside_attack.hpp"
#include "faults/endings.hpp"
#include "faults/final_check.hpp"
#include "faults/nemesis.hpp"
#include "faults/rerouter.hpp"
#include "faults/rounds.hpp"
#include "faults/schedule.hpp"
#include "faults/waiter.hpp"

namespace tfdude::faults {
namespace {

struct Arguments {
  std::uint64_t seed = 1;
  double seconds = 60;
  std::size_t partitions = 4;
  std::size_t clients = 4;
  std::size_t rounds = 0;
  std::size_t endings = 0;
  double attack = 0;
  bool secured = false;
  std::string attacker;
  std::uint32_t domain = 0;
  std::string keys;
};

// A longer delay [ms] is not caused by a slow machine.
constexpr double kTooLong = 10000;

void report_time(const char* what, const std::vector<double>& times, double target,
                 Journal& journal) {
  const auto late =
      std::count_if(times.begin(), times.end(), [&](double time) { return time > target; });
  std::printf("%s: %s; %td above %.0f ms\n", what, distribution(times).c_str(), late, target);
  if (!times.empty() && *std::max_element(times.begin(), times.end()) > kTooLong) {
    journal.violation(std::string(what) + " took more than ten seconds");
  }
}

int run(const Arguments& arguments) {
  Cluster cluster(arguments.partitions, arguments.clients, {});
  Journal journal;
  std::printf("seed %llu, %.0f s, %zu daemons, %zu clients\n",
              static_cast<unsigned long long>(arguments.seed), arguments.seconds,
              arguments.partitions, arguments.clients);
  const Means means = cluster.means();
  if (!means.links) std::printf("no link is cut: %s\n", cluster.no_links().c_str());
  if (!means.clocks) std::printf("no clock is stepped: needs the package faketime\n");
  if (!means.disks) std::printf("no disk is full: %s\n", cluster.no_disk().c_str());
  std::fflush(stdout);
  for (std::size_t i = 0; i < arguments.partitions; ++i) cluster.start(i);
  for (std::size_t i = 0; i < arguments.partitions; ++i) cluster.await_ready(i);
  // Each gets a seed of its own, all of them from the one.
  testing::Random random(arguments.seed);
  std::vector<std::unique_ptr<Worker>> workers;
  for (std::size_t i = 0; i < arguments.clients; ++i) {
    workers.push_back(std::make_unique<Worker>(cluster.open_client(i), i, arguments.partitions,
                                               random.engine()(), journal));
    workers.back()->start();
  }
  Rerouter rerouter(cluster.open_observer(), cluster.open_observer(), arguments.partitions,
                    journal);
  Waiter waiter(cluster.open_observer(), cluster.open_observer(), arguments.partitions, journal);
  Observer observer(cluster.open_observer(Milliseconds(200)));
  Nemesis nemesis(cluster, observer, journal);
  nemesis.run(schedule(random, arguments.seconds, arguments.partitions, arguments.clients, means),
              arguments.seconds);
  for (const auto& worker : workers) worker->stop();
  rerouter.stop();
  waiter.stop();
  check_all("after all faults", cluster, observer.client(), workers, journal);
  nemesis.restart_all();
  check_all("after a restart of all", cluster, observer.client(), workers, journal);
  std::printf("%s", journal.counts().c_str());
  // The observer does not depend on a daemon that it does not ask.
  report_time("from a daemon's death until it counts as gone", observer.until_gone(), 2100,
              journal);
  report_time("from a daemon's start until it answers", observer.until_answer(), 2000, journal);
  std::printf("seed %llu: %zu violations\n", static_cast<unsigned long long>(arguments.seed),
              journal.violations());
  return journal.violations() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace tfdude::faults

int main(int argc, char** argv) {
  // If a time limit ends this, what was said before is known.
  (void)std::setvbuf(stdout, nullptr, _IOLBF, 0);
  // This seed would be that of each of the random sequences here, which differ.
  unsetenv("TFDUDE_SEED");
  tfdude::faults::Arguments arguments;
  CLI::App app{"Looks for contradictions while daemons die, hang and are cut off"};
  app.add_option("--seed", arguments.seed, "of the schedule and of what the clients do");
  app.add_option("--seconds", arguments.seconds, "how long");
  app.add_option("--partitions", arguments.partitions, "how many daemons")
      ->check(CLI::PositiveNumber);
  app.add_option("--clients", arguments.clients, "how many clients")->check(CLI::PositiveNumber);
  app.add_option("--rounds", arguments.rounds,
                 "instead: kill and start one daemon this often, and look at what it leaves");
  app.add_option("--endings", arguments.endings,
                 "instead: run this many programs that end at once, and look for crashes");
  auto* attack = app.add_option(
      "--attack", arguments.attack,
      "instead: flood daemons in each way for so many seconds, and look at how long an "
      "honest client waits");
  app.add_flag("--secured", arguments.secured, "all have keys")->needs(attack);
  auto* attacker = app.add_option("--attacker", arguments.attacker, "instead: be one of them")
                       ->check(CLI::IsMember(tfdude::faults::attacks()));
  app.add_option("--domain", arguments.domain, "of the attacked")->needs(attacker);
  app.add_option("--keys", arguments.keys, "of the attacker")->needs(attacker);
  CLI11_PARSE(app, argc, argv);
  if (!arguments.attacker.empty()) {
    return tfdude::faults::attack(arguments.attacker, arguments.domain, arguments.keys);
  }
  if (arguments.attack > 0) {
    return tfdude::faults::run_attacks(arguments.attack, arguments.secured);
  }
  if (arguments.endings > 0) return tfdude::faults::run_endings(arguments.endings);
  if (arguments.rounds > 0) return tfdude::faults::run_rounds(arguments.rounds);
  return tfdude::faults::run(arguments);
}
