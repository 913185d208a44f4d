#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tfdude/math/observation.hpp"

#include "math/path_relations.hpp"
#include "partition/observing.hpp"

namespace tfdude {

/// What an observation takes for errors of one instant only, of the sources that the edges of a
/// path name (math/instant_sources.hpp):
/// - those that only dynamic edges name which do not drift: of the instant of each;
/// - those of joints, also if their edges are static: of the value.
/// One that comes from two samples stays apart: to judge the measurement, any relation is allowed
/// for; the values keep what each has of it.
/// A source that a static edge names too, or one that drifts, is one error for all time, also at an
/// instant before. What was left of several instants counts as independent of it. A joint's value
/// may be the one that was observed before: any relation of both is allowed for.
class ObservedInstants {
 public:
  /// @param source  of the observation
  ObservedInstants(const ObservePlan& plan, const ObservedPath& path, std::string source);

  /// Names such errors anew.
  /// @param merge  the observation may merge what was left of other instants
  void name(std::vector<ObservedEdge>& edges, bool merge);

  /// Names them as before if no other edge has got a share of them. Otherwise the edges that have
  /// them are written, too.
  void settle(Observation& found) const;

 private:
  struct Renamed {
    std::size_t edge;
    std::string before;
    std::string now;
  };
  struct Use;

  [[nodiscard]] bool takes_part(const ObservedEdge& edge) const;
  [[nodiscard]] std::vector<Use> uses(const std::vector<ObservedEdge>& edges) const;
  void rename(std::vector<ObservedEdge>& edges, const Use& use);
  void name_between(std::vector<ObservedEdge>& edges);
  void merge_others(std::vector<ObservedEdge>& edges) const;
  [[nodiscard]] bool is_shared(const Observation& found, const std::string& name) const;

  const ObservePlan& plan_;
  const ObservedPath& path_;
  const std::string source_;
  std::vector<Renamed> renamed_;
  PathRelations relations_;
};

}  // namespace tfdude
