#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

#include "partition/change_log.hpp"

namespace tfdude {

/// Tells changes to whoever wants to know, one after the other, from a thread of its own that holds no lock
/// meanwhile. Thread-safe.
///
/// After unsubscribe() has returned, the listener does not run and will not run; it has been destroyed, unless somebody else
/// holds it. After stop() has returned this is so for all listeners. Both wait for the listener that runs, except where
/// they are called by a listener, whatever its subscription: then they return at once, and after the listener that called
/// stop() no other is called. A listener must not wait for a thread that waits in one of these.
class Events {
 public:
  using Callback = std::function<void(const Change&)>;

  /// Changes that wait to be told; of more, it is told only how many there were.
  static constexpr std::size_t kMaxWaiting = 65'536;

  Events();
  ~Events();
  Events(const Events&) = delete;
  Events& operator=(const Events&) = delete;

  /// After stop() the callback is never called.
  [[nodiscard]] std::uint64_t subscribe(Callback callback);

  void unsubscribe(std::uint64_t subscriber);

  void post(std::vector<Change> changes);

  /// Ends the telling; what waits is dropped. To be called by one thread, once or again.
  void stop();

 private:
  struct State;
  static void run(State& state);

  const std::shared_ptr<State>
      state_;           // the thread may outlive this, where a listener has stopped it
  std::thread thread_;  // from the first subscription on; under the state's lock
};

}  // namespace tfdude
