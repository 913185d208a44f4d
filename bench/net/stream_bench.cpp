// Streamed updates: one publisher in one process sends all 100 edges of an owner in another process
// at a fixed rate; then the positions of 30 joints, which move 30 other edges.
//
//   stream_bench --mode own     --shared FILE --domain DOMAIN --profile FILE
//   stream_bench --mode publish --shared FILE --domain DOMAIN --profile FILE --seconds S
//                --repetitions R
//
// Both take --keys DIR, too. The owner prints "ready"; the publisher measures, and prints:
//   stream/1khz/latency       from before publish() until a lookup in the owner sees the value [us]
//   stream/1khz/owner_cpu     processor time of the owner [% of one core], one value per repetition
//   stream/1khz/lost          lost samples, one value per repetition
//   stream/highest_rate       the highest rate without loss [Hz], of 1, 2, 4... kHz and as fast as
//                             publish() returns
//   stream/unthrottled/rate   as fast as publish() returns [Hz]
//   stream/unthrottled/lost   loss at this rate [%]
//   stream/joints/...         the first three of these for the joints
//
// The first edge's translation contains the moment of publishing, by a clock that both processes
// share; so does the first joint's position.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <functional>
#include <string>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/fastdds.hpp"

#include "net/harness.hpp"
#include "net/stream_owner.hpp"

namespace {

using namespace tfdude;
using bench::must;
using bench::Series;
using bench::shared_clock;
using bench::StreamState;

constexpr int kEdges = 100;
constexpr int kJoints = 30;
constexpr const char* kPartition = "joints";
constexpr const char* kRoot = "base";

std::string joint(int number) { return "joint_" + std::to_string(number); }
std::string name_of_joint(int number) { return "joint_" + std::to_string(number); }
std::string carriage(int number) { return "carriage_" + std::to_string(number); }

// The first joint is prismatic, along x; the others are revolute, as most joints are.
FrameSpec moved_frame(int number) {
  JointSpec spec;
  spec.name = name_of_joint(number);
  spec.type = number == 0 ? JointType::kPrismatic : JointType::kContinuous;
  spec.joint = number == 0 ? prismatic_joint({}, {1, 0, 0}) : revolute_joint({}, {0, 0.6, 0.8});
  return {carriage(number), kRoot, {}, {}, {}, spec};
}

// --- the owner ---

/// Checks with a lookup whether received values are visible.
class Latency final : public bench::AppliedListener {
 public:
  explicit Latency(StreamState& state) : state_(state) {}

  void watch(Node& node) {
    root_ = must(node.find(kRoot), "the root");
    edge_ = must(node.find(joint(0)), "the first edge");
    carriage_ = must(node.find(carriage(0)), "the first joint's edge");
    node_ = &node;
  }

  void on_applied(bench::Streamed what) override {
    Node* node = node_;
    if (node == nullptr) return;
    const Handle first = what == bench::Streamed::kEdges ? edge_ : carriage_;
    const StampedTransform seen = must(node->lookup(root_, first), "a lookup");
    const double latency = 1e6 * (shared_clock() - seen.pose.translation().x());
    const std::uint64_t count = state_.latency_count.load();
    if (count < bench::kMostLatencies) state_.latencies[count] = latency;
    state_.latency_count.store(count + 1);
    ++state_.applied;
  }

 private:
  StreamState& state_;
  std::atomic<Node*> node_{nullptr};
  Handle root_;
  Handle edge_;
  Handle carriage_;
};

[[noreturn]] void own(const bench::Arguments& arguments) {
  StreamState& state = bench::map_stream_state(arguments.text("shared"));
  const Options options = arguments.options("domain");
  std::vector<FrameSpec> frames{{kRoot, "", {}}};
  for (int i = 0; i < kEdges; ++i) frames.push_back({joint(i), kRoot, {}});
  for (int i = 0; i < kJoints; ++i) frames.push_back(moved_frame(i));
  Latency latency(state);
  auto transport = must(
      make_fastdds_transport({options.domain, options.profile, kPartition, {}, {}, options.keys}),
      "a transport");
  auto node =
      must(Node::open(bench::watch(std::move(transport), latency), kPartition, frames, options),
           "a node");
  latency.watch(node);
  state.owner_pid = getpid();
  std::puts("ready");
  std::fflush(stdout);
  while (true) ::pause();
}

// --- the publisher ---

struct Run {
  double rate = 0;  // the rate reached [Hz]
  double owner_cpu = 0;
  double published = 0;
  double lost = 0;
};

class Publisher {
 public:
  using Publish = std::function<void()>;

  Publisher(Publish publish, StreamState& state) : publish_(std::move(publish)), state_(state) {
    if (::clock_getcpuclockid(state_.owner_pid, &owner_clock_) != 0) bench::give_up("no owner");
  }

  /// @param rate  [Hz]; 0: as fast as possible
  Run run(double rate, double seconds) {
    const std::uint64_t before = state_.applied;
    state_.latency_count = 0;
    const double cpu_before = owner_cpu();
    const double start = shared_clock();
    std::uint64_t published = 0;
    while (shared_clock() < start + seconds) {
      if (rate > 0) bench::sleep_until(start + static_cast<double>(published) / rate);
      publish_();
      ++published;
    }
    const double took = shared_clock() - start;
    await_rest(before + published);
    const double count = static_cast<double>(published);
    return {count / took, 100 * (owner_cpu() - cpu_before) / (shared_clock() - start), count,
            static_cast<double>(before + published - state_.applied)};
  }

 private:
  // Waits until everything is applied, or nothing more arrives.
  void await_rest(std::uint64_t expected) const {
    std::uint64_t seen = 0;
    do {
      seen = state_.applied;
      for (int i = 0; i < 20 && state_.applied < expected; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    } while (state_.applied < expected && state_.applied != seen);
  }

  [[nodiscard]] double owner_cpu() const {
    timespec time{};
    ::clock_gettime(owner_clock_, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  const Publish publish_;
  StreamState& state_;
  clockid_t owner_clock_{};
};

Publisher::Publish edges_to(Client& client) {
  std::vector<EdgeUpdate> edges;
  for (int i = 0; i < kEdges; ++i) edges.push_back({joint(i), {}});
  return [&client, edges]() mutable {
    edges[0].X_PC.pose = Pose::trusted(Eigen::Quaterniond::Identity(), {shared_clock(), 0, 0});
    bench::check(client.publish(edges), "publish");
  };
}

Publisher::Publish joints_to(Client& client) {
  std::vector<std::string> names;
  for (int i = 0; i < kJoints; ++i) names.push_back(name_of_joint(i));
  std::vector<double> positions(kJoints, 0.5);
  const std::vector<double> variances(kJoints, 1e-6);
  return [&client, names, positions, variances]() mutable {
    positions[0] = shared_clock();
    bench::check(client.publish_joints(names, positions, variances), "publish_joints");
  };
}

void measure_1khz(const std::string& name, Publisher& publisher, const StreamState& state,
                  double seconds, int repetitions) {
  (void)publisher.run(1000, 0.5);  // warm-up
  Series latency(name + "/1khz/latency", "us");
  Series cpu(name + "/1khz/owner_cpu", "%");
  Series lost(name + "/1khz/lost", "samples");
  for (int i = 0; i < repetitions; ++i) {
    const Run run = publisher.run(1000, seconds);
    const std::size_t count = std::min<std::size_t>(state.latency_count, bench::kMostLatencies);
    for (std::size_t k = 0; k < count; ++k) latency.add(state.latencies[k]);
    cpu.add(run.owner_cpu);
    lost.add(run.lost);
    for (Series* series : {&latency, &cpu, &lost}) series->end_repetition();
  }
  for (const Series* series : {&latency, &cpu, &lost}) series->print();
}

void measure_highest(Publisher& publisher, double seconds, int repetitions) {
  Series highest("stream/highest_rate", "Hz");
  Series unthrottled("stream/unthrottled/rate", "Hz");
  Series lost("stream/unthrottled/lost", "%");
  for (int i = 0; i < repetitions; ++i) {
    double best = 0;
    for (double rate = 1000;; rate *= 2) {
      const Run run = publisher.run(rate, seconds);
      if (run.lost == 0) best = std::max(best, run.rate);
      if (run.lost > 0 || run.rate < 0.95 * rate) break;
    }
    const Run run = publisher.run(0, seconds);
    if (run.lost == 0) best = std::max(best, run.rate);
    highest.add(best);
    unthrottled.add(run.rate);
    lost.add(100 * run.lost / run.published);
    for (Series* series : {&highest, &unthrottled, &lost}) series->end_repetition();
  }
  for (const Series* series : {&highest, &unthrottled, &lost}) series->print();
}

void publish(const bench::Arguments& arguments) {
  StreamState& state = bench::map_stream_state(arguments.text("shared"));
  auto client = must(Client::open(arguments.options("domain")), "a client");
  (void)must(client.find(joint(kEdges - 1)), "the owner's frames");
  Publisher edges(edges_to(client), state);
  Publisher joints(joints_to(client), state);
  const int seconds = arguments.number("seconds");
  const int repetitions = arguments.number("repetitions");
  measure_1khz("stream", edges, state, seconds, repetitions);
  measure_1khz("stream/joints", joints, state, seconds, repetitions);
  measure_highest(edges, 0.25 * seconds, repetitions);
}

}  // namespace

int main(int argc, char** argv) {
  const bench::Arguments arguments(argc, argv);
  if (arguments.text("mode") == "own") own(arguments);
  publish(arguments);
  return 0;
}
