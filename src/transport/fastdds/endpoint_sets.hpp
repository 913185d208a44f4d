#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "base/mutex.hpp"
#include "partition/messages.hpp"

namespace tfdude::fastdds {

/// Whether Fast DDS knows those endpoints of a participant that it has. Without keys, anybody can
/// say in its name that an endpoint is gone or has changed, or use up the next number of its
/// announcements. Fast DDS believes that, and the participant announces its endpoints only once. So
/// each participant adds to each announcement of itself which endpoints it has, as a sum. If that
/// goes on to differ from what is known here, Fast DDS has to discover the participant anew.
///
/// The sum of an endpoint that is created counts after it was announced, and that of one that is
/// deleted no more before that is announced. So a participant that says that it has an endpoint
/// that was lost here contradicts this, while one that was not discovered yet may be on its way.
/// @par Thread safety  All functions are thread-safe.
class EndpointSets {
 public:
  using Clock = std::chrono::steady_clock;
  using Entity = std::array<std::uint8_t, 4>;

  /// For so long the difference must stay the same, if something was lost here since both agreed.
  /// Within it Fast DDS repeats an endpoint that replaces the lost one, if its message was lost on
  /// the way.
  static constexpr std::chrono::milliseconds kAfterLoss{1200};
  /// Otherwise.
  static constexpr std::chrono::milliseconds kOtherwise{3000};
  /// Each discovery doubles them, up to this factor; who agrees for kTrustedAfter has them as
  /// before.
  static constexpr int kMostPatient = 64;
  static constexpr std::chrono::seconds kTrustedAfter{10};
  /// Of those lost since both agreed.
  static constexpr std::size_t kMostLost = 256;
  /// Participants that are gone are forgotten, beyond so many.
  static constexpr std::size_t kMost = 1024;

  /// Of this participant.
  void created(const Entity& endpoint) { own_ += number_of(endpoint); }
  void deleted(const Entity& endpoint) { own_ -= number_of(endpoint); }

  /// An announcement of this participant with its endpoints, behind all else.
  [[nodiscard]] std::vector<std::uint8_t> with_own(const std::uint8_t* announcement,
                                                   std::size_t size) const;

  /// What Fast DDS knows of others.
  void found(const PeerId& peer);
  /// @param settings  all that matters for its matches, as a number
  void found(const PeerId& peer, const Entity& endpoint, std::uint64_t settings);
  void lost(const PeerId& peer, const Entity& endpoint);
  /// @return whether that is only said to Fast DDS, which is going to discover it anew
  bool left(const PeerId& peer);

  /// A datagram was received. An announcement with endpoints is compared.
  /// @return whether Fast DDS has to discover its sender anew
  /// @par Complexity  O(1) for any other datagram
  [[nodiscard]] bool contradicts(const std::uint8_t* datagram, std::size_t size,
                                 Clock::time_point now);

 private:
  struct Doubt {
    std::uint64_t difference = 0;
    Clock::time_point since{};
  };
  struct Known {
    bool there = true;
    bool anew = false;  // contradicts() was true, and it has not left since
    // What was found first; empty: it has changed since, which no endpoint of ours does.
    std::map<Entity, std::optional<std::uint64_t>> endpoints;
    std::uint64_t sum = 0;  // of those that have not changed
    std::set<Entity> lost;  // since both agreed; none of ours comes back
    bool changed = false;   // the same for a change
    std::optional<Doubt> doubt;
    int patience = 1;
    Clock::time_point discovered_anew{};
  };

  [[nodiscard]] static std::uint64_t number_of(const Entity& endpoint);
  Known& known(const PeerId& peer) TFDUDE_REQUIRES(mutex_);

  std::atomic<std::uint64_t> own_{0};
  Mutex mutex_;
  std::map<PeerId, Known> known_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
