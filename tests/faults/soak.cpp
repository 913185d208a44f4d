// Runs eight daemons, a client that streams 100 of their joints at 1 kHz, and four clients that
// look up paths between them, for minutes and without faults. Prints memory and open files of each
// process, and the times of lookups in the first and in the last minute. Exits with 1 if memory or
// the number of open files grows, or if something fails.
//
//   soak --seconds 600

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>

#include "faults/cluster.hpp"
#include "faults/journal.hpp"
#include "faults/worker.hpp"
#include "support/random.hpp"

namespace tfdude::faults {
namespace {

using std::chrono::duration;
using std::chrono::microseconds;

constexpr std::size_t kDaemons = 8;
constexpr std::size_t kLookers = 4;
constexpr std::size_t kJoints = 100;

constexpr microseconds kSamplePeriod{1000};
constexpr microseconds kLookupPeriod{10000};

// How much more memory a process may use at the end than after warming up [KiB]: SQLite's log and
// the allocator may still grow once, but not with time.
constexpr long kGrowth = 2048;

std::string joint(std::size_t number) { return "joint_" + std::to_string(number); }
std::string parent_of(std::size_t number) { return base_of(number % kDaemons); }

struct Usage {
  long rss = 0;  // [KiB]
  long files = 0;
};

Usage usage_of(const std::string& pid) {
  Usage usage;
  std::ifstream status("/proc/" + pid + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmRSS:", 0) == 0) usage.rss = std::strtol(line.c_str() + 6, nullptr, 10);
  }
  const auto files = std::filesystem::directory_iterator("/proc/" + pid + "/fd");
  usage.files = std::distance(begin(files), end(files));
  return usage;
}

/// The data that the threads share.
struct Load {
  explicit Load(double seconds) : length(seconds) {}

  [[nodiscard]] double elapsed() const { return duration<double>(Clock::now() - begin).count(); }

  const double length;
  const double minute = std::min(60.0, length / 3);
  const Clock::time_point begin = Clock::now();
  std::atomic<bool> stopping{false};
  Journal journal;
  std::atomic<std::uint64_t> late{0};  // samples that could not be sent when due
};

/// Times of lookups in the first and in the last minute [ms], in memory that is allocated
/// beforehand.
struct Times {
  explicit Times(const Load& load) {
    for (auto* times : {&first, &last}) {
      times->resize(static_cast<std::size_t>(load.minute * 1000));
      times->clear();
    }
  }
  std::vector<double> first;
  std::vector<double> last;
};

void stream(Client& client, Load& load) {
  std::vector<EdgeUpdate> edges;
  for (std::size_t i = 0; i < kJoints; ++i) edges.push_back({joint(i), {}});
  auto due = Clock::now();
  for (std::uint64_t sample = 0; !load.stopping; ++sample) {
    const double angle = static_cast<double>(sample) * 1e-3;
    for (EdgeUpdate& edge : edges) {
      edge.X_PC.pose = exp((Twist() << 0.1, 0, 0, 0, 0, std::sin(angle)).finished());
    }
    const auto sent = client.publish(edges);
    if (!sent) load.journal.count("publish", sent.error().message);
    due += kSamplePeriod;
    if (Clock::now() > due) ++load.late;
    std::this_thread::sleep_until(due);
  }
}

void look_up(Client& client, Load& load, Times& times, std::uint64_t seed) {
  testing::Random random(seed);
  while (!load.stopping) {
    const auto begin = Clock::now();
    const auto X_AB = client.lookup(joint(random.index(kJoints)), joint(random.index(kJoints)));
    const double took = duration<double, std::milli>(Clock::now() - begin).count();
    if (!X_AB) load.journal.count("lookup", X_AB.error().message);
    const double elapsed = load.elapsed();
    if (elapsed < load.minute) times.first.push_back(took);
    if (elapsed > load.length - load.minute) times.last.push_back(took);
    std::this_thread::sleep_until(begin + kLookupPeriod);
  }
}

std::vector<Usage> measure(const Cluster& cluster) {
  std::vector<Usage> all;
  for (std::size_t i = 0; i < kDaemons; ++i)
    all.push_back(usage_of(std::to_string(cluster.pid(i))));
  all.push_back(usage_of("self"));
  return all;
}

void report(const std::vector<Usage>& warm, const std::vector<Usage>& most,
            const std::vector<Usage>& end, Journal& journal) {
  std::printf("| process | memory warm [KiB] | most | at the end | files warm | at the end |\n");
  std::printf("| --- | ---: | ---: | ---: | ---: | ---: |\n");
  for (std::size_t i = 0; i < warm.size(); ++i) {
    const std::string name = i < kDaemons ? "daemon " + partition_name(i) : "clients";
    std::printf("| %s | %ld | %ld | %ld | %ld | %ld |\n", name.c_str(), warm[i].rss, most[i].rss,
                end[i].rss, warm[i].files, end[i].files);
    if (end[i].rss > warm[i].rss + kGrowth) journal.violation("the memory of " + name + " grows");
    if (end[i].files > warm[i].files) journal.violation("the open files of " + name + " grow");
  }
}

void watch(Cluster& cluster, Load& load) {
  std::vector<Usage> warm;
  std::vector<Usage> most(kDaemons + 1);
  while (load.elapsed() < load.length) {
    for (const std::string& ended : cluster.take_ended()) {
      load.journal.violation("a daemon has ended: " + ended);
      return;
    }
    std::this_thread::sleep_for(std::chrono::seconds(1));
    if (load.elapsed() < load.minute) continue;
    const auto now = measure(cluster);
    if (warm.empty()) warm = now;
    for (std::size_t i = 0; i < now.size(); ++i) most[i].rss = std::max(most[i].rss, now[i].rss);
  }
  report(warm, most, measure(cluster), load.journal);
}

int run(double seconds) {
  Cluster cluster(kDaemons, 0, {});
  for (std::size_t i = 0; i < kDaemons; ++i) cluster.start(i);
  for (std::size_t i = 0; i < kDaemons; ++i) cluster.await_ready(i);
  std::vector<Client> clients;
  for (std::size_t i = 0; i <= kLookers; ++i) clients.push_back(cluster.open_observer());
  for (std::size_t i = 0; i < kJoints; ++i) {
    if (auto added = clients[0].add(joint(i), parent_of(i), {}); !added) {
      std::printf("%s\n", added.error().message.c_str());
      return 1;
    }
  }
  for (Client& client : clients) {
    if (!testing::eventually([&] { return client.exists(joint(kJoints - 1)); })) return 1;
  }
  Load load(seconds);
  std::vector<Times> times(kLookers, Times(load));
  std::vector<std::thread> threads;
  threads.emplace_back([&] { stream(clients[0], load); });
  for (std::size_t i = 0; i < kLookers; ++i) {
    threads.emplace_back([&, i] { look_up(clients[i + 1], load, times[i], i); });
  }
  watch(cluster, load);
  load.stopping = true;
  for (std::thread& thread : threads) thread.join();
  std::vector<double> first;
  std::vector<double> last;
  for (const Times& one : times) {
    first.insert(first.end(), one.first.begin(), one.first.end());
    last.insert(last.end(), one.last.begin(), one.last.end());
  }
  std::printf("lookups of the first %.0f s: %s\n", load.minute, distribution(first).c_str());
  std::printf("lookups of the last %.0f s: %s\n", load.minute, distribution(last).c_str());
  std::printf("samples sent late: %llu\n", static_cast<unsigned long long>(load.late));
  const std::string errors = load.journal.counts();
  std::printf("errors:\n%s", errors.empty() ? "  none\n" : errors.c_str());
  return errors.empty() && load.journal.violations() == 0 ? 0 : 1;
}

}  // namespace
}  // namespace tfdude::faults

int main(int argc, char** argv) {
  unsetenv("TFDUDE_SEED");
  double seconds = 600;
  CLI::App app{"Looks for what grows with time"};
  app.add_option("--seconds", seconds, "how long");
  CLI11_PARSE(app, argc, argv);
  return tfdude::faults::run(seconds);
}
