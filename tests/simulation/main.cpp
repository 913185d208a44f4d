// Runs whole systems in simulated time: simulate [--seed N] [--count N] [--trace] [--shrink].
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include <CLI/CLI.hpp>

#include "base/log.hpp"
#include "simulation/shrink.hpp"
#include "simulation/world.hpp"

namespace {

// The states that must occur at least once in so many runs.
constexpr std::uint64_t kManySeeds = 1000;
constexpr const char* kRare[] = {"a process gave its partition up",
                                 "a process overtook its predecessor",
                                 "an older process was ignored",
                                 "a frame was taken over",
                                 "a conflict was told",
                                 "fault kill",
                                 "fault stop",
                                 "fault pause",
                                 "fault cut",
                                 "fault mute",
                                 "fault deafen",
                                 "fault power loss",
                                 "fault part",
                                 "fault step clock",
                                 "a power loss has lost stored changes",
                                 "lasting kill",
                                 "lasting pause",
                                 "lasting cut",
                                 "lasting mute",
                                 "lasting part",
                                 "lasting fill disk",
                                 "fault fill disk",
                                 "fault replace",
                                 "fault rename",
                                 "fault reconfigure",
                                 "add state",
                                 "add timeout",
                                 "remove done",
                                 "move done",
                                 "update unreachable",
                                 "joint done",
                                 "forget done",
                                 "forget partition_taken",
                                 "somebody forgets who is lost",
                                 "a watched path took another route",
                                 "the owner of a watched path was started again",
                                 "watched paths checked",
                                 "a node wrote a watched value",
                                 "node-add done",
                                 "node-move done",
                                 "node-remove done",
                                 "a streamed value was applied",
                                 "a streamed joint was moved",
                                 "a streamed sample was seen",
                                 "a late sample was taken",
                                 "a sample was looked up at an instant",
                                 "the clock of a source jumped back",
                                 "sampler: sample too_old",
                                 "a history was restarted",
                                 "sampled edges checked",
                                 "waiting lookup done after a while",
                                 "waiting lookup timeout",
                                 "streams checked",
                                 "a measured path was looked up",
                                 "an earlier instant was predicted",
                                 "fault deputize",
                                 "a deputy's removal was checked"};

using namespace tfdude::simulation;

/// What has come of all runs so far.
struct Total {
  std::uint64_t failed = 0;
  Instant simulated{};
  std::map<std::string, std::size_t> counts;
};

// Prints what is left of a run that fails, and how to run that again.
void print_shrunk(const Remains& failing, bool trace) {
  const Remains left = shrink(failing);
  const Plan plan = plan_without(left.seed, left.without, left.storm);
  std::printf("shrunk to scripts/simulate %s\n%s\n", left.options().c_str(), plan.text().c_str());
  const Run shrunk = run(plan, trace);
  std::printf("  %zu operations\n", shrunk.operations.size());
  if (shrunk.failures.empty()) return;
  const Failure& first = shrunk.failures.front();
  std::printf("  %s: %s\n", first.kind.c_str(), first.what.c_str());
}

void run_twice(const Remains& remains, bool trace, Total& total) {
  const Plan plan = plan_without(remains.seed, remains.without, remains.storm);
  const Run one = run(plan, trace);
  const Run again = run(plan);
  total.simulated += one.duration;
  for (const auto& [what, times] : one.counts) total.counts[what] += times;
  const auto differs = first_difference(one.steps, again.steps);
  if (!differs && one.failures.empty()) return;
  ++total.failed;
  std::printf("%s\n", plan.text().c_str());
  if (differs) std::printf("  the second run differs from %s\n", differs->c_str());
  for (const Failure& failure : one.failures) {
    std::printf("  %s: %s\n", failure.kind.c_str(), failure.what.c_str());
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Runs whole systems in simulated time, each generated from a seed and run twice.");
  Remains remains{1, {}, Instant::max()};
  std::uint64_t count = 1;
  std::string without;
  std::int64_t storm = 0;
  bool trace = false;
  bool shrunk = false;
  bool first_only = false;
  app.add_option("--seed", remains.seed, "the first seed")->capture_default_str();
  app.add_option("--count", count, "how many seeds, one after the other")->capture_default_str();
  app.add_option("--without", without, "leave out decisions and operations: 3,7,1000-1016");
  app.add_option("--storm", storm, "how long there are faults at most [ms]");
  app.add_flag("--trace", trace, "print each step");
  app.add_flag("--shrink", shrunk,
               "of a seed that fails, look for a smaller run that fails in the same way");
  app.add_flag("--first", first_only, "ends at the first seed that fails");
  CLI11_PARSE(app, argc, argv);
  tfdude::log().set_level(spdlog::level::off);
  remains.without = numbers_of(without);
  if (storm > 0) remains.storm = milliseconds(storm);
  Total total;
  const std::uint64_t first = remains.seed;
  for (; remains.seed < first + count; ++remains.seed) {
    if (first_only && total.failed > 0) return EXIT_FAILURE;
    const std::uint64_t failed = total.failed;
    run_twice(remains, trace && !shrunk, total);
    if (shrunk && total.failed > failed) print_shrunk(remains, trace);
  }
  // A state that never occurs is not tested.
  for (const char* rare : kRare) {
    if (count < kManySeeds || total.counts[rare] > 0) continue;
    ++total.failed;
    std::printf("  it never happened that %s\n", rare);
  }
  for (const auto& [what, times] : total.counts) std::printf("  %s: %zu\n", what.c_str(), times);
  std::printf("%llu seeds from %llu on, %.1f simulated hours: %llu failed\n",
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(first),
              std::chrono::duration<double, std::ratio<3600>>(total.simulated).count(),
              static_cast<unsigned long long>(total.failed));
  return total.failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
