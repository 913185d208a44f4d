#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "support/catch.hpp"
#include "tree/forest.hpp"

// Readers of edges' correlation, while it is declared again, revised and dropped.
namespace tfdude {
namespace {

constexpr int kReaders = 3;
constexpr int kAnswers = 2000;  // each, or a reader has proved nothing
constexpr int kMostRounds = 2'000'000;

CommonError common_error(double size) {
  Loading loading = Loading::Zero(6, 1);
  loading(0, 0) = size;
  return {"s", false, loading};
}

// Both edges have the same size of the source, or are exact: along x the chain has twice of that,
// and never once.
struct Reader {
  std::string finding;
  std::atomic<int> answers{0};

  void run(const Forest& forest, const std::atomic<bool>& stop) {
    while (!stop.load(std::memory_order_acquire) && finding.empty()) {
      const auto parts =
          forest.lookup_segments({{"world", "a"}, {"a", "b"}}, {}, std::nullopt, true);
      if (!parts) {
        finding = parts.error().message;
        return;
      }
      const auto size = [&](std::size_t i) {
        const auto& common_errors = parts->correlations.at(i).common_errors;
        return common_errors.empty() ? 0.0 : common_errors.front().loading(0, 0);
      };
      if (size(0) != size(1)) finding = "the edges of one commit differ";
      const auto whole = forest.lookup("world", "b", Query{});
      if (!whole) {
        finding = whole.error().message;
        return;
      }
      const double twice = whole->covariance.of_specified().stddev()[0];
      if (std::abs(std::remainder(twice, 2.0)) > 1e-9) {
        finding = "a deviation of " + std::to_string(twice);
      }
      answers.fetch_add(1, std::memory_order_relaxed);
    }
  }
};

TEST_CASE("readers see the correlations of one commit") {
  Forest forest;
  REQUIRE(forest.add("world", "", {}));
  REQUIRE(forest.add("a", "world", {}));
  REQUIRE(forest.add("b", "a", {}));
  std::atomic<bool> stop{false};
  std::vector<Reader> readers(kReaders);
  std::vector<std::thread> threads;
  for (Reader& reader : readers) threads.emplace_back([&] { reader.run(forest, stop); });
  const auto done = [&] {
    for (const Reader& reader : readers) {
      if (!reader.finding.empty()) return true;
      if (reader.answers.load(std::memory_order_relaxed) < kAnswers) return false;
    }
    return true;
  };
  std::string failed;
  for (int round = 0; round < kMostRounds && !done() && failed.empty(); ++round) {
    const Correlation now{false, {common_error(round % 7)}, {"a", "b"}};
    const auto seen = forest.lookup_segments({{"world", "a"}}, {}, std::nullopt, true);
    const auto revised =
        forest.revise({{"a", {}, now}, {"b", {}, now}}, std::nullopt, seen->commit);
    if (!revised) failed = revised.error().message;
    // Forgets both.
    if (round % 3 != 0) continue;
    const auto updated = forest.update({EdgeUpdate{"a", {}}, EdgeUpdate{"b", {}}});
    if (!updated) failed = updated.error().message;
  }
  stop.store(true, std::memory_order_release);
  for (std::thread& thread : threads) thread.join();
  CHECK(failed.empty());
  for (const Reader& reader : readers) {
    CHECK(reader.finding.empty());
    CHECK(reader.answers.load() >= kAnswers);
  }
}

}  // namespace
}  // namespace tfdude
