#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/description/config.hpp"

#include "support/series.hpp"

// What the network benchmarks have in common.
namespace bench {

/// "--name value" of the command line; whatever is not there ends the program with a message.
class Arguments {
 public:
  Arguments(int argc, char** argv);

  [[nodiscard]] const std::string& text(const std::string& name) const;
  [[nodiscard]] int number(const std::string& name) const;
  /// How to join the domain given under a name, with the profile of --profile.
  [[nodiscard]] tfdude::Options options(const std::string& domain_name) const;

 private:
  std::map<std::string, std::string> values_;
};

[[noreturn]] void give_up(const std::string& message);

/// A benchmark that measured a failure would measure nothing.
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

/// Waits until two frames are connected: many daemons that start at once on one core need longer to
/// meet than a client looks round for.
tfdude::Transform await_lookup(tfdude::Client& client, const std::string& a, const std::string& b);

/// Now [s] by a clock that all processes of one computer share.
double shared_clock();
/// Until then by that clock, the end of it awake.
void sleep_until(double moment);

/// One side of a comparison: once() makes the calls and writes one value for each of the figures.
struct Turn {
  std::vector<Series> figures;
  std::function<void(double* values)> once;
};

/// How much is measured: `calls` a repetition and turn, in blocks that take turns.
struct Extent {
  int calls = 0;
  int repetitions = 0;
  int block = 500;
};

/// Measures the turns in interleaved blocks, so that what else the machine does meets all of them,
/// and prints their figures. What comes first in a run and in a block is discarded as warm-up.
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
