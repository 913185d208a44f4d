#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <boost/graph/adjacency_list.hpp>

namespace tfdude {

/// The hierarchy of frames, by slot: the writer's side of the structure. The only place that
/// includes Boost.Graph. Vertices are never erased (slots are reused), so that descriptors stay
/// valid. Out-edges are vectors, which take 60 bytes per frame less than sets. The youngest of many
/// siblings is unlinked in O(1), the oldest in O(siblings).
///
/// Subtrees and removal do not use Boost.Graph's own functions (bench/core/graph_bench.cpp has the
/// figures). breadth_first_visit() takes 4 to 20 times as long, since a tree needs no colours.
/// remove_edge() takes twice as long with 100 siblings and 100 times with 10,000, since it searches
/// from the front.
class Graph {
 public:
  using Slot = std::uint32_t;

  void ensure(Slot slot) {
    while (boost::num_vertices(graph_) <= slot) boost::add_vertex(graph_);
  }
  void link(Slot parent, Slot child) { boost::add_edge(parent, child, graph_); }
  void unlink(Slot parent, Slot child) {
    // Not boost::remove_edge, which searches from the front and keeps the order.
    auto& edges = graph_.out_edge_list(parent);
    const auto last = std::find_if(edges.rbegin(), edges.rend(), [child](const auto& edge) {
      return edge.get_target() == child;
    });
    if (last == edges.rend()) return;
    std::swap(*last, edges.back());
    edges.pop_back();
    if (edges.empty()) edges.shrink_to_fit();
  }
  [[nodiscard]] bool is_leaf(Slot slot) const { return boost::out_degree(slot, graph_) == 0; }

  /// Calls visit(child) for each child.
  template <class Visit>
  void for_each_child(Slot slot, Visit visit) const {
    auto [child, end] = boost::adjacent_vertices(slot, graph_);
    for (; child != end; ++child) visit(static_cast<Slot>(*child));
  }

  /// The slot and all slots below it that enter(child) admits, parents before children.
  template <class Enter>
  [[nodiscard]] std::vector<Slot> subtree(Slot top, Enter enter) const {
    std::vector<Slot> order{top};
    for (std::size_t i = 0; i < order.size(); ++i) {
      for_each_child(order[i], [&](Slot child) {
        if (enter(child)) order.push_back(child);
      });
    }
    return order;
  }

 private:
  boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS> graph_;
};

}  // namespace tfdude
