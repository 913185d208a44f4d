#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "transport/fastdds/compat.hpp"

// What this participant need not send.
namespace tfdude::fastdds {

/// The size of a datagram without the statistics that Fast DDS 2 adds to each one, if it was built
/// with them (Debian's is): 60 bytes that only its statistics of the network read.
[[nodiscard]] std::uint32_t size_without_statistics(const std::uint8_t* datagram,
                                                    std::uint32_t size);

/// Whether a datagram announces its sender as a participant, and does not say that it leaves.
[[nodiscard]] bool is_announcement(const std::uint8_t* datagram, std::size_t size);

/// Decides which of its own announcements a participant sends. Not thread-safe.
///
/// - Fast DDS sends each one to the multicast address, and once more to the same address if several
///   discovered participants listen there.
/// - It repeats them to everybody whenever it discovers a participant. A client's first ones also
///   follow each other within 2 ms. Since they are rarely lost, the intervals at which a client
///   sends them to one destination are doubled each time.
class AnnouncementPace {
 public:
  using Clock = std::chrono::steady_clock;

  /// An announcement that is sent again so soon is the same one.
  static constexpr std::chrono::microseconds kTwice{100};
  static constexpr std::chrono::milliseconds kFirst{5};
  /// Shorter than the interval of announcements at which all are sent.
  static constexpr std::chrono::milliseconds kLongest{100};

  explicit AnnouncementPace(bool client) : client_(client) {}

  /// Whether to send one; if so, it counts as sent.
  /// @param through  the socket: a multicast goes through that of each interface
  [[nodiscard]] bool may_send(const ertps::SenderResource* through, const ertps::Locator_t& to,
                              Clock::time_point now);

 private:
  struct Sent {
    Clock::time_point last;
    Clock::duration pause;  // until the next one
  };

  const bool client_;
  std::map<std::pair<const ertps::SenderResource*, ertps::Locator_t>, Sent> sent_;
};

}  // namespace tfdude::fastdds
