// The traffic whose bytes bench/pushed.py counts: a robot's joints that are pushed to watchers, or
// bare samples of the size of tf2's broadcast, to the same number of listeners. Each mode prints
// "ready", and runs until it is stopped.
//
//   push_load --mode own    --domain DOMAIN --profile FILE --joints N --rate HZ
//   push_load --mode watch  --domain DOMAIN --profile FILE --joints N --watchers N --composed 0|1
//   push_load --mode send   --domain DOMAIN --profile FILE --bytes N --rate HZ
//   push_load --mode listen --domain DOMAIN --profile FILE --watchers N
//
// Each watcher is a participant; all are in one process, which saves processor time, but no bytes.

#include <cstdio>
#include <deque>
#include <string>
#include <unistd.h>
#include <vector>

#include "net/pushed_robot.hpp"

namespace {

using bench::Arguments;
using bench::must;
using tfdude::Client;

void say_ready() {
  std::puts("ready");
  std::fflush(stdout);
}

template <class Step>
[[noreturn]] void repeat(const Arguments& arguments, Step step) {
  say_ready();
  const double period = 1.0 / arguments.number("rate");
  for (double moment = bench::shared_clock();; moment += period) {
    bench::sleep_until(moment);
    step();
  }
}

[[noreturn]] void stay() {
  say_ready();
  while (true) ::pause();
}

std::uint32_t domain_of(const Arguments& arguments) {
  return static_cast<std::uint32_t>(arguments.number("domain"));
}

[[noreturn]] void own(const Arguments& arguments) {
  bench::PushedRobot robot(arguments.number("joints"), arguments.options("domain"));
  repeat(arguments, [&] { robot.move(); });
}

[[noreturn]] void watch(const Arguments& arguments) {
  const std::string end = bench::joint(arguments.number("joints") - 1);
  tfdude::WatchOptions options;
  options.composed = arguments.number("composed") != 0;
  std::vector<Client> clients;
  std::vector<tfdude::PathWatch> paths;
  for (int i = 0; i < arguments.number("watchers"); ++i) {
    clients.push_back(must(Client::open(arguments.options("domain")), "a client"));
    (void)bench::await_lookup(clients.back(), bench::kBase, end);
    paths.push_back(must(clients.back().watch(bench::kBase, end, options), "a pushed path"));
  }
  // Waits until the stream has reached all watchers: the renewals of every second alone are fewer.
  for (const tfdude::PathWatch& path : paths) {
    constexpr std::uint64_t kStreaming = 20;
    const auto deadline = bench::Clock::now() + std::chrono::seconds(20);
    if (!path.wait_for_more(path.messages() + kStreaming, deadline)) {
      bench::give_up("nothing is pushed");
    }
  }
  stay();
}

[[noreturn]] void send(const Arguments& arguments) {
  bench::BareSender sender(domain_of(arguments), arguments.text("profile"),
                           static_cast<std::uint32_t>(arguments.number("bytes")));
  repeat(arguments, [&] { sender.send(); });
}

class Listener final : public tfdude::fastdds::edds::DataReaderListener {
 public:
  Listener(std::uint32_t domain, const std::string& profile)
      : endpoints_(domain, profile, bench::listening_end(), *this) {}

  void on_data_available(tfdude::fastdds::edds::DataReader* reader) override {
    while (tfdude::fastdds::ok(reader->take_next_sample(&ping_, &info_))) continue;
  }

  void await_match() const { bench::await_match(endpoints_); }

 private:
  bench::wire::Ping ping_;
  tfdude::fastdds::edds::SampleInfo info_;
  bench::FloorEndpoints endpoints_;
};

[[noreturn]] void listen(const Arguments& arguments) {
  std::deque<Listener> listeners;
  for (int i = 0; i < arguments.number("watchers"); ++i) {
    listeners.emplace_back(domain_of(arguments), arguments.text("profile"));
  }
  for (const Listener& listener : listeners) listener.await_match();
  stay();
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments(argc, argv);
  const std::string& mode = arguments.text("mode");
  if (mode == "own") own(arguments);
  if (mode == "watch") watch(arguments);
  if (mode == "send") send(arguments);
  if (mode == "listen") listen(arguments);
  bench::give_up("no such mode: " + mode);
}
