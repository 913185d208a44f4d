#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "partition/messages.hpp"

namespace tfdude {

/// Decides which of several processes that want to serve one partition gets its name. Each
/// announces its claim, waits until all others can have been heard (at least twice as long as a
/// message takes), and announces that it has taken the name if to_take() allows it. Then it checks
/// again, and serves if to_serve() allows it. Of simultaneous claims the one with the least ticket
/// wins, unless another process has taken the name before. So, as long as messages come in time,
/// exactly one serves: if two processes announce "taken", the later one hears the other before it
/// checks; and a process that claims after another has taken the name hears that before it takes
/// the name. Not thread-safe.
class NameClaim {
 public:
  enum class Turn {
    kMine,
    kWait,    ///< an earlier claimant has not decided yet
    kOthers,  ///< another process has it
  };

  /// @param own  this process's presence, with its ticket
  explicit NameClaim(Presence own = {}) : own_(std::move(own)) {}

  /// Sets this process's presence, if it was not known before.
  void claim(Presence own) { own_ = std::move(own); }

  /// Another process's presence for the same partition.
  void hear(const Presence& presence);
  /// The process that last announced this incarnation is lost. @return whether it was known
  bool lost(std::uint64_t incarnation);

  /// Evaluated before the name is taken.
  [[nodiscard]] Turn to_take() const;
  /// Evaluated after "taken" was announced.
  [[nodiscard]] Turn to_serve() const;

  /// Whether another process serves the partition.
  [[nodiscard]] bool served() const;
  /// The process that prevents this one from serving, or may do so.
  [[nodiscard]] std::optional<Presence> rival() const;

 private:
  /// By ticket, host and process: unique.
  using Key = std::tuple<std::uint64_t, std::string, std::uint32_t>;
  static Key key_of(const Presence& presence) {
    return {presence.ticket, presence.host, presence.pid};
  }
  [[nodiscard]] bool is_before(const Presence& rival) const { return key_of(rival) < key_of(own_); }

  Presence own_;
  std::map<Key, Presence> rivals_;
};

}  // namespace tfdude
