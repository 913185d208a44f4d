// The cost of history for a process with its own frames, compared with tf2's BufferCore on the same
// tree with the same samples: setting an edge whose history is full, lookup between two samples,
// and memory.
//
// Keys: core/OPERATION/WHO/DEPTH/FRAMES, where the operation is one of
//   set_history       a sample per millisecond: both keep ten seconds by default
//   lookup_at         18.5 samples of 1 kHz before the newest
//   lookup_at_far     200.5 samples of 1 kHz before the newest
//   lookup_at_100hz   18.5 samples of 100 Hz before the newest
//   history_bytes     bytes per sample of an edge's full history; WHO is then ours, as counted by
//                     Node::history(), or ours_heap and tf2_heap, by the growth of the heap
//
// In the trees of lookups all edges are dynamic: each turns at 1 rad/s, and has samples of 2 s, at
// the same instants.

#include <cstdlib>
#include <malloc.h>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "core/trees.hpp"
#include "transport/port.hpp"

namespace {

using namespace tfdude;
using std::chrono::nanoseconds;

constexpr std::size_t kFrames = 100;
constexpr std::size_t kDepths[] = {2, 8, 30};
constexpr nanoseconds kMillisecond{1000000};
constexpr nanoseconds kSpan = std::chrono::seconds(2);
constexpr double kTurning = 1.0;  // of each edge [rad/s]

// Samples until no history grows: more than ten seconds.
constexpr int kFull = 11000;

Time start() { return time_of(1000000000); }

ros::Time for_tf2(Time time) {
  ros::Time stamp;
  return stamp.fromNSec(static_cast<std::uint64_t>(tfdude::nanoseconds(time)));
}

Node open_node(const bench::Tree& tree) {
  LoopbackNetwork network;
  auto node = Node::open(network.join(), "bench", tree.frames);
  if (!node) std::abort();
  return *std::move(node);
}

/// A tree with dynamic edges; tf-dude and tf2 have the same samples of it.
class Moving {
 public:
  Moving(std::size_t depth, nanoseconds period)
      : tree_(bench::up_down_tree(depth, kFrames)), node_(open_node(tree_)) {
    testing::Random random(11);
    std::vector<Twist> turning;
    for (std::size_t i = 1; i < tree_.frames.size(); ++i) {
      turning.push_back(random.twist(kTurning, 0));
    }
    for (Time stamp = start(); stamp - start() < kSpan; stamp += period) sample(turning, stamp);
  }

  [[nodiscard]] const bench::Tree& tree() const { return tree_; }
  [[nodiscard]] Node& node() { return node_; }
  [[nodiscard]] const tf2::BufferCore& buffer() const { return buffer_; }
  [[nodiscard]] Time newest() const { return newest_; }

 private:
  void sample(const std::vector<Twist>& turning, Time stamp) {
    const double elapsed = std::chrono::duration<double>(stamp - start()).count();
    std::vector<EdgeUpdate> edges;
    for (std::size_t i = 1; i < tree_.frames.size(); ++i) {
      FrameSpec frame = tree_.frames[i];
      frame.X_PC.pose = frame.X_PC.pose * exp(Twist(elapsed * turning[i - 1]));
      buffer_.setTransform(bench::stamped(frame, for_tf2(stamp)), "bench", false);
      edges.push_back({frame.id, frame.X_PC});
    }
    if (!node_.update(edges, stamp)) std::abort();
    newest_ = stamp;
  }

  bench::Tree tree_;
  Node node_;
  tf2::BufferCore buffer_;
  Time newest_;
};

/// A lookup: its number of edges, and the length of their history.
struct Case {
  std::size_t depth;
  nanoseconds period;
  double samples_ago;
};

Moving& moving(const Case& of) {
  static std::map<std::pair<std::size_t, std::int64_t>, Moving> trees;
  const std::pair key{of.depth, of.period.count()};
  return trees.try_emplace(key, of.depth, of.period).first->second;
}

Time instant_of(const Case& of) {
  const double ago = of.samples_ago * static_cast<double>(of.period.count());
  return moving(of).newest() - nanoseconds(static_cast<std::int64_t>(ago));
}

/// Checks that both sides give the same result: each joint turns about a fixed axis, so the
/// geodesic and tf2's interpolation agree.
void check_agreement(const Case& of) {
  const bench::Tree& tree = moving(of).tree();
  Query query;
  query.at = instant_of(of);
  const auto ours = moving(of).node().lookup(tree.from, tree.to, query);
  const auto theirs = moving(of)
                          .buffer()
                          .lookupTransform(tree.from, tree.to, for_tf2(*query.at))
                          .transform.translation;
  constexpr double kTolerance = 1e-9;  // [m]
  const Eigen::Vector3d p(theirs.x, theirs.y, theirs.z);
  if (!ours || (ours->pose.translation() - p).norm() > kTolerance) std::abort();
}

void look_up_by_handle(benchmark::State& state, Case of) {
  Node& node = moving(of).node();
  const Handle a = *node.find(moving(of).tree().from);
  const Handle b = *node.find(moving(of).tree().to);
  Query query;
  query.at = instant_of(of);
  check_agreement(of);
  for (auto _ : state) benchmark::DoNotOptimize(node.lookup(a, b, query));
}

void look_up_tf2(benchmark::State& state, Case of) {
  const tf2::BufferCore& buffer = moving(of).buffer();
  const bench::Tree& tree = moving(of).tree();
  const ros::Time at = for_tf2(instant_of(of));
  for (auto _ : state) {
    benchmark::DoNotOptimize(buffer.lookupTransform(tree.from, tree.to, at));
  }
}

/// Gives one edge of a tree a sample per millisecond.
class Ours {
 public:
  explicit Ours(const bench::Tree& tree)
      : node_(open_node(tree)), edge_(*node_.find(tree.from)), X_(tree.frames[1].X_PC) {}

  auto set() { return node_.update(edge_, X_, now_ += kMillisecond); }
  [[nodiscard]] Node& node() { return node_; }

 private:
  Node node_;
  Handle edge_;
  Transform X_;
  Time now_ = start();
};

class Tf2 {
 public:
  explicit Tf2(const bench::Tree& tree) : message_(bench::stamped(tree.frames[1], ros::Time(1))) {
    bench::fill(buffer_, tree);
    message_.child_frame_id = tree.from;
  }

  bool set() {
    message_.header.stamp += ros::Duration(0, kMillisecond.count());
    return buffer_.setTransform(message_, "bench", false);
  }

 private:
  tf2::BufferCore buffer_;
  geometry_msgs::TransformStamped message_;
};

template <class Who>
void set_with_history(benchmark::State& state) {
  // Starts at the child of the root, as the message for tf2 does.
  Who who(bench::up_down_tree(2, kFrames));
  for (int i = 0; i < kFull; ++i) {
    if (!who.set()) std::abort();
  }
  for (auto _ : state) benchmark::DoNotOptimize(who.set());
}

void count_history(benchmark::State& state) {
  const bench::Tree tree = bench::up_down_tree(2, kFrames);
  Ours ours(tree);
  for (int i = 0; i < kFull; ++i) (void)ours.set();
  for (auto _ : state) {
    const HistoryInfo history = ours.node().history(tree.from)->front();
    state.counters["bytes"] =
        static_cast<double>(history.bytes) / static_cast<double>(history.samples);
  }
}

double heap_bytes() {
  const auto info = ::mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

/// @param samples  the number that is kept; the heap grows only by these
template <class Who>
void weigh_history(benchmark::State& state, int samples) {
  const bench::Tree tree = bench::up_down_tree(2, kFrames);
  for (auto _ : state) {
    Who who(tree);
    const double before = heap_bytes();
    for (int i = 0; i < samples; ++i) (void)who.set();
    state.counters["bytes"] = (heap_bytes() - before) / samples;
  }
}

std::string key(const std::string& name, std::size_t depth) {
  return "core/" + name + "/" + std::to_string(depth) + "/" + std::to_string(kFrames);
}

void enter_lookups(const std::string& name, nanoseconds period, double samples_ago) {
  for (const std::size_t depth : kDepths) {
    const Case of{depth, period, samples_ago};
    benchmark::RegisterBenchmark(key(name + "/ours_by_handle", depth).c_str(), look_up_by_handle,
                                 of);
    benchmark::RegisterBenchmark(key(name + "/tf2", depth).c_str(), look_up_tf2, of);
  }
}

}  // namespace

int main(int argc, char** argv) {
  enter_lookups("lookup_at", kMillisecond, 18.5);
  enter_lookups("lookup_at_far", kMillisecond, 200.5);
  enter_lookups("lookup_at_100hz", 10 * kMillisecond, 18.5);
  benchmark::RegisterBenchmark(key("set_history/ours_by_handle", 2).c_str(),
                               set_with_history<Ours>);
  benchmark::RegisterBenchmark(key("set_history/tf2", 2).c_str(), set_with_history<Tf2>);
  constexpr int kKept = 10000;
  benchmark::RegisterBenchmark(key("history_bytes/ours", 2).c_str(), count_history)->Iterations(1);
  benchmark::RegisterBenchmark(key("history_bytes/ours_heap", 2).c_str(), weigh_history<Ours>,
                               kKept)
      ->Iterations(1);
  benchmark::RegisterBenchmark(key("history_bytes/tf2_heap", 2).c_str(), weigh_history<Tf2>, kKept)
      ->Iterations(1);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
