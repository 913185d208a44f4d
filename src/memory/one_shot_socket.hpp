#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "memory/one_shot.hpp"

namespace tfdude {

/// Answers those processes of this computer and its user that ask once, at a socket whose name they
/// know. A thread of its own reads and answers; nobody who asks can make it wait, and it keeps no
/// more than some connections.
class OneShotSocket {
 public:
  /// Answers a message; empty: not. Called by the thread, and so must not wait.
  using Answer = std::function<std::string(std::string_view message)>;

  virtual ~OneShotSocket() = default;

  /// @return null: the system does not allow it, or as many processes of this network as can be
  ///   asked are there already
  [[nodiscard]] static std::unique_ptr<OneShotSocket> open(const std::string& network,
                                                           Answer answer);
};

/// Asks processes of this network and user, some of them one after the other, until one answers.
/// Without a thread. Waits for 10 ms at most, as for one that hangs.
/// @return empty: nobody has answered
[[nodiscard]] std::optional<OneShotAnswer> ask_once(const std::string& network,
                                                    const OneShotQuestion& question);

}  // namespace tfdude
