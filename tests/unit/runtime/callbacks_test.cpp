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

/// Posts a call that belongs to no other.
void post(Callbacks& callbacks, Callbacks::Call call) { callbacks.line()->post(std::move(call)); }

TEST_CASE("callbacks: many quick callbacks run in order on one thread") {
  Loop loop{"test"};
  // While the loop is busy, nobody finds that calls wait too long, however busy the machine is.
  std::promise<void> ended;
  Loop::Job busy(loop, [&] {
    ended.get_future().wait_for(std::chrono::seconds(60));
    return Loop::kNever;
  });
  busy.ask();
  Callbacks callbacks(loop);
  std::mutex mutex;
  std::vector<int> order;
  std::set<std::thread::id> threads;
  for (int i = 0; i < 1000; ++i) {
    post(callbacks, [&, i] {
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
  ended.set_value();
}

TEST_CASE("callbacks: slow callbacks do not keep others from running") {
  Loop loop{"test"};
  Callbacks callbacks(loop);
  std::promise<void> held;
  const auto until = held.get_future().share();
  std::atomic<int> begun{0};
  std::atomic<int> ended{0};
  constexpr int kSlow = 5;
  for (int i = 0; i < kSlow; ++i) {
    post(callbacks, [&] {
      ++begun;
      until.wait();
      ++ended;
    });
  }
  std::atomic<bool> quick{false};
  post(callbacks, [&] { quick = true; });
  CHECK(eventually([&] { return quick.load(); }));
  CHECK(begun == kSlow);
  CHECK(ended == 0);
  held.set_value();
  callbacks.stop();
  CHECK(ended == kSlow);
}

TEST_CASE("callbacks: after the end no callback runs and waiting ones are dropped") {
  Loop loop{"test"};
  Callbacks callbacks(loop);
  std::promise<void> begun;
  std::promise<void> held;
  std::atomic<bool> ended{false};
  post(callbacks, [&] {
    begun.set_value();
    held.get_future().wait();
    ended = true;
  });
  std::atomic<int> others{0};
  const auto counted = std::make_shared<int>(0);
  // A line that gathers for so long, so that no second thread runs its call on a busy machine.
  callbacks.line(Milliseconds(3'600'000))->post([&others, counted] { ++others; });
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
  post(callbacks, [&] { ++others; });
  CHECK(others == 0);
}

TEST_CASE("callbacks: a callback may destroy the queue that runs it") {
  Loop loop{"test"};
  auto callbacks = std::make_unique<Callbacks>(loop);
  std::promise<void> done;
  std::promise<void> ready;
  post(*callbacks, [&] {
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
