#pragma once

#include <cstdint>

namespace tfdude {

/// How often a Node has rejected something since it started: by its limits (Options::limits), and
/// because one sender took more than its share of an overloaded process.
struct RefusedCounts {
  std::uint64_t frames = 0;
  std::uint64_t watches = 0;
  /// Samples that were dropped from histories for newer ones, to keep to the limit of memory.
  std::uint64_t dropped_samples = 0;
  std::uint64_t messages = 0;  ///< requests and stream messages, dropped unread
};

}  // namespace tfdude
