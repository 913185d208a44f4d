// A pushed path of ten edges: the time of an update from its owner to a watcher, compared with a
// bare Fast DDS sample of the same size and QoS, and the cost of reading the path at the watcher.
//
//   push_bench --mode own   --domain DOMAIN --profile FILE
//   push_bench --mode watch --domain DOMAIN --profile FILE --seconds S --calls N --repetitions R
//
// The owner prints "ready". Then it updates all edges 1,000 times a second, or sends bare samples,
// in turns by the clock that both processes share. The watcher measures:
//   pushed/latency/ours           from before update() until a waiting thread has read the new
// value
//   pushed/latency/dds            from before write() until a thread that waits for the listener
// has
//                                 the sample
//   pushed/latency/dds_listener   the same until the listener has it
//   pushed/latest                 reading the path's newest value with covariance, while it is
//                                 pushed

#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <string>

#include "net/pushed_robot.hpp"
#include "transport/fastdds/codec.hpp"

namespace {

namespace edds = tfdude::fastdds::edds;
using bench::Clock;
using bench::must;
using bench::Series;
using tfdude::Client;
using tfdude::PathWatch;

constexpr int kJoints = 10;
constexpr double kPeriod = 1e-3;
constexpr double kTurn = 0.25;  // duration of a turn [s]

/// The number of the turn: tf-dude has the even ones.
std::int64_t turn_at(double moment) { return static_cast<std::int64_t>(moment / kTurn); }

/// CDR bytes of the message that is pushed with each update.
std::uint32_t pushed_bytes() {
  tfdude::PushedValues pushed;
  for (std::uint32_t i = 0; i < kJoints; ++i) {
    // The joints' covariances stay the same, so they are not pushed again.
    pushed.entries.push_back({i, tfdude::Time(), {}, {}, 1, {}, 1, true});
  }
  return bench::payload_size<tfdude::wire::StatePubSubType>(tfdude::fastdds::to_wire(pushed));
}

std::uint32_t domain_of(const bench::Arguments& arguments) {
  return static_cast<std::uint32_t>(arguments.number("domain"));
}

[[noreturn]] void own(const bench::Arguments& arguments) {
  bench::PushedRobot robot(kJoints, arguments.options("domain"));
  bench::BareSender bare(domain_of(arguments), arguments.text("profile"), pushed_bytes());
  std::fprintf(stderr, "pushed: %u bytes\n", pushed_bytes());
  std::puts("ready");
  std::fflush(stdout);
  for (double moment = bench::shared_clock();; moment += kPeriod) {
    bench::sleep_until(moment);
    if (turn_at(moment) % 2 == 0) {
      robot.move();
    } else {
      bare.send();
    }
  }
}

// --- the watcher ---

/// Waits for bare samples.
class BareReceiver final : public edds::DataReaderListener {
 public:
  struct Arrival {
    std::int64_t sent = 0;    // [ns]
    Clock::time_point heard;  // by the listener
  };

  BareReceiver(std::uint32_t domain, const std::string& profile)
      : endpoints_(domain, profile, bench::kPongTopic, bench::kPingTopic, *this, "update") {}

  void on_data_available(edds::DataReader* reader) override {
    // There is more than one sample if this thread was late; then the newest counts.
    while (tfdude::fastdds::ok(reader->take_next_sample(&ping_, &info_))) {
      if (!info_.valid_data) continue;
      const std::lock_guard lock(mutex_);
      std::memcpy(&last_.sent, ping_.filler().data(), sizeof last_.sent);
      last_.heard = Clock::now();
    }
    arrived_.notify_one();
  }

  [[nodiscard]] Arrival last() {
    const std::lock_guard lock(mutex_);
    return last_;
  }

  /// Waits for a sample that was sent after the given one, and replaces it; false at the deadline.
  bool wait_for_more(Clock::time_point deadline, Arrival& arrival) {
    std::unique_lock lock(mutex_);
    if (!arrived_.wait_until(lock, deadline, [&] { return last_.sent > arrival.sent; })) {
      return false;
    }
    arrival = last_;
    return true;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  Arrival last_;
  bench::wire::Ping ping_;
  edds::SampleInfo info_;
  bench::FloorEndpoints endpoints_;
};

/// Latencies, without the first one after a pause.
class Latencies {
 public:
  explicit Latencies(const std::string& who) : series_("pushed/latency/" + who, "us") {}

  void add(std::int64_t sent, Clock::time_point seen) {
    constexpr int kWarmUp = 10;
    constexpr std::int64_t kPause = 50000000;  // [ns]
    if (sent - last_ > kPause) since_pause_ = 0;
    last_ = sent;
    if (++since_pause_ <= kWarmUp) return;
    const auto took = seen.time_since_epoch() - std::chrono::nanoseconds(sent);
    series_.add(std::chrono::duration<double, std::micro>(took).count());
  }

  Series& series() { return series_; }

 private:
  Series series_;
  std::int64_t last_ = 0;
  int since_pause_ = 0;
};

class Watcher {
 public:
  Watcher(PathWatch& path, BareReceiver& bare) : path_(path), bare_(bare) {}

  void run(double seconds, int repetitions) {
    const auto all = {&ours_.series(), &dds_.series(), &dds_listener_.series()};
    for (int i = 0; i < repetitions; ++i) {
      const double end = bench::shared_clock() + seconds;
      for (double now = 0; (now = bench::shared_clock()) < end;) {
        const std::int64_t turn = turn_at(now);
        const auto rest =
            std::chrono::duration<double>(static_cast<double>(turn + 1) * kTurn - now);
        const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(rest);
        if (turn % 2 == 0) {
          see_ours(until);
        } else {
          see_bare(until);
        }
      }
      for (Series* series : all) series->end_repetition();
    }
    for (const Series* series : all) series->print();
  }

 private:
  // Nobody waited for samples that came after the end of the last turn.
  void see_ours(Clock::time_point until) {
    std::uint64_t messages = path_.messages();
    std::int64_t last = newest();
    while (path_.wait_for_more(messages, until)) {
      messages = path_.messages();
      const std::int64_t sent = newest();
      const auto seen = Clock::now();
      // The renewal of every second arrives as a message, too.
      if (sent > last) ours_.add(sent, seen);
      last = sent;
    }
  }

  void see_bare(Clock::time_point until) {
    BareReceiver::Arrival arrival = bare_.last();
    while (bare_.wait_for_more(until, arrival)) {
      dds_.add(arrival.sent, Clock::now());
      dds_listener_.add(arrival.sent, arrival.heard);
    }
  }

  [[nodiscard]] std::int64_t newest() const {
    const auto X = must(path_.latest(), "the path");
    return X.stamp ? tfdude::nanoseconds(*X.stamp) : 0;
  }

  PathWatch& path_;
  BareReceiver& bare_;
  Latencies ours_{"ours"};
  Latencies dds_{"dds"};
  Latencies dds_listener_{"dds_listener"};
};

void watch(const bench::Arguments& arguments) {
  auto client = must(Client::open(arguments.options("domain")), "a client");
  const std::string end = bench::joint(kJoints - 1);
  (void)bench::await_lookup(client, bench::kBase, end);
  PathWatch path = must(client.watch(bench::kBase, end), "a pushed path");
  BareReceiver bare(domain_of(arguments), arguments.text("profile"));
  const int repetitions = arguments.number("repetitions");
  Watcher(path, bare).run(arguments.number("seconds"), repetitions);
  constexpr int kBatch = 20;
  bench::measure({bench::turn(
                     "pushed/latest", [&] { bench::check(path.latest(), "the path"); }, kBatch)},
                 {arguments.number("calls"), repetitions});
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Arguments arguments(argc, argv);
  if (arguments.text("mode") == "own") own(arguments);
  watch(arguments);
  return 0;
}
