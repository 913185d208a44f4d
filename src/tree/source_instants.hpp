#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tfdude/math/belief.hpp"
#include "tfdude/types/correlation.hpp"

#include "tree/versions.hpp"

namespace tfdude {

/// The stamps of the samples that an edge's value at an instant comes from: of one, or of two.
struct FromSamples {
  std::int64_t first;
  std::int64_t last;

  [[nodiscard]] bool is_one() const { return first == last; }
  friend bool operator==(const FromSamples& a, const FromSamples& b) {
    return a.first == b.first && a.last == b.last;
  }
};

/// Of a static edge, or one that drifts: it has one error of a source, for all time.
inline constexpr FromSamples kLasting{kAlways, kAlways};

/// Tells which sources a walk meets on edges whose values come from samples of different instants.
/// The errors of such a source there are not one, unless an edge on the way makes it last. A second
/// walk names them (math/instant_sources.hpp). Complexity: linear in the sources, for each edge
/// that names some.
class SourceInstants {
 public:
  /// Those of an edge. @return with the names that they have in this walk, until the next call
  [[nodiscard]] const std::vector<CommonError>& met(const std::vector<CommonError>& common_errors,
                                                    FromSamples from);

  /// @param part  the path is a part of one that others go on with: they may meet the source on
  ///   edges with a sample of the instant, so all that comes from two samples has a name
  /// @return whether another walk has to name any
  [[nodiscard]] bool begin_naming(bool part);

 private:
  struct Source {
    std::string name;
    FromSamples first;
    bool lasts = false;
    bool differs = false;   // from the first
    bool between = false;   // comes from two samples
    bool is_named = false;  // in this walk
  };

  [[nodiscard]] Source* find(const std::string& name);
  void note(const std::string& name, FromSamples from);

  std::vector<Source> sources_;
  std::vector<CommonError> named_;
  bool naming_ = false;
};

/// If a segment has more common errors than a message may have: what its edges have of each two
/// samples becomes part of what is of unknown correlation. As a source has a name for each two
/// stamps, there may be many.
void fold_samples(PathCorrelation& correlation);

}  // namespace tfdude
