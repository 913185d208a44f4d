#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/base/time.hpp"
#include "tfdude/math/observation.hpp"

namespace tfdude {

/// What suffices for any relation of the errors of a source on the edges of a path, if these are of
/// different samples (instant_sources.hpp).
class PathRelations {
 public:
  PathRelations() = default;
  /// Of those on the path, without edges beside it.
  explicit PathRelations(const std::vector<ObservedEdge>& edges);

  /// Leaves out sources of which no error is between samples, and errors that are of no single
  /// instant: an observation merges these, so that what they were cannot be told afterwards.
  void keep_instants();
  /// Makes errors that large. What is independent of the path then has no part in it.
  void widen(std::vector<CommonError>& common_errors) const;
  /// Undoes that for what became of them.
  void narrow(std::vector<CommonError>& common_errors) const;

 private:
  [[nodiscard]] double factor(const std::string& name) const;

  std::vector<std::pair<std::string, double>> factors_;  // of loadings, by name
};

/// Names the errors of sources as a lookup over these edges at one instant does, and makes them as
/// large. Complexity: quadratic in the errors.
/// @param lasting  of each edge, whether it is static, or drifts
/// @param at  of the dynamic edges; may be absent
void relate_sources(std::vector<ObservedEdge>& edges, const std::vector<bool>& lasting,
                    std::optional<Time> at);

}  // namespace tfdude
