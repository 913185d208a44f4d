#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude::fastdds {

/// What each reader has acknowledged, read from the datagrams that arrive. Fast DDS itself waits
/// only for all readers of a writer, also for those of a process that was killed: it keeps them for
/// 30 s. Where datagrams are encrypted, nothing can be read.
/// @par Thread safety  All functions are thread-safe. heard() is called for each datagram; it costs
///   an atomic load while nobody waits.
class Acknowledgements {
 public:
  using Deadline = std::chrono::steady_clock::time_point;
  /// The last part of the GUID of a writer of this participant.
  using WriterId = std::array<std::uint8_t, 4>;

  /// A datagram was received. Ignores one that is not of RTPS.
  void heard(const std::uint8_t* datagram, std::size_t size);

  /// Waits until the reader of a participant has acknowledged all DDS samples of a writer up to
  /// this number. Reliable writers request it several times per second. @return false at the
  /// deadline
  [[nodiscard]] bool wait_until(const PeerId& reader, const WriterId& writer, std::uint64_t number,
                                Deadline deadline);

 private:
  using Key = std::pair<PeerId, WriterId>;

  std::atomic<int> waiting_{0};
  Mutex mutex_;
  Condition changed_;
  // The first that is missing, of those that are waited for.
  std::map<Key, std::uint64_t> missing_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
