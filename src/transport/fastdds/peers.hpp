#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "base/mutex.hpp"
#include "partition/messages.hpp"
#include "transport/fastdds/compat.hpp"

namespace tfdude::fastdds {

/// The participant's part of a DDS identity: unique in the domain, new at every start.
[[nodiscard]] PeerId peer_of(const ertps::GuidPrefix_t& prefix);

/// The DDS partition in which a peer reads its replies.
[[nodiscard]] std::string reply_partition(const PeerId& peer);

/// The name a participant announces: whether it serves a partition, and which.
[[nodiscard]] std::string participant_name(const std::string& partition);

/// Who was met, what each said that it serves, and who has fallen silent. Thread-safe; what is told is told
/// under a lock, so that of one peer all is told in order: whoever is told must not hold a lock of its own
/// when it asks here.
///
/// Each server says what it serves when that changes, reliably, and again and again as a beat that may be lost, to
/// readers with sockets of their own, which no other traffic fills: of a reliable stream, what follows a lost
/// sample is late, too. Leases of Fast DDS 2.9 are not used for this: a short one of a participant ends the
/// match on the side only that was starved, and the other's count of acknowledgements, an old one, keeps it
/// from being renewed; and liveliness of a topic is renewed by any participant (issue 4373).
class Peers {
 public:
  using Clock = std::chrono::steady_clock;
  using Tell = std::function<void(const Presence&)>;

  /// Whatever answers a newcomer has answered, as a rule, once nobody new was met for this long.
  static constexpr std::chrono::milliseconds kQuiet{200};

  /// How often a server says that it is there. Seven beats must be lost before it counts as gone after the usual 450 ms.
  static constexpr std::chrono::milliseconds kSpeakEvery{60};

  /// @param there  a peer said what it serves, or is heard again
  /// @param gone   a peer that had said so, or sent a page, has left or fallen silent; of one that sent only pages, with
  ///               what these say of it
  Peers(Tell there, Tell gone) : there_(std::move(there)), gone_(std::move(gone)) {}

  /// To be called before anybody is met.
  /// @param silence     whoever has not been heard for this long counts as gone
  /// @param first_beat  how long its first beat may take, whose way DDS may have to find still when the presence has
  ///                    come already
  /// @param is_server   the others count this participant, too
  void configure(std::chrono::nanoseconds silence, std::chrono::nanoseconds first_beat,
                 bool is_server) {
    silence_ = silence;
    first_beat_ = std::max(silence, first_beat);
    is_server_ = is_server;
  }

  void met(const ertps::GuidPrefix_t& prefix, const std::string& name);
  void left(const ertps::GuidPrefix_t& prefix);
  /// @param peers  how many other servers that one hears
  /// @param beat   whether this is said again and again
  void present(const ertps::GuidPrefix_t& prefix, const Presence& presence, std::size_t peers,
               bool beat);
  /// A server sent a page, which may come before what it says of itself.
  void sent_page(const ertps::GuidPrefix_t& prefix, const Page& page);
  /// A server sent something else: a sign of life, should what it says of itself be late.
  void heard(const ertps::GuidPrefix_t& prefix);

  /// Tells who has fallen silent since the last time. Whoever looks late was kept from hearing, too, and
  /// does not hold that against the others.
  void look_for_silent(Clock::time_point now);

  /// How many servers are heard.
  [[nodiscard]] std::uint32_t heard_count() const;

  /// Whether whoever served this partition has fallen silent.
  [[nodiscard]] bool silent(const std::string& partition) const;

  /// Whether some server was met, nobody new for a while, all servers have said what they serve, and none hears
  /// more others than this participant knows.
  [[nodiscard]] bool discovered() const;

  /// Whether some server was met that has not said yet what it serves. One that has sent a page, and then nothing more for
  /// as long as a first beat may take, is not waited for.
  [[nodiscard]] bool awaits_presence() const;

 private:
  [[nodiscard]] bool all_present() const TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] bool nobody_hears_more() const TFDUDE_REQUIRES(mutex_);

  struct Server {
    std::optional<Presence> presence;
    std::optional<Presence> by_page;  // what its pages say, before there is a presence as late
    std::size_t peers = 0;
    Clock::time_point last_heard;
    bool beats = false;
    bool silent = false;

    [[nodiscard]] const Presence* said() const {
      const bool later = by_page && presence && by_page->incarnation > presence->incarnation;
      if (presence && !later) return &*presence;
      return by_page ? &*by_page : nullptr;
    }
  };

  /// How long this one may be silent.
  [[nodiscard]] std::chrono::nanoseconds patience(const Server& server) const {
    return server.beats ? silence_ : first_beat_;
  }

  const Tell there_;
  const Tell gone_;
  mutable Mutex mutex_{LockRank::kReporting};  // also while reporting, to keep the order
  std::map<PeerId, Server> servers_ TFDUDE_GUARDED_BY(mutex_);
  Clock::time_point last_met_ TFDUDE_GUARDED_BY(mutex_){};
  Clock::time_point last_look_ TFDUDE_GUARDED_BY(mutex_) = Clock::now();
  // Set once, before anybody is met.
  std::chrono::nanoseconds silence_{};
  std::chrono::nanoseconds first_beat_{};
  bool is_server_ = false;
};

}  // namespace tfdude::fastdds
