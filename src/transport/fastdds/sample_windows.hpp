#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "base/mutex.hpp"
#include "partition/messages.hpp"
#include "transport/fastdds/rtps_check.hpp"

namespace tfdude::fastdds {

/// Bounds how many DDS samples of a writer wait in Fast DDS for earlier ones. Where each has an
/// instance of its own, as pages have, each sample that is taken costs a walk through all that wait
/// (Fast DDS 2.9 and 3.1). A flood of pages, many of which are lost, so took all of the time.
///
/// A sample of a followed writer that is more than kAhead beyond what Fast DDS has acknowledged, or
/// was given since without a gap, is dropped. Its writer is reliable, so it is repeated when Fast
/// DDS asks for it. What is acknowledged here is read in what is sent. So nothing is dropped where
/// that is not seen, and nothing for good: after each heartbeat Fast DDS says what it lacks.
/// @par Thread safety  All functions are thread-safe.
class SampleWindows {
 public:
  using Entity = NumberClaim::Entity;

  static constexpr std::uint64_t kAhead = 512;

  /// A reliable writer was discovered, whose samples have instances of their own.
  void follow(const PeerId& peer, const Entity& writer);
  void forget(const PeerId& peer, const Entity& writer);

  /// Call for each datagram that Fast DDS is given next. @return whether it may have it
  [[nodiscard]] bool admits(const std::uint8_t* datagram, std::size_t size);
  /// This participant sends a datagram.
  void sent(const std::uint8_t* datagram, std::size_t size);

 private:
  class Claims;
  using Writer = std::pair<PeerId, Entity>;

  std::atomic<bool> any_{false};
  Mutex mutex_;
  // What Fast DDS has without a gap; empty: it has not said so yet.
  std::map<Writer, std::optional<std::uint64_t>> complete_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
