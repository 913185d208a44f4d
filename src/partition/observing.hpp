#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/math/observation.hpp"

#include "partition/routing.hpp"

// An observation of a path whose edges several partitions own: its edges are asked for, one by one; what the measurement
// makes of them is computed by whoever has it (tfdude/math/observation.hpp); each owner then applies its part.
namespace tfdude {

/// The edges that an observation concerns, and who must be asked for them.
struct ObservePlan {
  struct Edge {
    FrameInfo info;
    ObservedEdge::Way way;
  };
  std::vector<Edge> edges;  ///< those of the path in its order, then those beside it
  std::vector<Part> parts;  ///< a LookupRequest for each owner, of its edges in that order
};

/// The same with the values of all, of one instant.
struct ObservedPath {
  std::vector<ObservedEdge> edges;
  struct Seen {
    std::uint64_t commit = 0;
    std::uint64_t incarnation = 0;
  };
  std::vector<Seen> seen;  ///< by part
  std::optional<Time> stamp;
  std::vector<std::string> missing;  ///< edges beside the path that must be asked for, too
  /// An edge lacks the source that it was observed by together with another: somebody's observation may be under way.
  bool torn = false;
};

/// @param beside  edges that were observed together with some of the path; those that are not there are left out
/// @return kUnknownStart, kUnknownEnd, kNotConnected, kUnreachable, kInvalidInput (the path has no edge, or too many).
[[nodiscard]] Result<ObservePlan> route_observe(const Forest& forest, const Directory& directory,
                                                const std::string& a, const std::string& b,
                                                const std::vector<std::string>& beside,
                                                std::optional<Time> stamp);

/// @param answers  by part, of one instant (one_instant())
/// @return kNotOwner where an answer is not what was asked for.
[[nodiscard]] Result<ObservedPath> observed_path(const ObservePlan& plan,
                                                 const std::vector<SegmentValues>& answers);

/// What each owner is to do about an observation: a ReviseRequest for each who owns an uncertain edge.
[[nodiscard]] std::vector<Part> revisions(const ObservePlan& plan, const ObservedPath& path,
                                          const Observation& observation);

}  // namespace tfdude
