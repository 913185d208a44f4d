#pragma once

#include <atomic>

#include "runtime/context.hpp"
#include "runtime/push_loop.hpp"
#include "runtime/watch_client.hpp"

namespace tfdude {

/// The owner's side of watched paths: answers watch requests, and pushes to watchers, including
/// this process.
/// @par Thread safety  All functions are thread-safe.
class WatchServer final : private PushLoop::Sink {
 public:
  /// @param watches  of this process
  WatchServer(const Context& context, WatchClient& watches)
      : context_(context),
        watches_(watches),
        pushes_(context.threads.push, context.structure.forest, context.options.limits.watches,
                *this) {}

  /// Ends pushing; later watch requests are rejected.
  void stop();

  /// The reply to a WatchRequest.
  [[nodiscard]] Reply answer(const Request& request);

  /// How many groups of watchers were rejected.
  [[nodiscard]] std::uint64_t refused() const { return pushes_.refused(); }

  /// A watcher of the group has only now been matched.
  void on_watcher(std::uint64_t group) { pushes_.tell_all(group); }

 private:
  // PushLoop::Sink
  void push(const PushedValues& values) override;
  void end(std::uint64_t group) override { context_.transport.end_pushing(group); }

  const Context context_;
  WatchClient& watches_;
  std::atomic<bool> stopped_{false};
  PushLoop pushes_;  // last: it uses the other members
};

}  // namespace tfdude
