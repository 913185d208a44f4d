#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>

#include "base/mutex.hpp"
#include "transport/fastdds/attention.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/entities.hpp"
#include "transport/fastdds/peers.hpp"

namespace tfdude::fastdds {

/// Keeps in touch with other participants: announces what this one serves, looks who is silent, and
/// asks those on whom it depends for a sign of life.
/// @par Thread safety  announce() is thread-safe; look() is for the worker.
class Contact {
 public:
  /// What it needs of the writers to owners.
  struct Owners {
    /// The partitions to which something was sent recently.
    std::function<std::set<std::string>()> used;
    /// Those of them that can be asked for a sign of life.
    std::function<std::set<std::string>(const std::set<std::string>&)> askable;
    std::function<void(const std::string& partition)> probe;
  };

  /// @param repeats  whether presence is repeated, because others do not hear DDS's announcements
  Contact(Peers& peers, Attention& attention, Owners owners, bool repeats)
      : peers_(peers), attention_(attention), owners_(std::move(owners)), repeats_(repeats) {}

  /// Announces what this participant serves from now on.
  /// @param writer  outlives the use of this
  void announce(Writer& writer, const Presence& presence);

  /// Looks who is silent: often while this participant depends on others, or has news for them.
  /// @return when to look again
  [[nodiscard]] std::chrono::milliseconds look();

 private:
  bool announce_count();
  void say(std::uint32_t heard) TFDUDE_REQUIRES(mutex_);

  Peers& peers_;
  Attention& attention_;
  const Owners owners_;
  const bool repeats_;
  std::chrono::milliseconds next_look_{};

  Mutex mutex_{LockRank::kAnnouncing};
  // What this participant serves, as last announced, and when that was.
  std::optional<wire::Presence> said_ TFDUDE_GUARDED_BY(mutex_);
  Writer* writer_ TFDUDE_GUARDED_BY(mutex_) = nullptr;
  Peers::Clock::time_point said_at_ TFDUDE_GUARDED_BY(mutex_);
};

}  // namespace tfdude::fastdds
