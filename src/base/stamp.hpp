#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

namespace tfdude {

/// Whether a sample can have this stamp, if any.
[[nodiscard]] inline bool is_stamp(const std::optional<Time>& stamp) {
  return !stamp || nanoseconds(*stamp) >= 0;
}

/// @return kInvalidInput naming it
[[nodiscard]] inline Result<void> check_stamp(const std::optional<Time>& stamp) {
  if (is_stamp(stamp)) return {};
  return fail(Errc::kInvalidInput, "the stamp must not be negative, as " +
                                       std::to_string(nanoseconds(*stamp)) + " ns is");
}

}  // namespace tfdude
