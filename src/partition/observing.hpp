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
    std::size_t part = 0;   ///< that asks for it
    std::size_t index = 0;  ///< there
  };
  std::vector<Edge> edges;  ///< those of the path in order, then those beside it
  /// A LookupRequest per owner, with its edges of the path in that order, then those beside it.
  std::vector<Part> parts;
  std::size_t path_parts = 0;  ///< how many of them ask for edges of the path

  [[nodiscard]] std::vector<std::string> beside(std::size_t part) const;
};

/// The plan with the values of all edges: those of the path at one instant, those beside it at
/// their newest.
struct ObservedPath {
  std::vector<ObservedEdge> edges;  ///< those of the plan, then further rows of these
  /// As their owners store them, without the common errors, which the edges have.
  std::vector<PathCorrelation> correlations;
  /// An edge that drifts is corrected at several instants (RowOfSample).
  struct Row {
    std::size_t edge = 0;         ///< of the plan
    std::optional<Time> stamp{};  ///< absent: that of the edge
  };
  std::vector<Row> rows;  ///< by edge, as `edges`
  struct Seen {
    std::uint64_t commit = 0;
    std::uint64_t incarnation = 0;
    std::optional<Time> stamp;  ///< of its dynamic edges
  };
  std::vector<Seen> seen;            ///< by part
  std::optional<Time> stamp;         ///< of the path
  std::vector<std::string> missing;  ///< edges beside the path that must be requested, too
  /// Edges that lack the source of their joint observation with another one: another observation
  /// may be in progress.
  std::vector<std::string> lacking;
  std::vector<std::string> lacking_sources;  ///< of these observations, each once
};

/// @param beside  edges observed together with some of the path; those that are missing or cannot
///   be asked are left out, as are those beyond kMaxCorrelated
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

/// That of a row of the path. Absent: its edge is static, or drifts.
[[nodiscard]] std::optional<Time> instant_of(const ObservePlan& plan, const ObservedPath& path,
                                             std::size_t row);

/// If nothing is known of an edge of the path, and another one that drifts was observed later: what
/// it may have drifted until then counts as independent, many times, and the errors of all edges
/// count a little more. That is enough for any correlation, and ties the edge to the others.
/// @param edges  those of the path
void loosen(const ObservePlan& plan, std::vector<ObservedEdge>& edges);

/// Has an edge that was forgotten determined by the measurement, if it is the only one of the path
/// of unknown correlation, and is_better_anew().
void determine_forgotten(const ObservePlan& plan, const ObservedPath& path, const Transform& Z_AB,
                         std::vector<ObservedEdge>& edges);

/// The parts of the owners: a ReviseRequest for each owner of an uncertain edge.
/// @param absent  edges that are correlated with them, and keep their values
[[nodiscard]] std::vector<Part> revisions(const ObservePlan& plan, const ObservedPath& path,
                                          const Observation& observation,
                                          const std::vector<std::string>& absent);

/// Asks an owner for the present values of the edges that a part has revised.
[[nodiscard]] Part present_values(const ObservePlan& plan, const Part& revised);

/// Takes a part of an observation back, if the owner still has what it wrote: gives its edges the
/// values of before.
/// @param revised  the part
/// @param present  the owner's values (present_values())
/// @return empty if there is something newer, whose author knows of the observation
[[nodiscard]] std::optional<Part> taken_back(const ObservePlan& plan, const ObservedPath& path,
                                             const Part& revised, const SegmentValues& present);

}  // namespace tfdude
