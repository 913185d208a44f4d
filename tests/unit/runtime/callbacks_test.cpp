#include "runtime/callbacks.hpp"

#include <atomic>
#include <condition_variable>
#include <future>
#include <mutex>
#include <set>
#include <thread>

#include "support/catch.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using testing::eventually;

/// Looks after the callbacks until the condition holds, as the thread that posts must.
bool looked_after(Callbacks& callbacks, const std::function<bool()>& done) {
  return eventually([&] {
    (void)callbacks.look_after(Callbacks::Clock::now());
    return done();
  });
}

TEST_CASE("callbacks: many quick callbacks run in order on one thread") {
  Callbacks callbacks;
  std::mutex mutex;
  std::vector<int> order;
  std::set<std::thread::id> threads;
  for (int i = 0; i < 1000; ++i) {
    callbacks.post([&, i] {
      const std::lock_guard lock(mutex);
      order.push_back(i);
      threads.insert(std::this_thread::get_id());
    });
  }
  REQUIRE(eventually([&] {
    const std::lock_guard lock(mutex);
    return order.size() == 1000;
  }));
  CHECK(std::is_sorted(order.begin(), order.end()));
  CHECK(threads.size() == 1);
  CHECK_FALSE(callbacks.look_after(Callbacks::Clock::now()));
}

TEST_CASE("callbacks: slow callbacks do not keep others from running") {
  Callbacks callbacks;
  std::promise<void> held;
  const auto until = held.get_future().share();
  std::atomic<int> begun{0};
  std::atomic<int> ended{0};
  constexpr int kSlow = 5;
  for (int i = 0; i < kSlow; ++i) {
    callbacks.post([&] {
      ++begun;
      until.wait();
      ++ended;
    });
  }
  std::atomic<bool> quick{false};
  callbacks.post([&] { quick = true; });
  CHECK(looked_after(callbacks, [&] { return quick.load(); }));
  CHECK(begun == kSlow);
  CHECK(ended == 0);
  held.set_value();
  callbacks.stop();
  CHECK(ended == kSlow);
}

TEST_CASE("callbacks: after the end no callback runs and waiting ones are dropped") {
  Callbacks callbacks;
  std::promise<void> begun;
  std::promise<void> held;
  std::atomic<bool> ended{false};
  callbacks.post([&] {
    begun.set_value();
    held.get_future().wait();
    ended = true;
  });
  std::atomic<int> others{0};
  const auto counted = std::make_shared<int>(0);
  callbacks.post([&others, counted] { ++others; });
  begun.get_future().wait();
  std::atomic<bool> stopped{false};
  std::thread stopping([&] {
    callbacks.stop();
    stopped = true;
  });
  REQUIRE(eventually([&] { return counted.use_count() == 1; }));
  CHECK_FALSE(stopped);
  held.set_value();
  stopping.join();
  CHECK(ended);
  CHECK(others == 0);
  callbacks.post([&] { ++others; });
  CHECK(others == 0);
}

TEST_CASE("callbacks: a callback may destroy the queue that runs it") {
  auto callbacks = std::make_unique<Callbacks>();
  std::promise<void> done;
  std::promise<void> ready;
  callbacks->post([&] {
    ready.get_future().wait();
    callbacks.reset();
    done.set_value();
  });
  ready.set_value();
  done.get_future().wait();
  CHECK(callbacks == nullptr);
}

}  // namespace
}  // namespace tfdude
