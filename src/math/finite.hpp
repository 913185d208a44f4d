#pragma once

#include <cstddef>
#include <cstring>
#include <string_view>

#include "tfdude/base/id.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// Whether the sum of all 28 numbers is finite; it is for everything that the checked constructors
/// accept. Inline and in pairs, since every update of an own edge calls it: 2 ns instead of 6 for a
/// function that checks one number after the other.
inline bool is_finite(const Transform& X) {
  static_assert(sizeof(Pose) == 7 * sizeof(double) && sizeof(Transform) == 29 * sizeof(double));
  using Pair = double __attribute__((vector_size(16)));
  // Copied, since a transform is not aligned for pairs; the compiler loads them directly.
  const auto pair = [&X](std::size_t i) {
    Pair copy;
    // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): of doubles only
    std::memcpy(&copy, reinterpret_cast<const double*>(&X) + 2 * i, sizeof(copy));
    return copy;
  };
  Pair sums[4] = {pair(0), pair(1), pair(2), pair(3)};
  for (std::size_t i = 4; i < 14; ++i) sums[i % 4] += pair(i);
  const Pair sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  const double total = sum[0] + sum[1];
  return total - total == 0.0;
}

/// As check_finite(), for the value of a frame's edge. The error names the frame's id.
inline Result<void> check_value(std::string_view id, const Transform& X_PC) {
  if (auto finite = check_finite(X_PC); !finite) {
    return fail_at("frame " + quote(id), finite.error());
  }
  return {};
}

}  // namespace tfdude
