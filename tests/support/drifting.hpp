#pragma once

#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "tfdude/math/observation.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "tree/forest.hpp"

namespace tfdude::testing {

inline constexpr double kStep = 0.1;  // [s]

/// Of a step.
inline Time at(int step) { return Time(std::chrono::milliseconds(100 * step)); }

inline Query when(Time stamp) {
  Query query;
  query.at = stamp;
  return query;
}
inline Query when(int step) { return when(at(step)); }

inline Pose shift(double x) { return Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0}); }

inline Covariance of_deviations(double translation, double rotation) {
  return *Covariance::from_stddev(
      {translation, translation, translation, rotation, rotation, rotation});
}

/// A forest: world -> base drifts, world -> object stands.
struct Drifting {
  explicit Drifting(const Covariance& density = of_deviations(0.02, 0.01)) : Q(density) {
    REQUIRE(forest.add("world", "", {}));
    REQUIRE(forest.add("base", "world", {}));
    REQUIRE(forest.add("object", "world", {Pose(), of_deviations(1, 1)}));
    EdgeTiming timing;
    timing.drifts = true;
    timing.process_noise = Q;
    REQUIRE(forest.set_timing("base", timing));
  }
  void drive(int step) { REQUIRE(forest.update("base", {G, Covariance()}, at(step))); }

  /// As an observer does.
  Result<void> see(const Transform& Z, int step, const std::string& source) {
    return see(Z, at(step), source);
  }
  Result<void> see(const Transform& Z, Time stamp, const std::string& source) {
    const auto seen =
        forest.lookup_segments({{"world", "base"}, {"world", "object"}}, when(stamp), {}, true);
    if (!seen) return tl::unexpected(seen.error());
    std::vector<ObservedEdge> edges;
    for (std::size_t i = 0; i < 2; ++i) {
      edges.push_back({belief_of(seen->values[i], seen->correlations[i]),
                       i == 0 ? ObservedEdge::Way::kUp : ObservedEdge::Way::kDown});
    }
    const auto found = observe(edges, Z, source, {1.0, true});
    if (!found) return tl::unexpected(found.error());
    std::vector<Revision> revisions;
    for (std::size_t i = 0; i < 2; ++i) {
      const Belief& X = found->edges[i].X_PC;
      revisions.push_back(
          {i == 0 ? "base" : "object", {X.pose, X.own}, {false, X.common_errors, {}}});
    }
    return forest.revise(revisions, stamp, seen->commit);
  }

  [[nodiscard]] double sigma(const std::string& a, const std::string& b, int step) const {
    const auto X = forest.lookup(a, b, when(step));
    REQUIRE(X);
    return std::sqrt(X->covariance.of_specified().upper()[0]);
  }

  const Covariance Q;
  Pose G;
  Forest forest;
};

}  // namespace tfdude::testing
