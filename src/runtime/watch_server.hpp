#pragma once

#include <atomic>
#include <optional>

#include "runtime/context.hpp"
#include "runtime/pushes.hpp"
#include "runtime/watch_client.hpp"

namespace tfdude {

/// The owner's side of watched paths: answers watch requests, and pushes to watchers, including
/// this process.
/// @par Thread safety  All functions are thread-safe.
class WatchServer final : private Pushes::Sink {
 public:
  /// @param watches  of this process
  WatchServer(const Context& context, WatchClient& watches)
      : context_(context),
        watches_(watches),
        pushes_(context.structure.forest, context.options.limits.watches, *this),
        job_(context.threads.push, [this] { return pushes_.run(); }) {}
  ~WatchServer() override { stop(); }
  WatchServer(const WatchServer&) = delete;
  WatchServer& operator=(const WatchServer&) = delete;

  /// Ends pushing; later watch requests are rejected.
  void stop();

  /// The reply to a WatchRequest. @param watcher  who asks; none: this process
  [[nodiscard]] Reply answer(const Request& request, const std::optional<PeerId>& watcher = {});

  /// How many groups of watchers were rejected.
  [[nodiscard]] std::uint64_t refused() const { return pushes_.refused(); }

  /// Histories are about to be cleared: watchers get what was written before.
  void keep_pending() { pushes_.keep_pending(); }

  /// A watcher of the group has only now been matched.
  void on_watcher(std::uint64_t group) { pushes_.tell_all(group); }

 private:
  // Pushes::Sink
  void push(const PushedValues& values) override;
  void end(std::uint64_t group) override { context_.transport.end_pushing(group); }
  void wake() override { job_.ask(); }

  const Context context_;
  WatchClient& watches_;
  std::atomic<bool> stopped_{false};
  Pushes pushes_;
  Loop::Job job_;  // last: it uses the other members
};

}  // namespace tfdude
