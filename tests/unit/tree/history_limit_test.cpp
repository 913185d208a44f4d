// The memory of all histories of a forest together.

#include <algorithm>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::Random;

std::string edge_id(std::size_t i) { return "edge " + std::to_string(i); }

struct Crowd {
  explicit Crowd(std::size_t count) {
    EdgeTiming timing;
    timing.span = std::chrono::hours(1);
    timing.count = 1'000'000;
    timing.restart_after = 0;
    REQUIRE(forest.set_default_timing(timing));
    REQUIRE(forest.add("base", "", {}));
    for (std::size_t i = 0; i < count; ++i) REQUIRE(forest.add(edge_id(i), "base", {}));
  }
  [[nodiscard]] HistoryInfo history(std::size_t i) const {
    return forest.histories(edge_id(i)).at(0);
  }
  void sample(std::size_t i, std::int64_t stamp) {
    REQUIRE(forest.update(edge_id(i), along_x(1), time_of(stamp)));
  }

  Forest forest;
};

}  // namespace

TEST_CASE("the oldest samples of all edges are dropped, and the two newest of each edge stay") {
  Random random(930);
  INFO("seed " << random.seed());
  constexpr std::size_t kEdges = 30;
  constexpr std::size_t kLimit = 200'000;
  constexpr std::size_t kShort = 10;
  Crowd crowd(kEdges + 1);
  // The more frames there are, the rarer the oldest samples are searched for.
  for (int i = 0; i < 2000; ++i) REQUIRE(crowd.forest.add("static " + std::to_string(i), "", {}));
  // Drops its oldest sample itself, so its samples are always the newest ones.
  EdgeTiming few;
  few.count = kShort;
  REQUIRE(crowd.forest.set_timing(edge_id(kEdges), few));
  int warned = 0;
  crowd.forest.limit_history(kLimit, [&] { ++warned; });
  std::int64_t now = 1000;
  std::uint64_t taken = 0;
  for (int i = 0; i < 20'000; ++i) {
    crowd.sample(kEdges, ++now);
    // A few are sampled often, most rarely, and some no more.
    const std::size_t edge = random.index(3) > 0 ? random.index(5) : random.index(kEdges);
    const std::size_t sampled = i > 10'000 && edge > 20 ? 0 : edge;
    now += 1 + static_cast<std::int64_t>(random.index(50));
    // Every other one has its own covariance.
    const Covariance covariance = *Covariance::from_stddev({sampled % 2 == 0 ? 1.0 : 1.0 * i});
    REQUIRE(crowd.forest.update(edge_id(sampled), {Pose(), covariance}, time_of(now)));
    ++taken;
    if (taken > kShort) REQUIRE(crowd.history(kEdges).samples == kShort);
    if (i % 500 != 0 || warned == 0) continue;
    std::vector<std::int64_t> oldest;
    std::size_t bytes = 0;
    std::size_t samples = 0;
    for (std::size_t k = 0; k < kEdges; ++k) {
      const HistoryInfo history = crowd.history(k);
      samples += history.samples;
      bytes += history.bytes;
      if (history.samples > 2) oldest.push_back(nanoseconds(*history.oldest));
      if (history.samples <= 2) REQUIRE((history.samples == 2 || !history.newest));
    }
    // Samples are dropped up to eight at a time.
    const std::int64_t kept_from = *std::max_element(oldest.begin(), oldest.end());
    const auto older = [&](std::int64_t stamp) { return stamp < kept_from - 40'000; };
    REQUIRE(std::count_if(oldest.begin(), oldest.end(), older) == 0);
    REQUIRE(bytes < kLimit + kEdges * 1000);
    REQUIRE(bytes > kLimit - 5000);
    REQUIRE(samples + crowd.forest.dropped_samples() == taken);
  }
  CHECK(warned == 1);
  CHECK(crowd.forest.dropped_samples() > 10'000);
}

TEST_CASE("a limit that cannot be kept refuses no sample") {
  Crowd crowd(20);
  crowd.forest.limit_history(1000);
  for (std::int64_t t = 1; t <= 100; ++t) {
    for (std::size_t i = 0; i < 20; ++i) crowd.sample(i, 1000 * t + static_cast<std::int64_t>(i));
  }
  for (std::size_t i = 0; i < 20; ++i) {
    CHECK(crowd.history(i).samples >= 2);
    CHECK(crowd.history(i).samples <= 9);
  }
}

TEST_CASE("edges that leave or lose their history make room") {
  Crowd crowd(4);
  crowd.forest.limit_history(50'000);
  std::int64_t now = 0;
  for (int i = 0; i < 1000; ++i) {
    crowd.sample(0, ++now);
    crowd.sample(1, now);
  }
  const std::uint64_t dropped = crowd.forest.dropped_samples();
  CHECK(dropped > 0);
  REQUIRE(crowd.forest.remove(edge_id(0)));
  REQUIRE(crowd.forest.move(edge_id(1), edge_id(2)));
  for (int i = 0; i < 400; ++i) crowd.sample(3, ++now);
  CHECK(crowd.forest.dropped_samples() == dropped);
  CHECK(crowd.history(3).samples == 400);
  for (int i = 0; i < 400; ++i) crowd.sample(1, ++now);
  CHECK(crowd.forest.dropped_samples() > dropped);
  CHECK(crowd.history(3).samples < 400);
}

}  // namespace tfdude
