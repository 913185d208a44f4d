#pragma once

#include <string>

#include "tfdude/types/query.hpp"

#include "runtime/context.hpp"
#include "runtime/lookups.hpp"
#include "runtime/requests.hpp"

namespace tfdude {

/// Lookups of two frames, each at an instant of its own, over a third one that counts as fixed.
/// @par Thread safety  All functions are thread-safe.
class TwoInstants {
 public:
  TwoInstants(const Context& context, Lookups& lookups)
      : structure_(context.structure), requests_(context.requests), lookups_(lookups) {}

  /// X_AB = X_FA(t_a)⁻¹ X_FB(t_b). A static edge on both paths has the same error twice. That of a
  /// dynamic one at two instants may be correlated in any way: the covariance is an upper bound.
  /// @return as Lookups::lookup(), of either
  [[nodiscard]] Result<StampedTransform> lookup(const std::string& a, const Query& at_a,
                                                const std::string& b, const Query& at_b,
                                                const std::string& fixed, const Deadline& deadline);

 private:
  Structure& structure_;
  Requests& requests_;
  Lookups& lookups_;
};

}  // namespace tfdude
