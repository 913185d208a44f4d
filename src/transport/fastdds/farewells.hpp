#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <optional>
#include <set>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude::fastdds {

/// Says to Fast DDS, in place of participants that were killed, that they leave. Fast DDS keeps
/// such a participant for 30 s, and waits for its acknowledgements. Only for those that a later
/// process has replaced, or that are silent (Departures, Crowd), or that Fast DDS shall discover
/// anew (EndpointSets): a participant that is alive is discovered again, but only one of the two
/// knows of it.
///
/// A moment is chosen at which nobody else is being discovered. Fast DDS 2.9 stands still for good
/// if it removes a participant just when another thread repeats something of discovery: each waits
/// for a lock of the other (StatefulWriter::matched_reader_remove and the thread of the flow
/// controller; its pull request 5432, in 2.10.7 and 3.0.2).
/// @par Thread safety  All functions are thread-safe.
class Farewells {
 public:
  /// What a participant would send: a header, and DATA of its announcements that disposes of it
  /// (RTPS 2.2, sections 8.5.3.3 and 9.6.3.9). It is not protected, with keys neither.
  using Datagram = std::array<std::uint8_t, 76>;

  using Clock = std::chrono::steady_clock;

  /// So long after the last message about endpoints or keys, Fast DDS has sent what it answers. It
  /// answers acknowledgements after 5 ms.
  static constexpr std::chrono::milliseconds kQuiet{30};
  /// Those that leave wait no longer for that: then it has to be made quiet.
  static constexpr std::chrono::milliseconds kPatience{2000};

  [[nodiscard]] static Datagram farewell_of(const PeerId& peer);

  /// Takes effect when a message of discovery arrives, once it was quiet. Each participant
  /// announces itself every 300 ms.
  void say_for(const PeerId& peer);

  /// A message of discovery has come that is no announcement of a participant.
  void busy(Clock::time_point now) {
    busy_at_.store(now.time_since_epoch().count(), std::memory_order_relaxed);
  }

  enum class When : std::uint8_t { kLater, kNow, kOnceQuiet };

  /// Whether it is time to say it for some. If they have waited for too long, kOnceQuiet: let no
  /// message in for kQuiet before. An atomic load if there is none.
  [[nodiscard]] When when(Clock::time_point now) {
    return any_.load(std::memory_order_relaxed) ? when_to_take(now) : When::kLater;
  }

  /// Calls say(datagram) for each participant for which it was not said yet.
  template <class Say>
  void take(const Say& say) {
    for (const PeerId& peer : take_all()) say(farewell_of(peer));
  }

 private:
  [[nodiscard]] When when_to_take(Clock::time_point now);
  [[nodiscard]] std::set<PeerId> take_all();

  std::atomic<bool> any_{false};
  std::atomic<Clock::rep> busy_at_{0};
  Mutex mutex_;
  std::set<PeerId> left_ TFDUDE_GUARDED_BY(mutex_);
  std::optional<Clock::time_point> waiting_since_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
