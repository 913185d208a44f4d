// What a client that floods an owner with requests costs another client; for bench/flood.py.
//
//   flood_bench --mode probe --domain DOMAIN --profile FILE --calls N    prints a Series of lookups
//   flood_bench --mode flood --domain DOMAIN --profile FILE    sends requests, ignores replies
//   flood_bench --mode large --domain DOMAIN --profile FILE    sends the largest ones
//   flood_bench --mode burn  --domain DOMAIN --profile FILE    only uses processor time
//
// All ask partition 'robot' for the edge of 'robot_1'. Those that send or burn print "ready", and
// run until they are stopped.

#include <atomic>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>

#include "tfdude/transport/fastdds.hpp"

#include "net/harness.hpp"
#include "support/deaf_handler.hpp"
#include "transport/port.hpp"

namespace {

using namespace tfdude;
using bench::must;

constexpr const char* kOwner = "robot";

[[noreturn]] void flood(const bench::Arguments& arguments, std::size_t segments) {
  const Options options = arguments.options("domain");
  testing::DeafHandler deaf;  // the replies are of no interest
  auto transport = must(make_fastdds_transport({options.domain, options.profile, {}, {}}), "it");
  bench::check(transport->start(deaf), "start");
  Request request;
  request.id = "robot_1";
  LookupRequest lookup;
  lookup.segments.assign(segments, {"world", "robot_1"});
  request.body = std::move(lookup);
  std::puts("ready");
  std::fflush(stdout);
  while (true) {
    ++request.sequence;
    (void)transport->send(kOwner, request,
                          std::chrono::steady_clock::now() + std::chrono::seconds(10));
  }
}

[[noreturn]] void burn() {
  std::puts("ready");
  std::fflush(stdout);
  std::atomic<std::uint64_t> count{0};
  while (true) ++count;
}

int probe(const bench::Arguments& arguments) {
  auto client = must(Client::open(arguments.options("domain")), "a client");
  (void)bench::await_lookup(client, "world", "robot_1");
  bench::Series times("flood/lookup", "us");
  for (int i = 0; i < arguments.number("calls"); ++i) {
    const auto start = bench::Clock::now();
    bench::check(client.lookup("world", "robot_1"), "lookup");
    times.add(bench::microseconds_since(start));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  times.end_repetition();
  times.print();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Arguments arguments(argc, argv);
  const std::string& mode = arguments.text("mode");
  if (mode == "probe") return probe(arguments);
  if (mode == "burn") burn();
  flood(arguments, mode == "large" ? kMaxItems : 1);
}
