#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace tfdude::fastdds {

/// Which hosts are heard, so that little is sent to the others. The kernel keeps what is sent to a neighbour that does
/// not answer to ARP, three seconds and more, and counts it against the one socket through which Fast DDS
/// sends: were that full, nothing would go to anybody.
/// @par Thread safety  All functions; without a lock, as every datagram passes here.
class Reach {
 public:
  using Clock = std::chrono::steady_clock;

  /// Who was not heard for this long...
  static constexpr std::chrono::milliseconds kSilence{500};
  /// ...is sent no more than one datagram in this time, by which they meet again.
  static constexpr std::chrono::milliseconds kTryEvery{50};

  /// @param host  an IPv4 address
  void heard(std::uint32_t host, Clock::time_point now);

  /// Whether a datagram may be sent; counts it if so. Of more hosts than there is room for, always.
  [[nodiscard]] bool may_send(std::uint32_t host, Clock::time_point now);

 private:
  struct Host {
    std::atomic<std::uint32_t> address{0};  // 0: none yet
    std::atomic<std::int64_t> heard{0};     // of the clock
    std::atomic<std::int64_t> tried{0};
  };

  /// Null where there is no room.
  Host* find(std::uint32_t address, std::int64_t now);

  std::array<Host, 256> hosts_;
};

}  // namespace tfdude::fastdds
