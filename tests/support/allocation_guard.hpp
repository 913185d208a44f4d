#pragma once

#include <cstddef>
#include <cstdint>

namespace tfdude::testing {

/// Counts allocations of the calling thread from its construction on. Works only in binaries that
/// link allocation_guard.cpp, which replaces the global operator new and delete, also those of
/// shared libraries.
class AllocationGuard {
 public:
  AllocationGuard();

  /// Allocations since the guard was made.
  [[nodiscard]] std::uint64_t allocations() const;

  /// Bytes allocated less bytes freed since the guard was made.
  [[nodiscard]] std::int64_t live_bytes() const;

 private:
  std::uint64_t allocations_at_start_;
  std::int64_t live_bytes_at_start_;
};

}  // namespace tfdude::testing
