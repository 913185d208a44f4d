// Runs whole systems in simulated time: simulate [--seed N] [--count N] [--trace].
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include <CLI/CLI.hpp>

#include "base/log.hpp"
#include "simulation/world.hpp"

namespace {

// The states that must occur at least once in so many runs.
constexpr std::uint64_t kMany = 1000;
constexpr const char* kRare[] = {"a process gave its partition up",
                                 "a process overtook its predecessor",
                                 "an older process was ignored",
                                 "a frame was taken over",
                                 "a conflict was told",
                                 "fault kill",
                                 "fault stop",
                                 "fault pause",
                                 "fault cut",
                                 "fault cut one way",
                                 "fault part",
                                 "fault step clock",
                                 "fault fill disk",
                                 "fault replace",
                                 "fault rename",
                                 "fault reconfigure",
                                 "add state",
                                 "add timeout",
                                 "remove done",
                                 "move done",
                                 "update unreachable",
                                 "a watched path took another route",
                                 "the owner of a watched path was started again",
                                 "watched paths checked"};

}  // namespace

int main(int argc, char** argv) {
  using namespace tfdude::simulation;
  CLI::App app("Runs whole systems in simulated time, each generated from a seed and run twice.");
  std::uint64_t seed = 1;
  std::uint64_t count = 1;
  bool trace = false;
  bool shrunk = false;
  app.add_option("--seed", seed, "the first seed")->capture_default_str();
  app.add_option("--count", count, "how many seeds, one after the other")->capture_default_str();
  app.add_flag("--trace", trace, "print each step");
  app.add_flag("--shrink", shrunk, "of a seed that fails, look for a milder run that fails");
  CLI11_PARSE(app, argc, argv);
  tfdude::log().set_level(spdlog::level::off);
  std::uint64_t failed = 0;
  Instant simulated{};
  std::map<std::string, std::size_t> counts;
  for (std::uint64_t i = 0; i < count; ++i) {
    const Plan plan = draw_plan(seed + i);
    const Run one = run(plan, trace);
    const Run again = run(plan);
    simulated += one.duration;
    for (const auto& [what, times] : one.counts) counts[what] += times;
    const auto differs = first_difference(one.steps, again.steps);
    if (!differs && one.failures.empty()) continue;
    ++failed;
    std::printf("%s\n", plan.text().c_str());
    if (shrunk) {
      const auto fails = [](const Plan& milder) { return !run(milder).failures.empty(); };
      std::printf("  milder: %s\n", shrink(plan, fails).text().c_str());
    }
    if (differs) std::printf("  the second run differs from %s\n", differs->c_str());
    for (const Failure& failure : one.failures) {
      std::printf("  %s: %s\n", failure.kind.c_str(), failure.what.c_str());
    }
  }
  // A state that never occurs is not tested.
  for (const char* rare : kRare) {
    if (count < kMany || counts[rare] > 0) continue;
    ++failed;
    std::printf("  it never happened that %s\n", rare);
  }
  for (const auto& [what, times] : counts) std::printf("  %s: %zu\n", what.c_str(), times);
  std::printf("%llu seeds from %llu on, %.1f simulated hours: %llu failed\n",
              static_cast<unsigned long long>(count), static_cast<unsigned long long>(seed),
              std::chrono::duration<double, std::ratio<3600>>(simulated).count(),
              static_cast<unsigned long long>(failed));
  return failed == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
