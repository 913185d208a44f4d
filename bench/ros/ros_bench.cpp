// Both ends of the bridge to ROS 2, in one process, so that one clock measures latency:
//   ros_bench in     writes to /tf; a watcher of the bridge's partition reads
//   ros_bench out    updates edges of a partition; a reader of /tf reads
//   ros_bench replay writes to /tf the stamps of an hour in a minute, and begins again every 10 s
//   ros_bench bare   writes to /tf; a reader of /relayed reads
//   ros_bench relay  what "bare" measures: passes /tf on to /relayed, and does nothing else
// Options: --ros-domain N --domain N --edges N --rate HZ --per-message N --seconds N
// Prints a line of JSON: microseconds from the write to the end of the reading.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <iostream>
#include <mutex>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/client/node.hpp"

#include "net/harness.hpp"
#include "tfdude-ros/ros_domain.hpp"

namespace {

using namespace tfdude;
using Clock = std::chrono::steady_clock;

std::string frame(int i) { return "edge_" + std::to_string(i); }

/// When each stamp was written, and how long until it was read.
class Latencies {
 public:
  void written(std::int64_t stamp) {
    const std::lock_guard<std::mutex> lock(mutex_);
    written_[stamp] = Clock::now();
  }
  void read(std::int64_t stamp) {
    const auto now = Clock::now();
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = written_.find(stamp);
    if (found == written_.end()) return;
    micros_.push_back(std::chrono::duration<double, std::micro>(now - found->second).count());
    written_.erase(found);
  }
  void print() {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::sort(micros_.begin(), micros_.end());
    const auto at = [&](double share) {
      return micros_.empty() ? -1.0
                             : micros_[static_cast<std::size_t>(
                                   share * static_cast<double>(micros_.size() - 1))];
    };
    std::cout << nlohmann::json{{"read", micros_.size()}, {"lost", written_.size()},
                                {"p50", at(0.5)},         {"p90", at(0.9)},
                                {"p99", at(0.99)},        {"max", at(1)}}
              << std::endl;
  }
  void clear() {
    const std::lock_guard<std::mutex> lock(mutex_);
    written_.clear();
    micros_.clear();
  }

 private:
  std::mutex mutex_;
  std::unordered_map<std::int64_t, Clock::time_point> written_;
  std::vector<double> micros_;
};

struct Bench {
  explicit Bench(const bench::Arguments& arguments)
      : edges(arguments.number("edges")),
        rate(arguments.number("rate")),
        per_message(arguments.number("per-message")),
        seconds(arguments.number("seconds")) {
    options.domain = static_cast<std::uint32_t>(arguments.number("domain"));
    options.profile = kLocalProfile;
    const auto domain = static_cast<std::uint32_t>(arguments.number("ros-domain"));
    ros = bench::must(ros::join_ros_domain({domain, ros::Range::kThisComputer, {"bench", "", 0}}),
                      "ROS");
  }

  /// Calls write(stamp) at the rate; the first second does not count.
  template <class Write>
  void run(Write write) {
    const auto begin = Clock::now();
    for (int i = 0; i < (seconds + 1) * rate; ++i) {
      std::this_thread::sleep_until(begin + std::chrono::nanoseconds(1'000'000'000LL / rate) * i);
      if (i == rate) {
        latencies.clear();
        std::cout << "begin" << std::endl;
      }
      const std::int64_t stamp =
          std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
      latencies.written(stamp);
      write(time_of(stamp));
    }
    std::cout << "end" << std::endl;
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    latencies.print();
  }

  void write_tf(ros::Publisher& tf, Time stamp) const {
    for (int first = 0; first < edges; first += per_message) {
      ros::TfMessage message;
      for (int i = first; i < std::min(edges, first + per_message); ++i) {
        message.push_back({stamp, "root", frame(i), {{0.1, 0.2, 0.3}, {0, 0, 0, 1}}});
      }
      tf.publish(std::move(message));
    }
  }

  /// The reader of a topic sees the last edge of each stamp.
  void read_tf(const std::string& topic) {
    auto described = ros::tf_topic();
    described.name = topic;
    bench::check(ros->subscribe(described,
                                [this](ros::Message&& message, const ros::Source&) {
                                  const auto& last = std::get<ros::TfMessage>(message).back();
                                  if (last.child != frame(edges - 1)) return;
                                  ++received;
                                  latencies.read(nanoseconds(last.stamp));
                                }),
                 "reader");
  }

  int edges;
  int rate;
  int per_message;
  int seconds;
  Options options;
  Latencies latencies;
  std::atomic<int> received{0};
  std::unique_ptr<ros::RosDomain> ros;
};

void in(Bench& bench) {
  auto tf = bench::must(bench.ros->advertise(ros::tf_topic()), "writer");
  auto client = bench::must(Client::open(bench.options), "client");
  while (!client.exists(frame(bench.edges - 1))) {
    bench.write_tf(*tf, std::chrono::system_clock::now());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  const std::string last = frame(bench.edges - 1);
  const auto watch = bench::must(client.watch_edges({last}), "watch");
  std::atomic<bool> stopping{false};
  std::thread reader([&] {
    while (!stopping) {
      const auto messages = watch.messages();
      if (const auto X = watch.lookup("root", last); X && X->stamp) {
        bench.latencies.read(nanoseconds(*X->stamp));
      }
      (void)watch.wait_for_more(messages, Clock::now() + std::chrono::milliseconds(100));
    }
  });
  bench.run([&](Time stamp) { bench.write_tf(*tf, stamp); });
  stopping = true;
  reader.join();
}

void out(Bench& bench) {
  std::vector<FrameSpec> frames{{"root", "", {}}};
  for (int i = 0; i < bench.edges; ++i) frames.push_back({frame(i), "root", {}});
  auto node = bench::must(Node::open("robot", frames, bench.options), "node");
  bench.read_tf("/tf");
  std::vector<EdgeUpdate> edges;
  for (int i = 0; i < bench.edges; ++i) edges.push_back({frame(i), {}});
  while (bench.received == 0) {
    bench::check(node.update(edges, std::chrono::system_clock::now()), "update");
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  bench.run([&](Time stamp) { bench::check(node.update(edges, stamp), "update"); });
}

void replay(Bench& bench) {
  auto tf = bench::must(bench.ros->advertise(ros::tf_topic()), "writer");
  const Time start(std::chrono::hours(24));
  int written = 0;
  const auto next = [&](Time) {
    const auto since = std::chrono::seconds(60) * (written++ % (10 * bench.rate)) / bench.rate;
    bench.write_tf(*tf, start + since);
  };
  auto client = bench::must(Client::open(bench.options), "client");
  while (!client.exists(frame(bench.edges - 1))) {
    next({});
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  bench.run(next);
  const auto history = bench::must(client.history(frame(0)), "history");
  std::cout << "samples of an edge: " << history.front().samples << std::endl;
}

void bare(Bench& bench) {
  auto tf = bench::must(bench.ros->advertise(ros::tf_topic()), "writer");
  bench.read_tf("/relayed");
  while (bench.received == 0) {
    bench.write_tf(*tf, std::chrono::system_clock::now());
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  bench.run([&](Time stamp) { bench.write_tf(*tf, stamp); });
}

void relay(Bench& bench) {
  auto topic = ros::tf_topic();
  topic.name = "/relayed";
  auto relayed = bench::must(bench.ros->advertise(topic), "writer");
  bench::check(
      bench.ros->subscribe(ros::tf_topic(), [&](ros::Message&& message,
                                                const ros::Source&) { relayed->publish(message); }),
      "reader");
  std::cout << "ready" << std::endl;
  (void)std::getchar();  // until its input ends
  bench.ros = nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  Bench bench(bench::Arguments(argc - 1, argv + 1));
  if (what == "in") {
    in(bench);
  } else if (what == "out") {
    out(bench);
  } else if (what == "replay") {
    replay(bench);
  } else if (what == "bare") {
    bare(bench);
  } else {
    relay(bench);
  }
  return 0;
}
