// Operations of a process on its own frames, compared with tf2's BufferCore on the same tree: set
// an edge, look up, add and remove. tf2 has no covariance; tf-dude propagates it unless the name
// contains "pose".
//
// Keys: core/OPERATION/WHO/DEPTH/FRAMES. Where tf2 has no counterpart, WHO says how the errors of
// the edges are correlated: independent; all edges share a source; or unknown. The operations are
//   lookup_correlated   with covariance to second order
//   lookup_fourth       to fourth order
//   lookup_read         frames of so many owners, in their memory. The owners are in this process,
//                       but their memory is mapped and read as that of others is.

#include <algorithm>
#include <cstdlib>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>

#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "core/trees.hpp"
#include "transport/port.hpp"

namespace {

using namespace tfdude;

using Shape = std::pair<std::size_t, std::size_t>;  // depth, frames
constexpr Shape kShapes[] = {{2, 10},     {8, 100},    {30, 100},    {30, 1000},
                             {30, 10000}, {100, 1000}, {1000, 10000}};

/// One tree of each kind per shape, created when first needed.
const bench::Tree& tree_of(const Shape& shape) {
  static std::map<Shape, bench::Tree> trees;
  auto [entry, fresh] = trees.try_emplace(shape);
  if (fresh) entry->second = bench::up_down_tree(shape.first, shape.second);
  return entry->second;
}

Node& node_of(const Shape& shape) {
  static std::map<Shape, Node> nodes;
  const auto known = nodes.find(shape);
  if (known != nodes.end()) return known->second;
  LoopbackNetwork network;
  Options options;
  auto node = Node::open(network.join(), "bench", tree_of(shape).frames, options);
  if (!node) std::abort();
  return nodes.emplace(shape, *std::move(node)).first->second;
}

tf2::BufferCore& buffer_of(const Shape& shape) {
  static std::map<Shape, tf2::BufferCore> buffers;
  auto [entry, fresh] = buffers.try_emplace(shape);
  if (fresh) bench::fill(entry->second, tree_of(shape));
  return entry->second;
}

void look_up_by_handle(benchmark::State& state, Shape shape) {
  Node& node = node_of(shape);
  const Handle a = *node.find(tree_of(shape).from);
  const Handle b = *node.find(tree_of(shape).to);
  for (auto _ : state) benchmark::DoNotOptimize(node.lookup(a, b));
}

void look_up_pose(benchmark::State& state, Shape shape) {
  Node& node = node_of(shape);
  const Handle a = *node.find(tree_of(shape).from);
  const Handle b = *node.find(tree_of(shape).to);
  for (auto _ : state) benchmark::DoNotOptimize(node.lookup_pose(a, b));
}

void look_up_by_name(benchmark::State& state, Shape shape) {
  Node& node = node_of(shape);
  const bench::Tree& tree = tree_of(shape);
  for (auto _ : state) benchmark::DoNotOptimize(node.lookup(tree.from, tree.to));
}

void look_up_tf2(benchmark::State& state, Shape shape) {
  const tf2::BufferCore& buffer = buffer_of(shape);
  const bench::Tree& tree = tree_of(shape);
  for (auto _ : state) {
    benchmark::DoNotOptimize(buffer.lookupTransform(tree.from, tree.to, ros::Time(0)));
  }
}

enum class Errors { kIndependent, kShared, kUnknown };

bench::Tree correlated(bench::Tree tree, Errors errors) {
  testing::Random random(8);
  for (FrameSpec& frame : tree.frames) {
    if (frame.parent.empty()) continue;
    frame.correlation.unknown = errors == Errors::kUnknown;
    if (errors == Errors::kShared) {
      frame.correlation.common_errors = {{"source", false, random.twist(0.01, 0.01)}};
    }
  }
  return tree;
}

void look_up_correlated(benchmark::State& state, Shape shape, Errors errors, Order order) {
  const bench::Tree tree = correlated(tree_of(shape), errors);
  LoopbackNetwork network;
  auto node = Node::open(network.join(), "bench", tree.frames, Options());
  if (!node) std::abort();
  const Handle a = *node->find(tree.from);
  const Handle b = *node->find(tree.to);
  Query query;
  query.order = order;
  for (auto _ : state) benchmark::DoNotOptimize(node->lookup(a, b, query));
}

// Each owner has as many frames as the others, next to each other on the path.
void look_up_read(benchmark::State& state, Shape shape, std::size_t owners) {
  const bench::Tree& tree = tree_of(shape);
  LoopbackNetwork network;
  std::vector<Node> nodes;
  std::vector<std::vector<FrameSpec>> shares(owners);
  for (std::size_t i = 0; i < tree.frames.size(); ++i) {
    const std::size_t on_path = std::min(i, shape.first);
    shares[on_path * owners / (shape.first + 1)].push_back(tree.frames[i]);
  }
  for (std::size_t i = 0; i < owners; ++i) {
    auto node = Node::open(network.join(), "owner " + std::to_string(i), shares[i], Options());
    if (!node) std::abort();
    nodes.push_back(*std::move(node));
  }
  auto client = Client::open(network.join(), Options());
  if (!client || !client->lookup(tree.from, tree.to)) std::abort();
  client->find_memory();
  const auto partitions = client->partitions();
  for (const PartitionInfo& partition : *partitions) {
    if (!partition.in_memory) std::abort();
  }
  const Handle a = *client->find(tree.from);
  const Handle b = *client->find(tree.to);
  for (auto _ : state) benchmark::DoNotOptimize(client->lookup(a, b));
}

void set_by_handle(benchmark::State& state, Shape shape) {
  Node& node = node_of(shape);
  const Handle edge = *node.find(tree_of(shape).from);
  const Transform X = tree_of(shape).frames[1].X_PC;
  for (auto _ : state) benchmark::DoNotOptimize(node.update(edge, X));
}

void set_by_name(benchmark::State& state, Shape shape) {
  Node& node = node_of(shape);
  const std::string& edge = tree_of(shape).from;
  const Transform X = tree_of(shape).frames[1].X_PC;
  for (auto _ : state) benchmark::DoNotOptimize(node.update(edge, X));
}

void set_tf2(benchmark::State& state, Shape shape) {
  // A tree of its own, because the growing stamps create a history.
  tf2::BufferCore buffer;
  bench::fill(buffer, tree_of(shape));
  auto message = bench::stamped(tree_of(shape).frames[1], ros::Time(2));
  for (auto _ : state) {
    message.header.stamp += ros::Duration(0, 1000000);
    benchmark::DoNotOptimize(buffer.setTransform(message, "bench", false));
  }
}

void add_and_remove(benchmark::State& state, Shape shape) {
  Node& node = node_of(shape);
  const std::string& parent = tree_of(shape).frames[shape.second / 2].id;
  const Transform X = tree_of(shape).frames[1].X_PC;
  const std::string leaf = "leaf";
  for (auto _ : state) {
    benchmark::DoNotOptimize(node.add(leaf, parent, X));
    benchmark::DoNotOptimize(node.remove(leaf));
  }
}

void add_and_remove_in_forest(benchmark::State& state, Shape shape) {
  Forest forest;
  for (const FrameSpec& frame : tree_of(shape).frames) {
    if (!forest.add(frame.id, frame.parent, frame.X_PC)) std::abort();
  }
  const std::string& parent = tree_of(shape).frames[shape.second / 2].id;
  const Transform X = tree_of(shape).frames[1].X_PC;
  for (auto _ : state) {
    benchmark::DoNotOptimize(forest.add("leaf", parent, X));
    benchmark::DoNotOptimize(forest.remove("leaf"));
  }
}

template <class Function, class... More>
void enter(const char* name, const Shape& shape, Function function, More... more) {
  const std::string key = std::string("core/") + name + "/" + std::to_string(shape.first) + "/" +
                          std::to_string(shape.second);
  benchmark::RegisterBenchmark(key.c_str(), function, shape, more...);
}

}  // namespace

int main(int argc, char** argv) {
  for (const Shape& shape : kShapes) {
    enter("lookup/ours_by_handle", shape, look_up_by_handle);
    enter("lookup/ours_pose", shape, look_up_pose);
    enter("lookup/ours_by_name", shape, look_up_by_name);
    enter("lookup/tf2", shape, look_up_tf2);
  }
  const auto enter_correlated = [](const char* name, Errors errors, Order order) {
    enter(name, Shape{30, 100}, look_up_correlated, errors, order);
  };
  enter_correlated("lookup_correlated/shared", Errors::kShared, Order::kSecond);
  enter_correlated("lookup_correlated/unknown", Errors::kUnknown, Order::kSecond);
  enter_correlated("lookup_fourth/independent", Errors::kIndependent, Order::kFourth);
  enter_correlated("lookup_fourth/shared", Errors::kShared, Order::kFourth);
  enter("lookup_read/1_owner", Shape{30, 100}, look_up_read, 1U);
  enter("lookup_read/16_owners", Shape{30, 100}, look_up_read, 16U);
  for (const Shape& shape : {Shape{2, 10}, {30, 100}, {30, 1000}, {1000, 10000}}) {
    enter("set/ours_by_handle", shape, set_by_handle);
    enter("set/ours_by_name", shape, set_by_name);
    enter("set/tf2", shape, set_tf2);
  }
  for (const Shape& shape : {Shape{2, 10}, {30, 1000}, {1000, 10000}, {1000, 100000}}) {
    enter("add_remove/ours", shape, add_and_remove);
    enter("add_remove/ours_forest", shape, add_and_remove_in_forest);
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
