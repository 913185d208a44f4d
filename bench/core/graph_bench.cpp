// Operations of Graph alone, compared with those of Boost.Graph.
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <benchmark/benchmark.h>
#include <boost/graph/breadth_first_search.hpp>
#include <boost/property_map/property_map.hpp>

#include "tree/graph.hpp"

namespace {

using Slot = tfdude::Graph::Slot;
using BoostGraph = boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS>;

constexpr Slot kFrames = 10'000;
constexpr Slot kFanOut = 8;

template <class Link>
void build_tree(Link link) {
  for (Slot child = 1; child < kFrames; ++child) link((child - 1) / kFanOut, child);
}

struct Collect : boost::default_bfs_visitor {
  explicit Collect(std::vector<Slot>& all) : found(&all) {}
  void discover_vertex(std::size_t vertex, const BoostGraph&) const {
    found->push_back(static_cast<Slot>(vertex));
  }
  std::vector<Slot>* found;
};

// Stores colours of visited vertices only: initializing the colours of all vertices would make one
// frame as expensive as all.
std::vector<Slot> subtree_by_boost(const BoostGraph& graph, Slot top) {
  std::vector<Slot> found;
  std::unordered_map<std::size_t, boost::default_color_type> colours;
  boost::queue<std::size_t> queue;
  boost::breadth_first_visit(graph, top, queue, Collect(found),
                             boost::make_assoc_property_map(colours));
  return found;
}

void subtree(benchmark::State& state) {
  tfdude::Graph graph;
  graph.ensure(kFrames - 1);
  build_tree([&](Slot parent, Slot child) { graph.link(parent, child); });
  const auto find = [&] {
    return graph.subtree(static_cast<Slot>(state.range(0)), [](Slot) { return true; });
  };
  for (auto _ : state) benchmark::DoNotOptimize(find());
  state.counters["frames"] = static_cast<double>(find().size());
}

void subtree_boost(benchmark::State& state) {
  BoostGraph graph(kFrames);
  build_tree([&](Slot parent, Slot child) { boost::add_edge(parent, child, graph); });
  const auto find = [&] { return subtree_by_boost(graph, static_cast<Slot>(state.range(0))); };
  for (auto _ : state) benchmark::DoNotOptimize(find());
  state.counters["frames"] = static_cast<double>(find().size());
}

// Removes and adds again the youngest of so many siblings.
void unlink(benchmark::State& state) {
  const auto siblings = static_cast<Slot>(state.range(0));
  tfdude::Graph graph;
  graph.ensure(siblings);
  for (Slot child = 1; child <= siblings; ++child) graph.link(0, child);
  for (auto _ : state) {
    graph.unlink(0, siblings);
    graph.link(0, siblings);
  }
}

void unlink_boost(benchmark::State& state) {
  const auto siblings = static_cast<Slot>(state.range(0));
  BoostGraph graph(siblings + 1);
  for (Slot child = 1; child <= siblings; ++child) boost::add_edge(0, child, graph);
  for (auto _ : state) {
    boost::remove_edge(0, siblings, graph);
    boost::add_edge(0, siblings, graph);
  }
}

// A leaf, and subtrees of 9 to 4,681 frames.
BENCHMARK(subtree)->Arg(9999)->Arg(1000)->Arg(100)->Arg(10)->Arg(1);
BENCHMARK(subtree_boost)->Arg(9999)->Arg(1000)->Arg(100)->Arg(10)->Arg(1);
BENCHMARK(unlink)->Arg(10)->Arg(100)->Arg(10'000);
BENCHMARK(unlink_boost)->Arg(10)->Arg(100)->Arg(10'000);

}  // namespace

BENCHMARK_MAIN();
