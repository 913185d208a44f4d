#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "partition/change_log.hpp"
#include "runtime/callbacks.hpp"

namespace tfdude {

/// Reports changes to listeners, one after the other: on one line of the callbacks. Thread-safe.
///
/// After unsubscribe() has returned, the listener is not running and will not run; it has been
/// destroyed, unless it is held elsewhere. After stop() has returned this is so for all listeners.
/// Both wait for a running listener, except when a listener calls them, whatever its subscription:
/// then they return at once, and after stop() no other listener is called. A listener must not wait
/// for a thread that waits in one of these.
class Events {
 public:
  using Callback = std::function<void(const Change&)>;

  /// Maximum number of changes in the queue; of others only the number is reported.
  static constexpr std::size_t kMaxWaiting = 65'536;

  explicit Events(Callbacks& callbacks);
  ~Events();
  Events(const Events&) = delete;
  Events& operator=(const Events&) = delete;

  /// After stop() the callback is never called.
  [[nodiscard]] std::uint64_t subscribe(Callback callback);

  void unsubscribe(std::uint64_t subscriber);

  void post(std::vector<Change> changes);

  /// Ends reporting; queued changes are dropped.
  void stop();

 private:
  struct State;

  const std::shared_ptr<State> state_;  // a listener that is running may outlive this object
  const std::shared_ptr<Callbacks::Line> line_;
};

}  // namespace tfdude
