// Prints what a calm system costs in simulated time, as a line of JSON:
// simulated_scale PARTITIONS FRAMES.
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <string>
#include <sys/resource.h>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "base/log.hpp"
#include "simulation/calm.hpp"

namespace {

using namespace tfdude::simulation;
using Json = nlohmann::ordered_json;

Json json_of(const Load& load) {
  return {{"written", load.written.messages},   {"written_bytes", load.written.bytes},
          {"sent", load.sent.messages},         {"sent_bytes", load.sent.bytes},
          {"received", load.received.messages}, {"received_bytes", load.received.bytes}};
}

Json json_of(const Spent& spent) {
  return {{"mean", json_of(spent.mean)}, {"most", json_of(spent.most)}};
}

Json of_change(const Spent& spent) {
  return {{"all", json_of(spent.all)},
          {"mean", json_of(spent.mean)},
          {"most", json_of(spent.most)},
          {"probes", spent.all.probes}};
}

int print_row(const CalmSize& size) {
  const auto begin = std::chrono::steady_clock::now();
  const auto run = run_calm(size);
  if (!run) {
    std::cerr << "simulated_scale: " << run.error().message << '\n';
    return EXIT_FAILURE;
  }
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const Json row = {
      {"partitions", size.partitions},
      {"frames", size.frames},
      {"served_s", run->served_s},
      {"known_s", run->known_s},
      {"start", json_of(run->start)},
      {"idle_s", json_of(run->idle)},
      {"idle_announcements_s", run->idle.mean.heard},
      {"add", of_change(run->add)},
      {"update", of_change(run->update)},
      {"lookup", of_change(run->lookup)},
      {"join", json_of(run->join)},
      {"run_s", std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count()},
      {"rss_kib", usage.ru_maxrss}};
  std::cout << row.dump() << std::endl;
  return EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Prints what a system costs in simulated time, in which nothing fails.");
  CalmSize size;
  app.add_option("partitions", size.partitions)->required();
  app.add_option("frames", size.frames, "of all partitions together")->required();
  CLI11_PARSE(app, argc, argv);
  tfdude::log().set_level(spdlog::level::off);
  return print_row(size);
}
