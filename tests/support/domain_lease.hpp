#pragma once

#include <cstdint>

namespace tfdude::testing {

/// Domains to choose from.
struct Domains {
  std::uint32_t first = 20;
  std::uint32_t count = 200;
};

/// A DDS domain that no other test on this computer uses now, and nobody else, as far as its ports
/// show: with a participant of others in it, tests would find other frames than their own.
class DomainLease {
 public:
  /// @throws std::runtime_error if all are taken, naming who has them.
  explicit DomainLease(const Domains& domains = {});
  /// Prints a warning if somebody else has entered it meanwhile.
  ~DomainLease();
  DomainLease(const DomainLease&) = delete;
  DomainLease& operator=(const DomainLease&) = delete;

  [[nodiscard]] std::uint32_t number() const { return number_; }

 private:
  std::uint32_t number_ = 0;
  int claim_ = -1;
};

/// The port at which participants of a domain receive announcements, as all but tf-dude's clients.
[[nodiscard]] std::uint16_t announcement_port(std::uint32_t domain);

}  // namespace tfdude::testing
