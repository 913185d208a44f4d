#pragma once

#include <string>
#include <vector>

#include "tfdude/math/transform.hpp"
#include "tfdude/types/query.hpp"

namespace tfdude {

/// The pose of b in a, each at an instant of its own, from their poses in a fixed frame. The stamp
/// is that of b; the unspecified edges are in the order of the path from a to b.
[[nodiscard]] inline StampedTransform over_fixed(const StampedTransform& X_FA,
                                                 const StampedTransform& X_FB) {
  StampedTransform X_AB{between(X_FA, X_FB), X_FB.stamp};
  std::vector<std::string>& unspecified = X_AB.basis.unspecified;
  unspecified.assign(X_FA.basis.unspecified.rbegin(), X_FA.basis.unspecified.rend());
  unspecified.insert(unspecified.end(), X_FB.basis.unspecified.begin(),
                     X_FB.basis.unspecified.end());
  return X_AB;
}

}  // namespace tfdude
