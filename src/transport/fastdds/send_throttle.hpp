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
class SendThrottle {
 public:
  using Clock = std::chrono::steady_clock;

  /// Who was not heard for this long...
  static constexpr std::chrono::milliseconds kSilence{500};
  /// ...is sent no more than one datagram in this time at each port, by which they meet again. Who only listens is
  /// silent, too: beats come less often, and each listener has a port for them.
  static constexpr std::chrono::milliseconds kTryEvery{50};

  /// @param host  an IPv4 address
  void heard(std::uint32_t host, Clock::time_point now);

  /// Whether a datagram may be sent; counts it if so. Of more hosts and ports than there is room for, always.
  [[nodiscard]] bool may_send(std::uint32_t host, std::uint32_t port, Clock::time_point now);

 private:
  struct Entry {
    std::atomic<std::uint64_t> key{0};  // 0: none yet
    std::atomic<std::int64_t> time{0};  // of the clock
  };

  /// The time that is kept for a key, which is made with a first one. Null where there is no room.
  std::atomic<std::int64_t>* find(std::uint64_t key, std::int64_t first);

  std::array<Entry, 1024>
      entries_;  // when hosts were heard, and when silent ones were tried at a port
};

}  // namespace tfdude::fastdds
