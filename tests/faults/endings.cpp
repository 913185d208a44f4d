#include "faults/endings.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "faults/journal.hpp"
#include "faults/worker.hpp"
#include "support/joint_frames.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude::faults {
namespace {

using testing::Process;

constexpr std::size_t kAtOnce = 4;
// After so many programs all of them must have been dropped. This takes much less time than DDS
// takes to drop one that has crashed.
constexpr std::size_t kBatch = 40;
constexpr std::chrono::seconds kDropWithin{2};

constexpr const char* kArm = R"(<robot name="arm">
  <link name="arm"/>
  <link name="hand"/>
  <joint name="elbow" type="revolute">
    <parent link="arm"/>
    <child link="hand"/>
    <axis xyz="0 0 1"/>
    <limit lower="-1" upper="2"/>
  </joint>
</robot>
)";

/// The daemon, and the observer that also has the joint. The observer keeps a writer for each
/// program that has asked it and is not dropped.
struct Owners {
  Owners() {
    testing::await_ready(arm);
    observer.emplace(*Node::open(
        *make_fastdds_transport(
            {domain.number(), TFDUDE_LOOPBACK_PROFILE, "observer", counters, ""}),
        "observer",
        {{"tower", "", {}}, testing::moved_by("dish", "tower", testing::revolute_named("elbow"))},
        domain.options()));
    idle = counters->writers;
  }
  [[nodiscard]] std::uint64_t still_there() const { return counters->writers - idle; }

  testing::TestDomain domain;
  testing::TemporaryDirectory files;
  Process arm =
      domain.start_daemon({"--partition", "arm", "--urdf", files.write("arm.urdf", kArm)});
  const std::shared_ptr<FastDdsCounters> counters = std::make_shared<FastDdsCounters>();
  std::optional<Node> observer;
  std::uint64_t idle = 0;  // number of its writers while it knows no program
};

void run_program(const Owners& owners, std::size_t number, Journal& journal) {
  const std::string position = std::to_string(0.001 * static_cast<double>(number % 1000));
  Process program = owners.domain.start_cli(
      {"--timeout", "20000", "joint", "arm/elbow=" + position, "observer/elbow=" + position});
  const auto result = testing::finish(program);
  if (result.status == 0 && result.out.rfind("moved ", 0) == 0) return;
  journal.violation("program " + std::to_string(number) + " ended with status " +
                    std::to_string(result.status) + " after it wrote: " + result.out + result.err);
}

void run_batch(const Owners& owners, std::size_t from, std::size_t to, Journal& journal) {
  std::atomic<std::size_t> next{from};
  std::array<std::thread, kAtOnce> threads;
  for (std::thread& thread : threads) {
    thread = std::thread([&] {
      for (std::size_t number = next++; number < to; number = next++) {
        run_program(owners, number, journal);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

/// @return how long it took until all programs were dropped [ms]
double until_dropped(const Owners& owners, Journal& journal) {
  const auto ended = Clock::now();
  while (owners.still_there() > 0 && Clock::now() - ended < kDropWithin) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (const auto left = owners.still_there()) {
    journal.violation(std::to_string(left) + " programs are not dropped two seconds after the end");
  }
  return std::chrono::duration<double, std::milli>(Clock::now() - ended).count();
}

}  // namespace

int run_endings(std::size_t programs) {
  Owners owners;
  Journal journal;
  std::vector<double> dropped;
  const auto begin = Clock::now();
  for (std::size_t done = 0; done < programs && journal.violations() == 0; done += kBatch) {
    run_batch(owners, done, std::min(done + kBatch, programs), journal);
    dropped.push_back(until_dropped(owners, journal));
  }
  if (owners.counters->requests_passed < programs) {
    journal.violation("the observer was asked only " +
                      std::to_string(owners.counters->requests_passed) + " times");
  }
  if (!owners.arm.runs()) journal.violation("the daemon has ended: " + owners.arm.err());
  if (!owners.observer->lookup("arm", "hand")) journal.violation("the daemon does not answer");
  std::printf("%zu programs in %.1f s; from the end of %zu until they were dropped %s\n", programs,
              std::chrono::duration<double>(Clock::now() - begin).count(), kBatch,
              distribution(dropped).c_str());
  return journal.violations() == 0 ? 0 : 1;
}

}  // namespace tfdude::faults
