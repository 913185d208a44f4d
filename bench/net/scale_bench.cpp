// Network calls as the number of partitions, clients or frames grows; bench/net_stage.py starts the
// daemons and echoes.
//
//   scale_bench --mode partitions --partitions N --central DOMAIN --domain DOMAIN
//               --floor DOMAIN --udp-ports P,P,...
//     One lookup along a chain across N partitions, compared with the same lookup of one daemon
//     that owns all frames, and with the lower bounds of asking N processes at once: as many bytes
//     to each of N processes and back, over bare Fast DDS with the same QoS, and over bare UDP.
//     scale/partitions/N/decentralized, /centralized, /dds_floor, /udp_floor
//   scale_bench --mode clients --domain DOMAIN
//     1 to 16 concurrent clients, each with its own thread, that ask one owner.
//     scale/clients/N/latency, /rate
//   scale_bench --mode frames --frames N,N,... --domain-0 DOMAIN --domain-1 DOMAIN...
//     The same lookup and update of owners of N frames each, each in its own domain.
//     scale/frames/N/lookup, /update
//
// All modes take --profile FILE --calls N --repetitions R. Frame chain_0 is the parent of chain_1,
// and so on.

#include <algorithm>
#include <atomic>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "net/floor_dds.hpp"
#include "net/harness.hpp"
#include "net/udp.hpp"

namespace {

using bench::Arguments;
using bench::must;
using bench::Series;
using tfdude::Client;

std::vector<int> numbers(const std::string& list) {
  std::vector<int> all;
  std::istringstream in(list);
  for (std::string one; std::getline(in, one, ',');) all.push_back(std::stoi(one));
  return all;
}

bench::Extent extent_of(const Arguments& arguments) {
  return {arguments.number("calls"), arguments.number("repetitions"), 100};
}

std::string chain(int number) { return "chain_" + std::to_string(number); }

/// A lookup that must succeed; only its time matters.
auto lookup(Client& client, const std::string& a, const std::string& b) {
  return [&client, a, b] { bench::check(client.lookup(a, b), "lookup"); };
}

// --- partitions ---

class UdpFanOut {
 public:
  UdpFanOut(std::vector<int> ports, const bench::Sizes& sizes)
      : ports_(std::move(ports)), sizes_(sizes) {}

  void call() {
    ++number_;
    for (const int port : ports_) {
      socket_.ask(static_cast<std::uint16_t>(port), number_, sizes_.request, sizes_.reply);
    }
    for (std::size_t missing = ports_.size(); missing > 0; --missing) socket_.await_reply();
  }

 private:
  std::vector<int> ports_;
  const bench::Sizes sizes_;
  std::uint32_t number_ = 0;
  bench::UdpSocket socket_;
};

/// Those of a lookup of the part of the path that one owner has.
bench::Sizes sizes_of_segment() {
  return bench::sizes_of({1, chain(1), tfdude::LookupRequest{{{chain(1), chain(3)}}}}, "p1",
                         {1, 0, tfdude::SegmentValues{{{tfdude::Transform()}}, {}, {}, {}}});
}

void compare_partitions(const Arguments& arguments) {
  const int partitions = arguments.number("partitions");
  const auto key = [&](const char* what) {
    return "scale/partitions/" + std::to_string(partitions) + "/" + what;
  };
  auto central = must(Client::open(arguments.options("central")), "the centralized deployment");
  auto decentral = must(Client::open(arguments.options("domain")), "the decentralized deployment");
  const bench::Sizes sizes = sizes_of_segment();
  UdpFanOut udp(numbers(arguments.text("udp-ports")), sizes);
  bench::FloorEnds ends = bench::asking_end();
  ends.written.clear();
  for (int i = 0; i < partitions; ++i) ends.written.push_back(std::to_string(i));
  bench::DdsPing dds(static_cast<std::uint32_t>(arguments.number("floor")),
                     arguments.text("profile"), ends);
  dds.prepare(sizes);
  // Each partition owns two frames; the first frame of the first partition is the root.
  const std::string last = chain(2 * partitions - 1);
  (void)bench::await_lookup(central, chain(0), last);
  (void)bench::await_lookup(decentral, chain(0), last);
  bench::measure({bench::turn(key("decentralized"), lookup(decentral, chain(0), last)),
                  bench::turn(key("centralized"), lookup(central, chain(0), last)),
                  bench::turn(key("dds_floor"), [&] { dds.call(); }),
                  bench::turn(key("udp_floor"), [&] { udp.call(); })},
                 extent_of(arguments));
}

// --- clients ---

/// The measurements of concurrent clients.
struct Crowd {
  explicit Crowd(int count)
      : size(count),
        latency("scale/clients/" + std::to_string(count) + "/latency", "us"),
        rate("scale/clients/" + std::to_string(count) + "/rate", "1/s") {}

  int size;
  Series latency;
  Series rate;
};

void ask_at_once(std::vector<std::unique_ptr<Client>>& clients, Crowd& crowd, int calls) {
  const int each = std::max(calls / crowd.size, 1);
  std::vector<std::vector<double>> times(static_cast<std::size_t>(crowd.size));
  std::vector<std::thread> threads;
  std::atomic<bool> go{false};
  for (std::size_t i = 0; i < times.size(); ++i) {
    threads.emplace_back([&, i] {
      const auto call = lookup(*clients[i], chain(1), chain(3));
      times[i].reserve(static_cast<std::size_t>(each));
      while (!go) std::this_thread::yield();
      for (int k = 0; k < each; ++k) {
        const auto start = bench::Clock::now();
        call();
        times[i].push_back(bench::microseconds_since(start));
      }
    });
  }
  const auto start = bench::Clock::now();
  go = true;
  for (std::thread& thread : threads) thread.join();
  crowd.rate.add(1e6 * each * crowd.size / bench::microseconds_since(start));
  for (const auto& some : times) {
    for (const double time : some) crowd.latency.add(time);
  }
  crowd.rate.end_repetition();
  crowd.latency.end_repetition();
}

void compare_clients(const Arguments& arguments) {
  std::vector<Crowd> crowds;
  for (const int count : {1, 2, 4, 8, 16}) crowds.emplace_back(count);
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < crowds.back().size; ++i) {
    clients.push_back(
        std::make_unique<Client>(must(Client::open(arguments.options("domain")), "a client")));
    for (int k = 0; k < 100; ++k) lookup(*clients.back(), chain(1), chain(3))();  // warm-up
  }
  for (int i = 0; i < arguments.number("repetitions"); ++i) {
    for (Crowd& crowd : crowds) ask_at_once(clients, crowd, arguments.number("calls"));
  }
  for (const Crowd& crowd : crowds) {
    crowd.latency.print();
    crowd.rate.print();
  }
}

// --- frames ---

void compare_frames(const Arguments& arguments) {
  const std::vector<int> frames = numbers(arguments.text("frames"));
  std::vector<std::unique_ptr<Client>> clients;
  std::vector<bench::Turn> turns;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto options = arguments.options("domain-" + std::to_string(i));
    clients.push_back(std::make_unique<Client>(must(Client::open(options), "a client")));
    Client& client = *clients.back();
    const auto X = bench::await_lookup(client, chain(0), chain(1));
    const std::string key = "scale/frames/" + std::to_string(frames[i]);
    turns.push_back(bench::turn(key + "/lookup", lookup(client, chain(1), chain(3))));
    turns.push_back(bench::turn(key + "/update", [&client, X, frame = chain(1)] {
      bench::check(client.update(frame, X), "update");
    }));
  }
  bench::measure(std::move(turns), extent_of(arguments));
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments(argc, argv);
  const std::string& mode = arguments.text("mode");
  if (mode == "partitions") {
    compare_partitions(arguments);
  } else if (mode == "clients") {
    compare_clients(arguments);
  } else if (mode == "frames") {
    compare_frames(arguments);
  } else {
    bench::give_up("no mode " + mode);
  }
  return 0;
}
