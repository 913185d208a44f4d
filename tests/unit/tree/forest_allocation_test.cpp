#include <atomic>
#include <cstdint>
#include <memory>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "support/allocation_guard.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::AllocationGuard;
using testing::along_x;
using testing::Random;

constexpr int kDepth = 100;
// Past what fits into a std::string itself, so that a copy of an id would be seen.
std::string deep_id(int i) { return "a frame with quite a long id, number " + std::to_string(i); }

void plant_chain(Forest& forest) {
  Random random(700);
  REQUIRE(forest.add("world", "", Transform::exact({})));
  for (int i = 0; i < kDepth; ++i) {
    REQUIRE(forest.add(deep_id(i), i == 0 ? "world" : deep_id(i - 1), random.transform()));
  }
}

// Allocations of 1000 calls after as many to warm up; -1 if a call failed. Superseded versions and
// the lists of them find their size in the warm-up.
template <class Call>
std::int64_t allocations_of(const Call& call) {
  bool ok = true;
  for (int i = 0; i < 1000; ++i) ok = call() && ok;
  const AllocationGuard guard;
  for (int i = 0; i < 1000; ++i) ok = call() && ok;
  const auto count = static_cast<std::int64_t>(guard.allocations());
  return ok ? count : -1;
}

TEST_CASE("the guard counts the allocations of this thread in the test and in the library") {
  const AllocationGuard guard;
  CHECK(guard.allocations() == 0);
  const AllocationGuard fresh;
  void* memory = ::operator new(64);
  const auto after_new = fresh.allocations();
  const auto live_after_new = fresh.live_bytes();
  ::operator delete(memory);
  const auto live_after_delete = fresh.live_bytes();
  CHECK(after_new == 1);
  CHECK(live_after_new >= 64);
  CHECK(live_after_delete == 0);
  const AllocationGuard library;
  auto forest = std::make_unique<Forest>();
  const auto by_library = library.allocations();
  forest.reset();
  CHECK(by_library >= 2);  // the forest, and what it is made of
  const AllocationGuard here;
  std::thread([] { ::operator delete(::operator new(4096)); }).join();
  CHECK(here.live_bytes() < 4096);
}

TEST_CASE("lookups and queries of one frame do not allocate") {
  Forest forest;
  plant_chain(forest);
  const std::string top = deep_id(0);
  const std::string bottom = deep_id(kDepth - 1);
  const std::string absent = deep_id(kDepth);
  const Handle a = forest.find(top).value();
  const Handle b = forest.find(bottom).value();
  CHECK(allocations_of([&] { return forest.lookup(top, bottom).has_value(); }) == 0);
  CHECK(allocations_of([&] { return forest.lookup(bottom, top).has_value(); }) == 0);
  CHECK(allocations_of([&] { return forest.lookup(a, b).has_value(); }) == 0);
  CHECK(allocations_of([&] { return forest.lookup_pose(a, b).has_value(); }) == 0);
  CHECK(allocations_of([&] { return forest.holds(bottom) && !forest.holds(absent); }) == 0);
  CHECK(allocations_of([&] { return forest.find(bottom) && !forest.find(absent); }) == 0);
  CHECK(allocations_of([&] { return forest.exists(bottom) && !forest.exists(absent); }) == 0);
  CHECK(allocations_of([&] { return forest.value(bottom).has_value(); }) == 0);
  // Only the names of unspecified edges allocate.
  REQUIRE(forest.update(bottom, {Pose(), StatedCovariance::unspecified()}));
  CHECK(forest.lookup(a, b).value().basis.unspecified == std::vector<std::string>{bottom});
  CHECK(allocations_of([&] { return forest.lookup_pose(a, b).has_value(); }) == 0);
  // Errors carry a text: also a sign that the count is alive.
  CHECK(allocations_of([&] { return !forest.lookup(top, absent); }) > 0);
}

TEST_CASE("updates do not allocate") {
  Forest forest;
  plant_chain(forest);
  const Transform X_PC = Random(701).transform();
  const std::string id = deep_id(kDepth / 2);
  const Handle handle = forest.find(id).value();
  std::vector<EdgeUpdate> batch;
  std::vector<HandleUpdate> batch_by_handle;
  for (int i = 0; i < 100; ++i) {
    batch.push_back({deep_id(i), X_PC});
    batch_by_handle.push_back({forest.find(deep_id(i)).value(), X_PC});
  }
  CHECK(allocations_of([&] { return forest.update(id, X_PC).has_value(); }) == 0);
  CHECK(allocations_of([&] { return forest.update(handle, X_PC).has_value(); }) == 0);
  CHECK(allocations_of([&] { return forest.update(batch).has_value(); }) == 0);
  CHECK(allocations_of([&] { return forest.update(batch_by_handle).has_value(); }) == 0);
}

TEST_CASE("updates and lookups with a history do not allocate") {
  Forest forest;
  plant_chain(forest);
  Random random(703);
  std::vector<HandleUpdate> batch;
  EdgeTiming timing;
  timing.count = 64;
  for (int i = 0; i < 20; ++i) {
    REQUIRE(forest.set_timing(deep_id(i), timing));
    batch.push_back({forest.find(deep_id(i)).value(), random.transform()});
  }
  std::int64_t t = 1'000'000;
  CHECK(allocations_of([&] { return forest.update(batch, time_of(t += 1000)).has_value(); }) == 0);
  const Handle a = forest.find(deep_id(0)).value();
  const Handle b = forest.find(deep_id(kDepth - 1)).value();
  Query query;
  CHECK(allocations_of([&] { return forest.lookup(a, b, query).has_value(); }) == 0);
  query.at = time_of(t - 12'345);
  CHECK(allocations_of([&] { return forest.lookup(a, b, query).has_value(); }) == 0);
}

TEST_CASE(
    "samples with other covariances, of joints, and beyond the limit of memory do not allocate") {
  Forest forest;
  plant_chain(forest);
  Random random(704);
  forest.limit_history(100'000);
  const Joint joint = revolute_joint(random.transform(), {0, 0, 1});
  const Transform samples[] = {random.transform(), random.transform()};
  std::int64_t t = 1'000'000;
  std::vector<CorrelatedUpdate> batch(10);
  const auto update = [&] {
    t += 1000;
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const double position = 1e-6 * static_cast<double>(t);
      CorrelatedUpdate& one = batch[i];
      one.X_PC = i % 2 == 0 ? samples[(t / 1000) % 2] : joint_transform(joint, position, 0.1);
      if (i % 2 == 1) one.state = {&joint, {position, 0.1}};
    }
    return forest.update_correlated(batch, time_of(t)).has_value();
  };
  for (std::size_t i = 0; i < batch.size(); ++i) {
    batch[i].frame = forest.find(deep_id(static_cast<int>(i))).value();
  }
  CHECK(allocations_of(update) == 0);
  CHECK(forest.dropped_samples() > 0);
  const Handle a = forest.find(deep_id(0)).value();
  const Handle b = forest.find(deep_id(9)).value();
  Query query;
  query.at = time_of(t - 12'345);
  CHECK(allocations_of([&] { return forest.lookup(a, b, query).has_value(); }) == 0);
}

// ---- memory does not grow with history

constexpr int kCycles = 200'000;
constexpr std::int64_t kFewBytes = 256 * 1024;

// Adds and removes ever new ids; the bytes that live more after it than after a short warm-up.
std::int64_t growth_of_churn(Forest& forest) {
  const auto cycle = [&](int i) {
    const std::string id = "a passing frame with a long id, " + std::to_string(i);
    return forest.add(id, "world", Transform::exact({})) && forest.remove(id);
  };
  int refused = 0;
  for (int i = 0; i < 1000; ++i) refused += cycle(i) ? 0 : 1;
  const AllocationGuard guard;
  for (int i = 1000; i < kCycles; ++i) refused += cycle(i) ? 0 : 1;
  const std::int64_t growth = guard.live_bytes();
  CHECK(refused == 0);
  return growth;
}

TEST_CASE("ids that are added and removed leave no memory behind") {
  Forest forest;
  REQUIRE(forest.add("world", "", Transform::exact({})));
  CHECK(growth_of_churn(forest) < kFewBytes);
}

TEST_CASE("ids that are added and removed leave no memory behind while others read") {
  Forest forest;
  REQUIRE(forest.add("world", "", Transform::exact({})));
  std::atomic<bool> stop{false};
  std::atomic<int> wrong{0};
  std::thread reader([&] {
    while (!stop.load()) wrong += forest.lookup("world", "world") ? 0 : 1;
  });
  (void)growth_of_churn(forest);  // may be large: a reader that sleeps in a lookup holds back all
  stop.store(true);
  reader.join();
  CHECK(wrong.load() == 0);
  // The blocks grown meanwhile stay for use; a second churn needs no more of them.
  CHECK(growth_of_churn(forest) < kFewBytes);
}

TEST_CASE("updates reuse superseded versions") {
  Forest forest;
  plant_chain(forest);
  Random random(702);
  int refused = 0;
  const AllocationGuard guard;
  for (int i = 0; i < kCycles; ++i) {
    const std::string id = deep_id(static_cast<int>(random.index(kDepth)));
    refused += forest.update(id, along_x(i)) ? 0 : 1;
  }
  const std::int64_t growth = guard.live_bytes();
  CHECK(refused == 0);
  CHECK(growth < kFewBytes);
}

TEST_CASE("a forest releases all its memory") {
  const AllocationGuard guard;
  {
    Forest forest;
    plant_chain(forest);
    for (int i = 0; i < 500; ++i) {
      REQUIRE(forest.add(std::to_string(i), "world", Transform::exact({})));
      if (i % 3 != 0) REQUIRE(forest.remove(std::to_string(i)));
    }
    for (int i = 0; i < 30; ++i) {
      for (int t = 1; t < 300; ++t)
        REQUIRE(forest.update(deep_id(i), Transform::exact({}), time_of(10 * t)));
      REQUIRE(forest.update(deep_id(i), Transform::exact({}), time_of(15)));
    }
    REQUIRE(forest.move(deep_id(5), "world"));
    REQUIRE(forest.remove(deep_id(10)));
  }
  const std::int64_t left = guard.live_bytes();
  CHECK(left < 1024);  // the framework's own notes
}

}  // namespace
}  // namespace tfdude
