#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "base/mutex.hpp"
#include "transport/fastdds/attention.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/peers.hpp"
#include "transport/fastdds/senders.hpp"

namespace tfdude::fastdds {

/// Keeps in touch with other participants: announces what this one serves, looks who is silent, and
/// asks those on whom it depends for a sign of life.
/// @par Thread safety  announce() is thread-safe; look() is for the worker.
class Contact {
 public:
  /// @param repeats  whether presence is repeated, because others do not hear DDS's announcements
  Contact(Peers& peers, Attention& attention, Senders& senders, bool repeats)
      : peers_(peers), attention_(attention), senders_(senders), repeats_(repeats) {}

  /// Announces what this participant serves from now on.
  /// @param writer  outlives the use of this
  void announce(Writer& writer, const Presence& presence);

  /// Looks who is silent: often while this participant depends on others, or has news for them.
  /// @return when to look again
  [[nodiscard]] std::chrono::milliseconds look();

 private:
  bool announce_count();
  void say(std::uint32_t heard) TFDUDE_REQUIRES(mutex_);
  [[nodiscard]] std::uint32_t count() TFDUDE_REQUIRES(mutex_);

  Peers& peers_;
  Attention& attention_;
  Senders& senders_;
  const bool repeats_;
  std::chrono::milliseconds next_look_{};

  Mutex mutex_{LockRank::kAnnouncing};
  // What this participant serves, as last announced, and when that was.
  std::optional<wire::Presence> said_ TFDUDE_GUARDED_BY(mutex_);
  Writer* writer_ TFDUDE_GUARDED_BY(mutex_) = nullptr;
  Peers::Clock::time_point said_at_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
