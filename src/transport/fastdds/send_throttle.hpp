#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>

namespace tfdude::fastdds {

/// Records which hosts are heard, so that little is sent to the others. If a neighbour does not
/// answer to ARP, the kernel keeps the data for it three seconds and more, and counts it against
/// the one socket through which Fast DDS sends. If that were full, nothing could be sent to any
/// host.
/// @par Thread safety  All functions are thread-safe, without a lock, as every datagram passes
///   here.
class SendThrottle {
 public:
  using Clock = std::chrono::steady_clock;

  /// A host that was not heard for this long is silent.
  static constexpr std::chrono::milliseconds kSilence{500};
  /// A silent host is sent at most one datagram in this time at each port, by which they meet
  /// again. A host that only listens is silent, too. It loses no beats: these come less often, and
  /// each listener has a port for them.
  static constexpr std::chrono::milliseconds kTryEvery{50};

  /// @param host  an IPv4 address
  void heard(std::uint32_t host, Clock::time_point now);

  /// Whether a datagram may be sent; if so, counts it. Always true for hosts and ports for which
  /// there is no room.
  [[nodiscard]] bool may_send(std::uint32_t host, std::uint32_t port, Clock::time_point now);

 private:
  struct Entry {
    std::atomic<std::uint64_t> key{0};  // 0: none yet
    std::atomic<std::int64_t> time{0};  // of the clock
  };

  /// The time stored for a key; a new key gets the first one. Null if there is no room.
  std::atomic<std::int64_t>* find(std::uint64_t key, std::int64_t first);

  std::array<Entry, 1024>
      entries_;  // when hosts were heard, and when silent ones were tried at a port
};

}  // namespace tfdude::fastdds
