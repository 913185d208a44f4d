#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/mutex.hpp"
#include "transport/fastdds/rtps_check.hpp"

namespace tfdude::fastdds {

/// How far the sequence numbers of writers can be, and so how much work and memory one datagram can
/// cost: Fast DDS walks through all numbers that a HEARTBEAT skips, keeps each number of a GAP that
/// comes too early, and walks through all numbers that are acknowledged and then requested again.
///
/// - A writer advances by at most kPerSecond, beyond what it has reached before.
/// - The number with which a writer is first heard has a limit, too. There are 2^24 numbers for
///   discovery, which take 0.05 s to walk through, and 2^32 for others, which one that sends at
///   1 kHz reaches in 50 days.
/// - A GAP reaches at most kLongestRange beyond the first sample that exists.
/// - An acknowledgement is of something that was sent: at most kUnannounced numbers beyond the last
///   heartbeat.
/// - Samples of discovery that come in fragments have at most kLargestOfDiscovery bytes.
///
/// Numbers are remembered of kRoom writers; the one not heard for longest makes room.
/// @par Thread safety  All functions are thread-safe; one call costs some 50 ns.
class NumberBounds {
 public:
  using Clock = std::chrono::steady_clock;

  static constexpr std::uint64_t kPerSecond = 1'000'000;
  static constexpr std::uint64_t kFirstOfDiscovery = std::uint64_t{1} << 24U;
  static constexpr std::uint64_t kFirst = std::uint64_t{1} << 32U;
  static constexpr std::uint64_t kUnannounced = 1024;
  static constexpr std::size_t kRoom = 4096;
  static constexpr std::uint32_t kLargestOfDiscovery = 65'536;

  NumberBounds() : heard_(kRoom), sent_(kRoom) {}

  [[nodiscard]] bool admit(const NumberClaim& claim, Clock::time_point now);

  /// This participant sends the heartbeat.
  void send(const NumberClaim& heartbeat);

 private:
  // A writer's GUID.
  struct Key {
    std::uint64_t begin = 0;
    std::uint64_t end = 0;  // 0: none
    [[nodiscard]] bool operator==(const Key& other) const {
      return begin == other.begin && end == other.end;
    }
  };
  struct Entry {
    Key key;
    std::uint64_t reached = 0;
    std::uint64_t existing = 0;  // the first sample that exists; 0: not known
    Clock::time_point heard{};
    std::uint32_t count = 0;
  };
  using Table = std::vector<Entry>;

  static Key key_of(const NumberClaim& claim);
  static Key key_of_own(NumberClaim claim);  // of this participant's writer
  static Entry* places(Table& table, const Key& key);
  static Entry* find(Table& table, const Key& key);
  static Entry& make(Table& table, const Key& key);
  bool admit_acknowledged(const NumberClaim& claim) TFDUDE_REQUIRES(mutex_);
  static bool admit_kind(Entry& entry, const NumberClaim& claim);

  Mutex mutex_;
  Table heard_ TFDUDE_GUARDED_BY(mutex_);
  Table sent_ TFDUDE_GUARDED_BY(mutex_);
  Clock::rep heartbeats_ TFDUDE_GUARDED_BY(mutex_) = 0;
};

}  // namespace tfdude::fastdds
