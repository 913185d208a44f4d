#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

// Readers of history while it is written: ring buffers grow, wrap round, are copied for late
// samples, and go.
namespace tfdude {
namespace {

using testing::along_x;
using testing::outcome;
using testing::Random;

constexpr int kLinks = 4;
constexpr int kReaders = 3;
constexpr int kAnswers = 300;  // of each kind, or a reader has proved nothing
constexpr int kMostRounds = 2'000'000;

std::string link_id(int i) { return i == 0 ? "world" : "link " + std::to_string(i); }

// At stamp t every link is t metres long, so that the chain is kLinks · t at any instant.
struct Reader {
  std::string finding;
  std::atomic<int> newest{0};
  std::atomic<int> earlier{0};
  std::atomic<int> too_old{0};

  void take(const Result<StampedTransform>& X, std::atomic<int>& kind) {
    if (!X) {
      if (X.error().code == Errc::kTooOld) {
        too_old.fetch_add(1);
      } else if (finding.empty()) {
        finding = "lookup failed: " + X.error().message;
      }
      return;
    }
    const double expected = kLinks * static_cast<double>(nanoseconds(*X->stamp));
    const double x = X->pose.translation().x();
    if (std::abs(x - expected) > 1e-9 * expected && finding.empty()) {
      finding = "x is " + std::to_string(x) + ", not " + std::to_string(expected);
    }
    kind.fetch_add(1);
  }

  void run(const Forest& forest, const std::atomic<bool>& stop, std::uint64_t seed) {
    Random random(seed);
    const Handle a = forest.find(link_id(0)).value();
    const Handle b = forest.find(link_id(kLinks)).value();
    while (!stop.load(std::memory_order_acquire) && finding.empty()) {
      const auto found = forest.lookup(a, b, Query{});
      take(found, newest);
      if (!found) continue;
      Query then;
      then.at = *found->stamp - std::chrono::nanoseconds(random.index(400));
      take(forest.lookup(a, b, then), earlier);
      (void)forest.histories(link_id(1));
    }
  }

  bool done() const {
    return !finding.empty() || (newest > kAnswers && earlier > kAnswers && too_old > kAnswers);
  }
};

// At stamp t each link is t metres long, and all but the third have a variance of kVariance · t.
// Links 2 and 4 are slides; the latter's samples are in turn positions and poses.
constexpr double kVariance = 1e-3;

struct Slides {
  Slides() {
    REQUIRE(forest.add("world", "", along_x(0)));
    for (int i = 1; i <= kLinks; ++i) {
      REQUIRE(forest.add(link_id(i), link_id(i - 1), along_x(0)));
      handles.push_back(forest.find(link_id(i)).value());
    }
  }

  bool write(std::int64_t t) {
    const auto length = static_cast<double>(t);
    std::vector<CorrelatedUpdate> batch;
    for (int i = 1; i <= kLinks; ++i) {
      const double variance = i == 3 ? 0 : kVariance * length;
      CorrelatedUpdate one{handles[static_cast<std::size_t>(i - 1)],
                           joint_transform(slide, length, variance)};
      const bool position = i == 2 || (i == 4 && t % 40 == 0);
      if (position) one.state = {&slide, {length, variance}};
      batch.push_back(one);
    }
    return forest.update_correlated(batch, time_of(t)).has_value();
  }

  /// Empty if the answer is right.
  static std::string judge(const StampedTransform& X) {
    const auto t = static_cast<double>(nanoseconds(*X.stamp));
    const double x = X.pose.translation().x();
    const double variance = X.covariance.of_specified().upper()[0];
    const bool right = std::abs(x - kLinks * t) <= 1e-9 * kLinks * t &&
                       std::abs(variance - 3 * kVariance * t) <= 1e-9 * t;
    return right ? "" : "x is " + std::to_string(x) + ", its variance " + std::to_string(variance);
  }

  Joint slide = prismatic_joint(Transform::exact({}), {1, 0, 0});
  Forest forest;
  std::vector<Handle> handles;
};

}  // namespace

TEST_CASE("every answer is of one instant while buffers wrap around and late samples come") {
  Forest forest;
  REQUIRE(forest.add("world", "", along_x(0)));
  EdgeTiming timing;
  timing.count = 16;
  for (int i = 1; i <= kLinks; ++i) {
    REQUIRE(forest.add(link_id(i), link_id(i - 1), along_x(0)));
    REQUIRE(forest.set_timing(link_id(i), timing));
  }
  const auto write = [&](std::int64_t t) {
    std::vector<EdgeUpdate> batch;
    for (int i = 1; i <= kLinks; ++i)
      batch.push_back({link_id(i), along_x(static_cast<double>(t))});
    return forest.update(batch, time_of(t)).has_value();
  };
  std::int64_t t = 1000;
  REQUIRE(write(t));
  Reader readers[kReaders];
  std::atomic<bool> stop{false};
  std::vector<std::thread> threads;
  for (int i = 0; i < kReaders; ++i) {
    threads.emplace_back([&, i] { readers[i].run(forest, stop, 900U + static_cast<unsigned>(i)); });
  }
  const auto all_done = [&] {
    for (const Reader& reader : readers) {
      if (!reader.done()) return false;
    }
    return true;
  };
  int refused = 0;
  for (int round = 0; round < kMostRounds && (round < 2000 || !all_done()); ++round) {
    t += 20;
    refused += write(t) ? 0 : 1;
    if (round % 16 == 0) refused += write(t - 30) ? 0 : 1;
  }
  stop.store(true, std::memory_order_release);
  for (std::thread& thread : threads) thread.join();
  CHECK(refused == 0);
  for (const Reader& reader : readers) {
    CHECK(reader.finding.empty());
    CHECK(reader.newest > kAnswers);
    CHECK(reader.earlier > kAnswers);
    CHECK(reader.too_old > kAnswers);
  }
}

TEST_CASE("shared covariances and positions are right while the oldest samples are dropped") {
  Slides slides;
  slides.forest.limit_history(100'000);
  std::int64_t t = 10'000;
  REQUIRE(slides.write(t));
  std::atomic<bool> stop{false};
  std::atomic<int> answers{0};
  std::string findings[kReaders];
  std::vector<std::thread> threads;
  for (int i = 0; i < kReaders; ++i) {
    threads.emplace_back([&, i] {
      Random random(910U + static_cast<unsigned>(i));
      while (!stop.load() && findings[i].empty()) {
        const auto newest = slides.forest.lookup("world", link_id(kLinks), Query{});
        if (!newest) continue;
        Query then;
        then.at = *newest->stamp - std::chrono::nanoseconds(random.index(5000));
        const auto found = slides.forest.lookup("world", link_id(kLinks), then);
        findings[i] = Slides::judge(found ? *found : *newest);
        answers += found ? 1 : 0;
      }
    });
  }
  int refused = 0;
  for (int round = 0; round < kMostRounds && (round < 2000 || answers < 3 * kAnswers); ++round) {
    t += 20;
    refused += slides.write(t) ? 0 : 1;
    if (round % 16 == 0) refused += slides.write(t - 30) ? 0 : 1;
  }
  stop.store(true);
  for (std::thread& thread : threads) thread.join();
  CHECK(refused == 0);
  CHECK(answers >= 3 * kAnswers);
  for (const std::string& finding : findings) CHECK(finding.empty());
  CHECK(slides.forest.dropped_samples() > 0);
}

TEST_CASE("a history may be dropped while it is read") {
  Forest forest;
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("arm", "world", {}));
  std::atomic<bool> stop{false};
  std::atomic<int> answers{0};
  std::atomic<int> wrong{0};
  std::thread reader([&] {
    while (!stop.load()) {
      const auto X = forest.lookup("world", "arm", Query{});
      if (!X) continue;
      ++answers;
      const double x = X->pose.translation().x();
      if (X->stamp && x != static_cast<double>(nanoseconds(*X->stamp))) ++wrong;
    }
  });
  int failed = 0;
  for (int round = 0; round < kMostRounds && (round < 500 || answers < kAnswers); ++round) {
    for (int t = 1; t <= 40; ++t) failed += forest.update("arm", along_x(t), time_of(t)) ? 0 : 1;
    if (round % 2 == 0) {
      failed += forest.move("arm", "world") ? 0 : 1;
    } else {
      failed += forest.remove("arm") && forest.add("arm", "world", {}) ? 0 : 1;
    }
  }
  stop.store(true);
  reader.join();
  CHECK(failed == 0);
  CHECK(wrong == 0);
  CHECK(answers >= kAnswers);
}

}  // namespace tfdude
