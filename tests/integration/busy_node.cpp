// A participant that calls all others from several threads at once, for busy_test.cpp:
//
//   busy_node DOMAIN SECONDS NAME [CONFIG]
//
// With a configuration it owns its frames, else none. It prints "ready" once it sees all
// partitions, works, prints "done calls=N" and serves on until SIGTERM, as others may still be
// calling it. Its exit status is 0 where no call failed.

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/description/config.hpp"

#include "support/process.hpp"
#include "support/random.hpp"

namespace {

using namespace tfdude;
using testing::Clock;
using testing::Random;

constexpr std::size_t kPartitions = 5;

/// What the threads share.
struct Work {
  Client& client;
  std::string name;
  std::string own_partition;       // empty: none
  std::vector<std::string> edges;  // frames with a parent, of all partitions, which stay
  Clock::time_point end;
  std::atomic<unsigned> calls{0};
  std::atomic<unsigned> errors{0};

  template <class Value>
  void count(const char* what, const Result<Value>& result) {
    ++calls;
    if (result || ++errors > 5) return;
    std::fprintf(stderr, "%s: %s: %s\n", name.c_str(), what, result.error().message.c_str());
  }

  const std::string& any(Random& random) const { return edges[random.index(edges.size())]; }
};

void look_up(Work& work, Random& random) {
  work.count("lookup", work.client.lookup(work.any(random), work.any(random)));
}

void update(Work& work, Random& random) {
  if (random.index(2) == 0) {
    work.count("update", work.client.update(work.any(random), random.transform()));
  } else {
    work.count("update of two", work.client.update({{work.any(random), random.transform()},
                                                    {work.any(random), random.transform()}}));
  }
}

void publish(Work& work, Random& random) {
  work.count("publish", work.client.publish({{work.any(random), random.transform()},
                                             {work.any(random), random.transform()}}));
}

// Own frames, in the own partition where there is one, below frames of any; a pair, removed as one.
void add_and_remove(Work& work, Random& random) {
  const std::string upper = "upper_" + work.name;
  const std::string lower = "lower_" + work.name;
  work.count("add",
             work.client.add(upper, work.any(random), random.transform(), work.own_partition));
  work.count("add below", work.client.add(lower, upper, random.transform()));
  work.count("lookup of own", work.client.lookup(work.any(random), lower));
  work.count("move", work.client.move(lower, work.any(random)));
  work.count("move back", work.client.move(lower, upper));
  work.count("remove", work.client.remove(upper));
  if (work.client.exists(lower)) {
    work.count("remove of both", Result<void>(fail(Errc::kAlreadyExists, lower + " is left")));
  }
}

bool sees_all(Client& client) {
  const auto partitions = client.partitions();
  return partitions && partitions->size() == kPartitions &&
         std::all_of(partitions->begin(), partitions->end(), [](const PartitionInfo& partition) {
           return partition.reachable && partition.frames > 0;
         });
}

void work_on(Work& work) {
  const auto frames = work.client.frames().value();
  for (const Frame& frame : frames) {
    // Those of the configurations; others may be at work already.
    if (frame.id[0] == 'p' && !frame.parent.empty()) work.edges.push_back(frame.id);
  }
  constexpr std::array kJobs = {look_up, look_up, update, publish, add_and_remove};
  std::vector<std::thread> threads;
  for (std::size_t i = 0; i < kJobs.size(); ++i) {
    threads.emplace_back([&work, job = kJobs[i], seed = std::hash<std::string>()(work.name) + i] {
      Random random(seed);
      while (Clock::now() < work.end) job(work, random);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  sigset_t stop;
  sigemptyset(&stop);
  sigaddset(&stop, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &stop, nullptr);
  Options options;
  options.domain = static_cast<std::uint32_t>(std::strtoul(argv[1], nullptr, 10));
  options.profile = TFDUDE_PATIENT_PROFILE;
  options.timeout = Milliseconds(10000);  // beyond it is a deadlock rather than a busy machine
  std::optional<Client> client;
  std::string partition;
  if (argc > 4) {
    const Config config = load_config(argv[4]).value();
    partition = config.partition;
    client.emplace(Node::open(partition, config.frames, options).value());
  } else {
    client.emplace(Client::open(options).value());
  }
  if (!testing::eventually([&] { return sees_all(*client); })) return 3;
  std::puts("ready");
  std::fflush(stdout);
  const auto seconds = std::chrono::seconds(std::strtol(argv[2], nullptr, 10));
  Work work{*client, argv[3], partition, {}, Clock::now() + seconds};
  work_on(work);
  std::printf("done calls=%u errors=%u\n", work.calls.load(), work.errors.load());
  std::fflush(stdout);
  int signal = 0;
  sigwait(&stop, &signal);
  return work.errors == 0 ? 0 : 1;
}
