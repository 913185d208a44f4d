#pragma once

#include <vector>

#include "tree/frames.hpp"
#include "tree/held_edge.hpp"
#include "tree/remote_edges.hpp"

namespace tfdude {

/// Calls visit(edge) for each edge of these segments that is held here. The caller holds an
/// epoch::Guard.
template <class Visit>
void for_each_held(const std::vector<Ends>& segments, Visit visit) {
  for (const Ends& ends : segments) {
    const Version* a = ends.a;
    const Version* b = ends.b;
    while (a != b) {
      const Version*& here = a->depth >= b->depth ? a : b;
      if (here->above == nullptr) break;
      if (here->held()) visit(static_cast<const HeldVersion&>(*here));
      here = Frames::at(*here->above, ends.commit);
    }
  }
}

/// Calls visit(version here) for each edge of a path that others hold.
template <class Visit>
void for_each_edge_elsewhere(const Ends& ends, Visit visit) {
  const Version* a = ends.a;
  const Version* b = ends.b;
  while (a != b) {
    const Version*& here = a->depth >= b->depth ? a : b;
    if (here->above == nullptr) break;
    if (!here->held()) visit(*here);
    here = Frames::at(*here->above, ends.commit);
  }
}

/// Calls visit(version here, edge) for each edge of a path, the edge in the memory of its owner if
/// others hold it: an OwnEdge, or a RemoteEdge, without a version if it cannot be read.
template <class Visit>
void for_each_edge(const Ends& ends, RemoteReading& others, Visit visit) {
  const Version* a = ends.a;
  const Version* b = ends.b;
  while (a != b) {
    const Version*& here = a->depth >= b->depth ? a : b;
    if (here->above == nullptr) break;
    if (here->held()) {
      visit(*here, OwnEdge{static_cast<const HeldVersion*>(here)});
    } else {
      visit(*here, others.find(*here));
    }
    here = Frames::at(*here->above, ends.commit);
  }
}

}  // namespace tfdude
