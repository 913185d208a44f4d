#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <set>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude::fastdds {

/// Says to Fast DDS, in place of participants that were killed, that they leave. Fast DDS keeps
/// such a participant for 30 s, and waits for its acknowledgements. Only for those that a later
/// process has replaced, or that are silent (Departures, Crowd), or that Fast DDS shall discover
/// anew (EndpointSets): a participant that is alive is discovered again, but only one of the two
/// knows of it.
/// @par Thread safety  All functions are thread-safe.
class Farewells {
 public:
  /// What a participant would send: a header, and DATA of its announcements that disposes of it
  /// (RTPS 2.2, sections 8.5.3.3 and 9.6.3.9). It is not protected, with keys neither.
  using Datagram = std::array<std::uint8_t, 76>;

  [[nodiscard]] static Datagram farewell_of(const PeerId& peer);

  /// Takes effect when the next message of discovery arrives. Each participant announces itself
  /// every 300 ms.
  void say_for(const PeerId& peer);

  /// Calls say(datagram) for each participant for which it was not said yet. An atomic load if
  /// there is none.
  template <class Say>
  void take(const Say& say) {
    if (!any_.load(std::memory_order_relaxed)) return;
    for (const PeerId& peer : take_all()) say(farewell_of(peer));
  }

 private:
  [[nodiscard]] std::set<PeerId> take_all();

  std::atomic<bool> any_{false};
  Mutex mutex_;
  std::set<PeerId> left_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
