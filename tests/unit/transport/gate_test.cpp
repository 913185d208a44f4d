#include "transport/fastdds/gate.hpp"

#include <atomic>
#include <chrono>
#include <future>
#include <thread>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::fastdds {
namespace {

using std::chrono::milliseconds;

template <class Call>
std::future<void> start(Call call) {
  return std::async(std::launch::async, call);
}

bool is_over(const std::future<void>& future, milliseconds patience) {
  return future.wait_for(patience) == std::future_status::ready;
}

constexpr milliseconds kLong{10'000};
constexpr milliseconds kShort{50};

}  // namespace

TEST_CASE("gate: a pause waits for threads inside and lets new ones wait") {
  Gate gate;
  std::promise<void> inside;
  std::promise<void> go_on;
  auto first = start([&] {
    const Gate::Pass pass(gate);
    inside.set_value();
    go_on.get_future().wait();
  });
  inside.get_future().wait();
  std::promise<void> paused;
  std::promise<void> resume;
  auto pause = start([&] {
    const Gate::Pause held(gate);
    paused.set_value();
    resume.get_future().wait();
  });
  const auto is_paused = paused.get_future();
  CHECK_FALSE(is_over(pause, milliseconds(0)));
  CHECK(is_paused.wait_for(kShort) == std::future_status::timeout);
  go_on.set_value();
  REQUIRE(is_paused.wait_for(kLong) == std::future_status::ready);
  std::atomic<bool> entered{false};
  auto second = start([&] {
    const Gate::Pass pass(gate);
    entered = static_cast<bool>(pass);
  });
  CHECK_FALSE(is_over(second, kShort));
  resume.set_value();
  CHECK(is_over(second, kLong));
  CHECK(entered);
}

TEST_CASE("gate: a closed gate lets nobody in and releases waiting threads") {
  Gate gate;
  std::atomic<bool> entered{true};
  std::future<void> waiting;
  {
    const Gate::Pause pause(gate);
    waiting = start([&] {
      const Gate::Pass pass(gate);
      entered = static_cast<bool>(pass);
    });
    CHECK_FALSE(is_over(waiting, kShort));
    gate.close();
    CHECK(is_over(waiting, kLong));
  }
  CHECK_FALSE(entered);
  const Gate::Pass late(gate);
  CHECK_FALSE(late);
  const Gate::Pause still_works(gate);
}

TEST_CASE("gate: a thread inside may pause the gate") {
  Gate gate;
  const Gate::Pass pass(gate);
  const Gate::Pause pause(gate);
  CHECK(pass);
}

TEST_CASE("gate: the datagram that takes longest is known") {
  Gate gate;
  const Gate::Clock::time_point start(std::chrono::hours(1));
  CHECK(gate.busy_for(start) == Gate::Clock::duration(0));
  {
    const Gate::Pass first(gate, start);
    CHECK(gate.busy_for(start + milliseconds(70)) == milliseconds(70));
    {
      const Gate::Pass second(gate, start + milliseconds(20));
      CHECK(gate.busy_for(start + milliseconds(70)) == milliseconds(70));
    }
    CHECK(gate.busy_for(start + milliseconds(80)) == milliseconds(80));
  }
  CHECK(gate.busy_for(start + milliseconds(90)) == Gate::Clock::duration(0));
}

TEST_CASE("gate: no thread is inside during a pause") {
  Gate gate;
  std::atomic<bool> over{false};
  std::atomic<int> inside{0};
  std::atomic<std::uint64_t> passed{0};
  std::vector<std::future<void>> receivers;
  for (int i = 0; i < 3; ++i) {
    receivers.push_back(start([&] {
      while (!over) {
        const Gate::Pass pass(gate);
        ++inside;
        ++passed;
        --inside;
      }
    }));
  }
  int seen = 0;
  for (int i = 0; i < 500; ++i) {
    const auto before = passed.load();
    while (passed.load() == before) std::this_thread::yield();
    const Gate::Pause pause(gate);
    for (int look = 0; look < 100; ++look) seen += inside.load();
  }
  over = true;
  for (auto& receiver : receivers) receiver.wait();
  CHECK(seen == 0);
}

}  // namespace tfdude::fastdds
