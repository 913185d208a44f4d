#pragma once

#include <map>
#include <string>
#include <vector>

#include "tfdude/types/edge.hpp"

#include "partition/messages.hpp"

namespace tfdude {

/// How well the covariances of a partition's edges agree with their observations. Not thread-safe.
class Consistency {
 public:
  /// An observation was applied, or rejected by its gate. One without an expectation says nothing.
  void note(const ReviseRequest::Edge& edge) {
    if (!(edge.innovation.expected > 0)) return;
    EdgeConsistency& so_far = edges_[edge.id];
    so_far.id = edge.id;
    ++so_far.observations;
    so_far.refused += edge.refused ? 1 : 0;
    so_far.sum.squares += edge.innovation.squares;
    so_far.sum.expected += edge.innovation.expected;
    so_far.sum.variance += edge.innovation.variance;
  }
  /// The edge is another one from now on.
  void forget(const std::string& id) { edges_.erase(id); }
  /// That of one edge, or of all of them, sorted by id: at most kMaxItems.
  [[nodiscard]] std::vector<EdgeConsistency> list(const std::string& id, bool all) const {
    std::vector<EdgeConsistency> found;
    for (const auto& [edge, one] : edges_) {
      if ((all || edge == id) && found.size() < kMaxItems) found.push_back(one);
    }
    return found;
  }

 private:
  std::map<std::string, EdgeConsistency> edges_;  // of observed edges
};

}  // namespace tfdude
