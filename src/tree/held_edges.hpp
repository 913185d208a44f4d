#pragma once

#include <vector>

#include "tree/frames.hpp"

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

}  // namespace tfdude
