#include "runtime/events.hpp"

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "runtime/context.hpp"
#include "support/catch.hpp"

namespace tfdude {
namespace {

Change change(const std::string& frame) {
  return {ChangeKind::kFrameAdded, "arms", frame, {}, {}, {}, {}};
}

/// Keeps what it hears, and can be held.
class Heard {
 public:
  [[nodiscard]] Events::Callback callback() {
    return [this](const Change& one) {
      std::unique_lock lock(mutex_);
      frames_.push_back(one.kind == ChangeKind::kMissed ? one.message : one.frame);
      changed_.notify_all();
      changed_.wait(lock, [this] { return !held_; });
    };
  }
  [[nodiscard]] bool hears(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(20),
                             [&] { return frames_.size() >= count; });
  }
  void hold(bool held) {
    const std::lock_guard lock(mutex_);
    held_ = held;
    changed_.notify_all();
  }
  [[nodiscard]] std::vector<std::string> frames() {
    const std::lock_guard lock(mutex_);
    return frames_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> frames_;
  bool held_ = false;
};

TEST_CASE("events: each listener gets each change in order from when it subscribes") {
  Heard first;
  Heard second;
  Threads threads;
  Events events(threads.callbacks);
  (void)events.subscribe(first.callback());
  events.post({change("a"), change("b")});
  REQUIRE(first.hears(2));
  (void)events.subscribe(second.callback());
  events.post({change("c")});
  REQUIRE(first.hears(3));
  REQUIRE(second.hears(1));
  CHECK(first.frames() == std::vector<std::string>{"a", "b", "c"});
  CHECK(second.frames() == std::vector<std::string>{"c"});
}

TEST_CASE("events: unsubscribing waits for the listener that runs and ends all calls to it") {
  Heard heard;
  Threads threads;
  Events events(threads.callbacks);
  const auto subscriber = events.subscribe(heard.callback());
  heard.hold(true);
  events.post({change("a"), change("b")});
  REQUIRE(heard.hears(1));
  std::atomic<bool> ended{false};
  std::thread ending([&] {
    events.unsubscribe(subscriber);
    ended = true;
  });
  CHECK_FALSE(ended);
  heard.hold(false);
  ending.join();
  const auto before = heard.frames();
  Heard other;
  (void)events.subscribe(other.callback());
  events.post({change("c")});
  REQUIRE(other.hears(1));
  CHECK(heard.frames() == before);
}

TEST_CASE("events: a listener may end its own subscription") {
  Threads threads;
  Events events(threads.callbacks);
  std::uint64_t self = 0;
  std::atomic<int> calls{0};
  Heard other;
  self = events.subscribe([&](const Change&) {
    ++calls;
    events.unsubscribe(self);
  });
  (void)events.subscribe(other.callback());
  events.post({change("a"), change("b")});
  REQUIRE(other.hears(2));
  CHECK(calls == 1);
}

TEST_CASE("events: a listener is told the number of changes that were dropped") {
  Heard heard;
  Threads threads;
  Events events(threads.callbacks);
  (void)events.subscribe(heard.callback());
  heard.hold(true);
  events.post({change("first")});
  REQUIRE(heard.hears(1));
  events.post(std::vector<Change>(Events::kMaxWaiting + 5, change("more")));
  heard.hold(false);
  REQUIRE(heard.hears(Events::kMaxWaiting + 2));
  CHECK(heard.frames().back() == "5 changes were dropped: the listeners are too slow");
}

}  // namespace
}  // namespace tfdude
