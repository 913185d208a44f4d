#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <boost/graph/adjacency_list.hpp>

namespace tfdude {

/// Who hangs below whom, by slot: the writer's side of the structure. The only place that includes
/// Boost.Graph. Vertices are never erased (a slot is reused), so that descriptors stay what they are;
/// out-edges are vectors, which take 60 bytes a frame less than sets; the youngest of many siblings is unlinked in
/// O(1), the oldest in O(siblings).
///
/// Subtrees and removal are not Boost.Graph's own (bench/core/graph_bench.cpp has the figures): breadth_first_visit()
/// takes 4 to 20 times as long, since a tree needs no colours, and remove_edge() twice with 100 siblings and 100 times with
/// 10,000, since it looks from the front.
class Graph {
 public:
  using Slot = std::uint32_t;

  void ensure(Slot slot) {
    while (boost::num_vertices(graph_) <= slot) boost::add_vertex(graph_);
  }
  void link(Slot parent, Slot child) { boost::add_edge(parent, child, graph_); }
  void unlink(Slot parent, Slot child) {
    // Not boost::remove_edge, which looks from the front and keeps the order.
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

  /// The slot and all below it where enter(child) allows it, parents before children.
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
