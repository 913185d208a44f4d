#pragma once

#include <cstdint>

namespace tfdude {

/// How often a Node has rejected something since it started: by its limits (NodeOptions::limits),
/// because one sender took more than its share of an overloaded process, or because it was
/// malformed.
struct RefusedCounts {
  std::uint64_t frames = 0;
  std::uint64_t watches = 0;
  /// Samples that were dropped from histories for newer ones, to keep to the limit of memory.
  std::uint64_t dropped_samples = 0;
  /// Pages and presences of others that were not kept (PartitionLimits::others).
  std::uint64_t structure = 0;
  /// Datagrams of senders that took more than their share, dropped unread.
  std::uint64_t messages = 0;
  /// Datagrams that no participant sends, or only one with keys; see docs/security.md.
  std::uint64_t datagrams = 0;
};

}  // namespace tfdude
