#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/description/config.hpp"

#include "support/series.hpp"

// Shared code of the network benchmarks.
namespace bench {

/// "--name value" of the command line; a missing option ends the program with a message.
class Arguments {
 public:
  Arguments(int argc, char** argv);

  [[nodiscard]] const std::string& text(const std::string& name) const;
  [[nodiscard]] int number(const std::string& name) const;
  /// Options for the domain given under a name, with the profile of --profile, and the keys of
  /// --keys if it is given.
  [[nodiscard]] tfdude::Options options(const std::string& domain_name) const;

 private:
  std::map<std::string, std::string> values_;
};

[[noreturn]] void give_up(const std::string& message);

/// Ends the program: measuring a failure would be meaningless.
template <class Value>
void check(const tfdude::Result<Value>& outcome, const char* what) {
  if (!outcome) give_up(std::string(what) + ": " + outcome.error().message);
}

/// The value, or the end of the program.
template <class Value>
Value must(tfdude::Result<Value> outcome, const char* what) {
  check(outcome, what);
  return *std::move(outcome);
}

/// Waits until two frames are connected: many daemons that start at once on one core need longer
/// for discovery than a client waits.
tfdude::Transform await_lookup(tfdude::Client& client, const std::string& a, const std::string& b);

/// Now [s] by a clock that all processes of one computer share.
double shared_clock();
/// Waits until then by that clock; it polls at the end, without sleeping.
void sleep_until(double moment);

/// One side of a comparison: once() makes the calls and writes one value for each of the figures.
struct Turn {
  std::vector<Series> figures;
  std::function<void(double* values)> once;
};

/// How much is measured: `calls` per repetition and turn, in blocks that take turns.
struct Extent {
  int calls = 0;
  int repetitions = 0;
  int block = 500;
};

/// Measures the turns in interleaved blocks, so that other load of the machine affects all of them,
/// and prints their figures. The first calls of a run and of a block are discarded as warm-up.
void measure(std::vector<Turn> turns, const Extent& extent);

/// A turn of one figure in microseconds: one value is the mean of `batch` calls.
template <class Call>
Turn turn(const std::string& key, Call call, int batch = 1) {
  return {{Series(key, "us")}, [call, batch](double* values) {
            const auto start = Clock::now();
            for (int i = 0; i < batch; ++i) call();
            values[0] = microseconds_since(start) / batch;
          }};
}

}  // namespace bench
