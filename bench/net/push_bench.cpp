// A pushed path of ten edges: the time of an update from its owner to a watcher, compared with a
// bare Fast DDS sample of the same size and QoS, and the cost of reading the path at the watcher.
//
//   push_bench --mode own   --domain DOMAIN --profile FILE
//   push_bench --mode watch --domain DOMAIN --profile FILE --seconds S --calls N --repetitions R
//
// The owner prints "ready". Then it updates all edges 1,000 times a second, or sends bare samples,
// in turns by the clock that both processes share. The watcher measures:
//   pushed/latency/ours           from before update() until a waiting thread has read the value
//   pushed/latency/dds            from before write() until a thread that waits for the listener
//                                 has the sample
//   pushed/latency/dds_woken      the same if another thread is woken to write the sample, as the
//                                 owner of a pushed path does
//   pushed/latest                 reading the path's newest value with covariance, while it is
//                                 pushed

#include <condition_variable>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

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

enum class Who { kOurs, kDds, kDdsWoken };

std::int64_t turn_at(double moment) { return static_cast<std::int64_t>(moment / kTurn); }

/// Whose turn it is.
Who whose(std::int64_t turn) { return static_cast<Who>(turn % 3); }

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

/// A thread that is woken for each sample, and sends it.
class WokenSender {
 public:
  explicit WokenSender(bench::BareSender& bare) : bare_(bare) {}

  void wake() {
    {
      const std::lock_guard lock(mutex_);
      called_ = Clock::now();
    }
    changed_.notify_one();
  }

 private:
  [[noreturn]] void run() {
    while (true) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return called_.has_value(); });
      const auto called = *std::exchange(called_, std::nullopt);
      lock.unlock();
      bare_.send(called);
    }
  }

  bench::BareSender& bare_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Clock::time_point> called_;
  std::thread thread_{[this] { run(); }};  // last: it uses the other members
};

[[noreturn]] void own(const bench::Arguments& arguments) {
  bench::PushedRobot robot(kJoints, arguments.options("domain"));
  bench::BareSender bare(domain_of(arguments), arguments.text("profile"), pushed_bytes());
  WokenSender woken(bare);
  std::fprintf(stderr, "pushed: %u bytes\n", pushed_bytes());
  std::puts("ready");
  std::fflush(stdout);
  for (double moment = bench::shared_clock();; moment += kPeriod) {
    bench::sleep_until(moment);
    switch (whose(turn_at(moment))) {
      case Who::kOurs:
        robot.move();
        break;
      case Who::kDds:
        bare.send();
        break;
      case Who::kDdsWoken:
        woken.wake();
    }
  }
}

// --- the watcher ---

/// Waits for bare samples.
class BareReceiver final : public edds::DataReaderListener {
 public:
  BareReceiver(std::uint32_t domain, const std::string& profile)
      : endpoints_(domain, profile, bench::listening_end(), *this) {}

  void on_data_available(edds::DataReader* reader) override {
    // There is more than one sample if this thread was late; then the newest counts.
    while (tfdude::fastdds::ok(reader->take_next_sample(&ping_, &info_))) {
      if (!info_.valid_data) continue;
      const std::lock_guard lock(mutex_);
      std::memcpy(&last_, ping_.filler().data(), sizeof last_);
    }
    arrived_.notify_one();
  }

  /// When the last sample was sent [ns].
  [[nodiscard]] std::int64_t last() {
    const std::lock_guard lock(mutex_);
    return last_;
  }

  /// Waits for a sample that was sent later, and replaces the moment; false at the deadline.
  bool wait_for_more(Clock::time_point deadline, std::int64_t& sent) {
    std::unique_lock lock(mutex_);
    if (!arrived_.wait_until(lock, deadline, [&] { return last_ > sent; })) return false;
    sent = last_;
    return true;
  }

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::int64_t last_ = 0;
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
    const auto all = {&ours_.series(), &dds_.series(), &dds_woken_.series()};
    for (int i = 0; i < repetitions; ++i) {
      const double end = bench::shared_clock() + seconds;
      for (double now = 0; (now = bench::shared_clock()) < end;) {
        const std::int64_t turn = turn_at(now);
        const auto rest =
            std::chrono::duration<double>(static_cast<double>(turn + 1) * kTurn - now);
        const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(rest);
        const Who who = whose(turn);
        if (who == Who::kOurs) {
          see_ours(until);
        } else {
          see_bare(until, who == Who::kDds ? dds_ : dds_woken_);
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

  void see_bare(Clock::time_point until, Latencies& latencies) {
    std::int64_t sent = bare_.last();
    while (bare_.wait_for_more(until, sent)) latencies.add(sent, Clock::now());
  }

  [[nodiscard]] std::int64_t newest() const {
    const auto X = must(path_.latest(), "the path");
    return X.stamp ? tfdude::nanoseconds(*X.stamp) : 0;
  }

  PathWatch& path_;
  BareReceiver& bare_;
  Latencies ours_{"ours"};
  Latencies dds_{"dds"};
  Latencies dds_woken_{"dds_woken"};
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
