#pragma once

#include <cstdint>

namespace tfdude::testing {

/// A DDS domain from 20 to 219 that no other test on this computer uses now.
class DomainLease {
 public:
  /// @throws std::runtime_error if all are taken.
  DomainLease();
  ~DomainLease();
  DomainLease(const DomainLease&) = delete;
  DomainLease& operator=(const DomainLease&) = delete;

  [[nodiscard]] std::uint32_t number() const { return number_; }

 private:
  std::uint32_t number_ = 0;
  int claim_ = -1;
};

}  // namespace tfdude::testing
