#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include "support/rtps_bytes.hpp"

namespace tfdude::testing {

/// A program on this computer that is no participant, and sends any datagrams to those of a domain.
class Stranger {
 public:
  explicit Stranger(std::uint32_t domain);
  ~Stranger();
  Stranger(const Stranger&) = delete;
  Stranger& operator=(const Stranger&) = delete;

  /// The prefixes of all participants that have announced themselves, once there are so many.
  /// @throws std::runtime_error if there are fewer in time.
  [[nodiscard]] std::vector<Prefix> await_participants(std::size_t count);

  /// To all ports at which participants of the domain may receive.
  void send(const Datagram& datagram);

 private:
  std::uint32_t domain_;
  int listening_ = -1;
  int sending_ = -1;
};

/// Tells each participant in the name of each other one that built-in writers leave out, or have
/// lost, practically all sequence numbers, that readers have received them, and that readers begin
/// anew.
void send_huge_ranges(Stranger& stranger, const std::vector<Prefix>& participants);

}  // namespace tfdude::testing
