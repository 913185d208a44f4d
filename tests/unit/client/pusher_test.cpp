#include "client/pusher.hpp"

#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::eventually;
using testing::outcome;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

// An owner of two frames, and all that it pushed.
struct PushingOwner {
  PushingOwner() {
    REQUIRE(forest.add("arm", "", along_x(0)));
    REQUIRE(forest.add("hand", "arm", along_x(0)));
  }
  void push(const State& state) {
    const std::lock_guard lock(mutex);
    for (const News& entry : state.entries) pushed[state.group].push_back(entry.stamp);
  }
  std::size_t count(std::uint64_t group) {
    const std::lock_guard lock(mutex);
    return pushed[group].size();
  }

  Forest forest;
  std::mutex mutex;
  std::map<std::uint64_t, std::vector<std::optional<Time>>> pushed;
  Pusher pusher{forest, [this](const State& state) { push(state); }, [](std::uint64_t) {}};
};

}  // namespace

TEST_CASE("nothing is pushed that nobody watches, and every sample that somebody does") {
  PushingOwner owner;
  for (int t = 1; t <= 100; ++t) REQUIRE(owner.forest.update("hand", along_x(t), ms(t)));
  REQUIRE(owner.pusher.watch(1, {{"hand"}}));
  // The newest, as those before were written for nobody.
  REQUIRE(eventually([&] { return owner.count(1) == 1; }));
  CHECK(owner.pushed[1].at(0) == ms(100));
  for (int t = 101; t <= 200; ++t) REQUIRE(owner.forest.update("hand", along_x(t), ms(t)));
  REQUIRE(owner.forest.update("arm", along_x(1), ms(1)));
  REQUIRE(eventually([&] { return owner.count(1) == 101; }));
  const auto stamps = owner.pushed[1];
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    CHECK(stamps[i] == ms(100 + static_cast<std::int64_t>(i)));
  }
  CHECK(owner.pushed.size() == 1);
  REQUIRE(owner.pusher.watch(2, {{"arm"}}));
  REQUIRE(eventually([&] { return owner.count(2) == 1; }));
  CHECK(owner.count(1) == 101);
}

TEST_CASE("a rate is kept, and the newest comes in the end") {
  PushingOwner owner;
  REQUIRE(owner.pusher.watch(1, {{"hand"}, {}, 50ms}));
  REQUIRE(eventually([&] { return owner.count(1) == 1; }));
  const auto start = std::chrono::steady_clock::now();
  std::int64_t t = 0;
  while (std::chrono::steady_clock::now() - start < 300ms) {
    REQUIRE(owner.forest.update("hand", along_x(1), ms(++t)));
    std::this_thread::sleep_for(1ms);
  }
  REQUIRE(eventually([&] {
    const std::lock_guard lock(owner.mutex);
    return owner.pushed[1].back() == ms(t);
  }));
  const auto over = std::chrono::steady_clock::now() - start;
  CHECK(owner.count(1) <= static_cast<std::size_t>(over / 50ms) + 3);
}

TEST_CASE("who asks for a frame that is not owned is refused, and costs nothing") {
  PushingOwner owner;
  CHECK(outcome(owner.pusher.watch(1, {{"nobody"}})) == "not_owner");
  REQUIRE(owner.forest.update("hand", along_x(1), ms(1)));
  REQUIRE(owner.pusher.watch(2, {{"hand"}}));
  REQUIRE(eventually([&] { return owner.count(2) == 1; }));
  CHECK(owner.count(1) == 0);
}

}  // namespace tfdude
