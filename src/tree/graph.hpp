#pragma once

#include <cstdint>
#include <vector>

#include <boost/graph/adjacency_list.hpp>

namespace tfdude {

/// Who hangs below whom, by slot: the writer's side of the structure. The only place that includes
/// Boost.Graph. Vertices are never erased (a slot is reused), so that descriptors stay what they are;
/// out-edges are sets, so that a leaf among many siblings is unlinked in O(log siblings).
class Graph {
 public:
  using Slot = std::uint32_t;

  void ensure(Slot slot) {
    while (boost::num_vertices(graph_) <= slot) boost::add_vertex(graph_);
  }
  void link(Slot parent, Slot child) { boost::add_edge(parent, child, graph_); }
  void unlink(Slot parent, Slot child) { boost::remove_edge(parent, child, graph_); }
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
  boost::adjacency_list<boost::setS, boost::vecS, boost::directedS> graph_;
};

}  // namespace tfdude
