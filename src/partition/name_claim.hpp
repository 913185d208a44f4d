#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include "partition/messages.hpp"

namespace tfdude {

/// Who of several processes that want to serve one partition gets its name. Each says that it claims it, waits until
/// whoever was there can have been heard (twice as long as a message takes, at least), and says that it has taken it if
/// to_take() allows it; then it looks once more, and serves if to_serve() allows it. Of those who claim at once the one
/// with the least ticket has it, unless another has taken it before. So, as long as messages come in time, exactly one
/// serves: of two who both say "taken" the later one of them hears the other before it looks, and who claims after
/// somebody has taken hears that before it takes. Not thread-safe.
class NameClaim {
 public:
  enum class Turn {
    kMine,
    kWait,    ///< another one, who came earlier, has not decided yet
    kOthers,  ///< another one has it
  };

  /// @param own  what this process says; its ticket is what counts
  explicit NameClaim(Presence own = {}) : own_(std::move(own)) {}

  /// What this process says is known only now.
  void claim(Presence own) { own_ = std::move(own); }

  /// What another process says of the same partition.
  void hear(const Presence& presence);
  /// The process that said so last under this incarnation is not heard any more.
  void lost(std::uint64_t incarnation);

  /// Before it is taken.
  [[nodiscard]] Turn to_take() const;
  /// After it was said that it is taken.
  [[nodiscard]] Turn to_serve() const;

  /// Whether another process serves it.
  [[nodiscard]] bool served() const;
  /// The one that is in the way, or may be.
  [[nodiscard]] std::optional<Presence> rival() const;

 private:
  /// By ticket, host and process: no two are the same.
  using Key = std::tuple<std::uint64_t, std::string, std::uint32_t>;
  static Key key_of(const Presence& presence) {
    return {presence.ticket, presence.host, presence.pid};
  }
  [[nodiscard]] bool is_before(const Presence& rival) const { return key_of(rival) < key_of(own_); }

  Presence own_;
  std::map<Key, Presence> rivals_;
};

}  // namespace tfdude
