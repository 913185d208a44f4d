#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude::fastdds {

/// When each followed participant was last heard. Each datagram of RTPS shows that its sender
/// lives, whatever it contains; its header names the sender. So participants that are idle need no
/// message of their own for that: DDS announces each of them periodically.
/// @par Thread safety  All functions are thread-safe. heard() is called for each datagram and costs
///   some 50 ns.
class LifeSigns {
 public:
  using Clock = std::chrono::steady_clock;

  /// Records when this participant is heard from now on.
  void follow(const PeerId& peer);
  void forget(const PeerId& peer);

  /// A datagram was received. Ignores one that is not of RTPS or comes from others.
  void heard(const std::uint8_t* datagram, std::size_t size, Clock::time_point now);

  /// @return nothing: not since it is followed
  [[nodiscard]] std::optional<Clock::time_point> last(const PeerId& peer) const;

 private:
  mutable Mutex mutex_;
  std::map<PeerId, std::optional<Clock::time_point>> last_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
