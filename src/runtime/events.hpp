#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "partition/change_log.hpp"

namespace tfdude {

/// Reports changes to listeners, one after the other, from its own thread, which holds no lock
/// meanwhile. Thread-safe.
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

  Events();
  ~Events();
  Events(const Events&) = delete;
  Events& operator=(const Events&) = delete;

  /// After stop() the callback is never called.
  [[nodiscard]] std::uint64_t subscribe(Callback callback);

  void unsubscribe(std::uint64_t subscriber);

  void post(std::vector<Change> changes);

  /// Ends reporting; queued changes are dropped. May be called repeatedly, by one thread.
  void stop();

 private:
  struct State;
  static void run(State& state);

  const std::shared_ptr<State>
      state_;           // the thread may outlive this object if a listener has stopped it
  std::thread thread_;  // from the first subscription on; under the state's lock
};

}  // namespace tfdude
