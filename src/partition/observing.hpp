#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tfdude/math/observation.hpp"

#include "partition/routing.hpp"

// An observation of a path whose edges several partitions own. The observer requests the edges one
// by one, computes their corrections (tfdude/math/observation.hpp), and each owner then applies its
// part.
namespace tfdude {

/// The edges affected by an observation, and the requests to their owners.
struct ObservePlan {
  struct Edge {
    FrameInfo info;
    ObservedEdge::Way way{};
  };
  std::vector<Edge> edges;  ///< those of the path in order, then those beside it
  std::vector<Part> parts;  ///< a LookupRequest per owner, with its edges in that order
};

/// The plan with the values of all edges, at one instant.
struct ObservedPath {
  std::vector<ObservedEdge> edges;
  struct Seen {
    std::uint64_t commit = 0;
    std::uint64_t incarnation = 0;
  };
  std::vector<Seen> seen;  ///< by part
  std::optional<Time> stamp;
  std::vector<std::string> missing;  ///< edges beside the path that must be requested, too
  /// An edge lacks the source of its joint observation with another one: another observation may be
  /// in progress.
  bool torn = false;
};

/// @param beside  edges observed together with some of the path; missing ones are left out
/// @return kUnknownStart, kUnknownEnd, kNotConnected, kUnreachable, kInvalidInput (the path has no
///   edge, or too many).
[[nodiscard]] Result<ObservePlan> route_observe(const Forest& forest, const Directory& directory,
                                                const std::string& a, const std::string& b,
                                                const std::vector<std::string>& beside,
                                                std::optional<Time> stamp);

/// @param answers  by part, at one instant (one_instant())
/// @return kNotOwner if an answer does not match the request.
[[nodiscard]] Result<ObservedPath> observed_path(const ObservePlan& plan,
                                                 const std::vector<SegmentValues>& answers);

/// The parts of the owners: a ReviseRequest for each owner of an uncertain edge.
[[nodiscard]] std::vector<Part> revisions(const ObservePlan& plan, const ObservedPath& path,
                                          const Observation& observation);

}  // namespace tfdude
