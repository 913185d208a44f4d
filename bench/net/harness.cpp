#include "net/harness.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <thread>
#include <utility>

namespace bench {
namespace {

constexpr int kWarmUp = 300;      // calls of each turn at the start
constexpr int kBlockWarmUp = 10;  // calls at the start of each block
constexpr std::size_t kMostFigures = 4;

void warm_up(const Turn& turn, int calls) {
  std::array<double, kMostFigures> dropped{};
  for (int i = 0; i < calls; ++i) turn.once(dropped.data());
}

void measure_block(Turn& turn, int calls) {
  std::array<double, kMostFigures> values{};
  for (int i = 0; i < calls; ++i) {
    turn.once(values.data());
    for (std::size_t k = 0; k < turn.figures.size(); ++k) turn.figures[k].add(values[k]);
  }
}

}  // namespace

Arguments::Arguments(int argc, char** argv) {
  for (int i = 1; i + 1 < argc; i += 2) values_[argv[i]] = argv[i + 1];
}

const std::string& Arguments::text(const std::string& name) const {
  const auto value = values_.find("--" + name);
  if (value == values_.end()) give_up("--" + name + " is missing");
  return value->second;
}

int Arguments::number(const std::string& name) const { return std::stoi(text(name)); }

tfdude::Options Arguments::options(const std::string& domain_name) const {
  tfdude::Options options;
  // What these programs measure are messages; core_bench measures lookups in memory.
  options.shared_memory = false;
  options.domain = static_cast<std::uint32_t>(number(domain_name));
  options.profile = text("profile");
  if (values_.count("--keys") > 0) options.keys = text("keys");
  // A failed call ends the benchmark; a call that a busy computer delays counts as any other.
  options.timeout = std::chrono::seconds(9);
  return options;
}

void give_up(const std::string& message) {
  std::fprintf(stderr, "benchmark given up: %s\n", message.c_str());
  std::fflush(nullptr);
  std::_Exit(1);  // threads of the library may still run
}

tfdude::Transform await_lookup(tfdude::Client& client, const std::string& a, const std::string& b) {
  const auto deadline = Clock::now() + std::chrono::seconds(30);
  while (true) {
    auto X = client.lookup(a, b);
    if (X || Clock::now() > deadline)
      return must(std::move(X), "waiting for the frames").transform();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

double shared_clock() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// A sleep ends about 60 us too late.
void sleep_until(double moment) {
  constexpr double kOversleep = 100e-6;
  while (true) {
    const double left = moment - shared_clock();
    if (left <= 0) return;
    if (left > kOversleep) {
      std::this_thread::sleep_for(std::chrono::duration<double>(left - kOversleep));
    }
  }
}

void measure(std::vector<Turn> turns, const Extent& extent) {
  for (Turn& turn : turns) {
    const auto values = static_cast<std::size_t>(extent.calls * extent.repetitions);
    for (Series& figure : turn.figures) figure.reserve(values);
    warm_up(turn, std::min(kWarmUp, extent.calls));
  }
  for (int repetition = 0; repetition < extent.repetitions; ++repetition) {
    for (int done = 0; done < extent.calls; done += extent.block) {
      for (Turn& turn : turns) {
        warm_up(turn, kBlockWarmUp);
        measure_block(turn, std::min(extent.block, extent.calls - done));
      }
    }
    for (Turn& turn : turns) {
      for (Series& figure : turn.figures) figure.end_repetition();
    }
  }
  for (const Turn& turn : turns) {
    for (const Series& figure : turn.figures) figure.print();
  }
}

}  // namespace bench
