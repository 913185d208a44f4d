#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "tfdude/partition/change.hpp"

namespace tfdude {

/// Tells changes to whoever wants to know, one after the other, from a thread of its own that holds no lock
/// meanwhile. Thread-safe.
class Events {
 public:
  using Callback = std::function<void(const Change&)>;

  /// Changes that wait to be told; of more, it is told only how many there were.
  static constexpr std::size_t kMaxWaiting = 65'536;

  Events() = default;
  ~Events();
  Events(const Events&) = delete;
  Events& operator=(const Events&) = delete;

  [[nodiscard]] std::uint64_t subscribe(Callback callback);

  /// Once this returns the callback is not called any more, and does not run, unless it is itself that calls.
  void unsubscribe(std::uint64_t subscriber);

  void post(std::vector<Change> changes);

  /// Ends the telling; what waits is dropped. Not to be called from a callback.
  void stop();

 private:
  /// A change, and the last of those who listened when it happened.
  struct Waiting {
    Change change;
    std::uint64_t last_subscriber = 0;
  };

  void run();
  std::optional<Waiting> next(std::unique_lock<std::mutex>& lock);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::uint64_t, std::shared_ptr<const Callback>> subscribers_;
  std::uint64_t last_subscriber_ = 0;
  std::uint64_t running_ = 0;  // the subscriber that is being told
  std::deque<Waiting> waiting_;
  std::size_t missed_ = 0;
  bool stopping_ = false;
  std::thread thread_;  // from the first subscription on
};

}  // namespace tfdude
