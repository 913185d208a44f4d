#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::outcome;
using testing::Random;
using testing::x_of;

constexpr int kLinks = 12;
constexpr int kReaders = 3;
// A reader that saw fewer states than this proves nothing; a run that cannot show them fails.
constexpr int kStates = 200;
constexpr int kMostRounds = 3'000'000;

std::string link_id(int i) { return i == 0 ? "world" : "link " + std::to_string(i); }

// Says `k` in every part: k metres along x, k² along z, a variance of k m².
Transform saying(int k) {
  Covariance::Upper upper{};
  upper[upper_index(0, 0)] = k;
  return {Pose::trusted(Eigen::Quaterniond::Identity(), {1.0 * k, 0, 1.0 * k * k}),
          Covariance::trusted(upper)};
}

// The k that all `edges` edges of a path say; -1 if they do not say the same. By Cauchy and Schwarz
// the sum of squares tells: edges · Σk² = (Σk)² only where all k are equal. All numbers are exact
// in a double.
int one_saying(const Transform& X, int edges) {
  const Eigen::Vector3d sum = X.pose.translation();
  const bool one = edges * sum.z() == sum.x() * sum.x() &&
                   X.covariance.of_specified().upper()[upper_index(0, 0)] == std::abs(sum.x());
  const double k = sum.x() / edges;
  return one && k == std::floor(k) ? static_cast<int>(k) : -1;
}

// What a thread found wrong first; Catch's macros are for the main thread only.
struct Finding {
  std::string text;
  void note(const std::string& what) {
    if (text.empty()) text = what;
  }
};

void plant_chain(Forest& forest) {
  REQUIRE(forest.add("world", "", along_x(0)));
  for (int i = 1; i <= kLinks; ++i) REQUIRE(forest.add(link_id(i), link_id(i - 1), saying(1)));
}

struct ChainReader {
  Finding finding;
  std::atomic<int> states{0};
  int last = 0;

  // Commits are seen in their order, so k never falls.
  void take(const Result<StampedTransform>& X, int edges) {
    const int k = X ? one_saying(*X, edges) : -1;
    if (!X) {
      finding.note("lookup failed: " + outcome(X));
    } else if (k < 0) {
      finding.note("part of an update: x " + std::to_string(x_of(X)));
    } else if (k < last) {
      finding.note("went back from " + std::to_string(last) + " to " + std::to_string(k));
    } else if (k > last) {
      last = k;
      states.fetch_add(1, std::memory_order_relaxed);
    }
  }

  void run(const Forest& forest, const std::atomic<bool>& stop, std::uint64_t seed) {
    Random random(seed);
    std::vector<Handle> handles;
    for (int i = 0; i <= kLinks; ++i) handles.push_back(forest.find(link_id(i)).value());
    while (!stop.load(std::memory_order_acquire)) {
      take(forest.lookup(link_id(0), link_id(kLinks)), kLinks);
      take(forest.lookup(handles.front(), handles.back()), kLinks);
      const auto top = random.index(kLinks);
      const auto bottom = top + 1 + random.index(kLinks - top);
      take(forest.lookup(handles[top], handles[bottom]), static_cast<int>(bottom - top));
      if (!finding.text.empty()) return;
    }
  }
};

bool all_saw(const ChainReader* readers) {
  for (int i = 0; i < kReaders; ++i) {
    if (!readers[i].finding.text.empty()) return true;  // no need to go on
    if (readers[i].states.load(std::memory_order_relaxed) < kStates) return false;
  }
  return true;
}

TEST_CASE("a reader never sees a part of a batch") {
  Forest forest;
  plant_chain(forest);
  ChainReader readers[kReaders];
  std::atomic<bool> stop{false};
  std::vector<std::thread> threads;
  for (int i = 0; i < kReaders; ++i) {
    threads.emplace_back([&, i] { readers[i].run(forest, stop, 500U + static_cast<unsigned>(i)); });
  }
  int refused = 0;
  int k = 1;
  while (k < kMostRounds && (k < 2000 || !all_saw(readers))) {
    ++k;
    std::vector<EdgeUpdate> edges;
    for (int i = 1; i <= kLinks; ++i) edges.push_back({link_id(i), saying(k)});
    // In either direction, so that a reader that climbs meets the writer or runs after it.
    if (k % 2 == 0) std::reverse(edges.begin(), edges.end());
    refused += forest.update(edges) ? 0 : 1;
  }
  stop.store(true, std::memory_order_release);
  for (std::thread& thread : threads) thread.join();
  CHECK(refused == 0);
  for (const ChainReader& reader : readers) {
    CHECK(reader.finding.text == "");
    CHECK(reader.states.load() >= kStates);
  }
}

// ---- structure that changes under the readers

// world +- left, right: a tool hangs on one of them, always 5000 m from the world
//       +- leaf <n>: n metres from the world, with a child that comes after it and goes with it
constexpr int kLeaves = 8;

std::string leaf_id(int n) { return "leaf " + std::to_string(n); }

// One thread adds new leaves and removes old ones, so that slots and names are reused at once.
void churn_leaves(Forest& forest, std::atomic<int>& newest, const std::function<bool(int)>& go_on,
                  Finding& finding) {
  for (int n = 1; go_on(n); ++n) {
    const std::string id = leaf_id(n);
    if (!forest.add(id, "world", along_x(n))) finding.note("add refused");
    if (!forest.add(id + " child", id, along_x(n))) finding.note("add of a child refused");
    newest.store(n, std::memory_order_release);
    if (n <= kLeaves) continue;
    const auto removed = forest.remove(leaf_id(n - kLeaves));
    if (!removed || removed->size() != 2) finding.note("remove left something");
  }
}

// Another moves a subtree back and forth. The value fits only the new parent: a reader that takes
// one with the other's gets 4000 or 6000.
void churn_tool(Forest& forest, const std::atomic<bool>& stop, Finding& finding) {
  for (int i = 0; !stop.load(std::memory_order_acquire); ++i) {
    const bool right = i % 2 == 0;
    if (!forest.move("tool", right ? "right" : "left", along_x(right ? 3000 : 4000))) {
      finding.note("move refused");
    }
  }
}

struct StructureReader {
  Finding finding;
  std::atomic<int> leaves{0};    // looked up while they were there
  std::atomic<int> too_late{0};  // handles whose frame had gone
  std::atomic<int> moves{0};     // times the tool was found at another place
  std::string tool_parent;

  void run(const Forest& forest, const std::atomic<bool>& stop, const std::atomic<int>& newest,
           std::uint64_t seed) {
    Random random(seed);
    const Handle world = forest.find("world").value();
    std::vector<std::pair<int, Handle>> kept(32, {0, Handle{}});
    while (!stop.load(std::memory_order_acquire) && finding.text.empty()) {
      const int n =
          newest.load(std::memory_order_acquire) - static_cast<int>(random.index(kLeaves));
      read_leaf(forest, world, n, kept[random.index(kept.size())]);
      read_tool(forest);
      if (random.index(16) == 0) read_all(forest);
    }
  }

  // The id tells where the leaf is: an answer from another frame in its slot would be off.
  void read_leaf(const Forest& forest, Handle world, int n, std::pair<int, Handle>& kept) {
    const auto by_id = forest.lookup("world", leaf_id(n));
    if (by_id ? x_of(by_id) != n : outcome(by_id) != "unknown_end") {
      finding.note("leaf " + std::to_string(n) + ": " + outcome(by_id));
    }
    const auto by_handle = forest.lookup(world, kept.second);
    if (by_handle ? x_of(by_handle) != kept.first : outcome(by_handle) != "unknown_end") {
      finding.note("handle of leaf " + std::to_string(kept.first) + ": " + outcome(by_handle));
    }
    (by_handle ? leaves : too_late).fetch_add(1, std::memory_order_relaxed);
    const auto info = forest.info(leaf_id(n) + " child");
    if (info && (info->parent != leaf_id(n) || !info->attached)) finding.note("child without leaf");
    // Handles are kept for a while, so that many are used after their frame was removed.
    if (by_handle && n % 2 == 0) return;
    if (const auto handle = forest.find(leaf_id(n))) kept = {n, *handle};
  }

  void read_tool(const Forest& forest) {
    const auto X = forest.lookup("world", "tip");
    if (x_of(X) != 5007) finding.note("tool at " + std::to_string(x_of(X)) + ", " + outcome(X));
    const auto info = forest.info("tool");
    if (!info || !info->attached) return finding.note("the tool is not attached");
    if (info->parent == tool_parent) return;
    tool_parent = info->parent;
    moves.fetch_add(1, std::memory_order_relaxed);
  }

  // One commit never shows a child without its parent, nor an id twice.
  void read_all(const Forest& forest) {
    const auto frames = forest.frames();
    const auto ids = testing::sorted(testing::ids_of(frames));
    if (std::adjacent_find(ids.begin(), ids.end()) != ids.end()) finding.note("an id twice");
    if (frames.size() < 5 || frames.size() > 5 + 2 * (kLeaves + 1)) finding.note("wrong count");
    for (const FrameInfo& frame : frames) {
      if (!frame.attached && frame.id != "world") finding.note(frame.id + " is not attached");
    }
    if (forest.roots() != std::vector<std::string>{"world"}) finding.note("more than one root");
    const auto children = forest.children("world");
    if (!children || children->size() < 2) finding.note("children of the world are missing");
    if (forest.subtree("tool").size() != 2) finding.note("the tool lost its tip");
    if (!forest.holds("world") || forest.exists("never")) finding.note("holds or exists");
  }

  [[nodiscard]] bool saw_enough() const {
    return !finding.text.empty() ||
           (leaves.load() >= kStates && too_late.load() >= kStates && moves.load() >= kStates / 4);
  }
};

void plant_churned(Forest& forest) {
  REQUIRE(forest.add("world", "", along_x(0)));
  REQUIRE(forest.add("left", "world", along_x(1000)));
  REQUIRE(forest.add("right", "world", along_x(2000)));
  REQUIRE(forest.add("tool", "left", along_x(4000)));
  REQUIRE(forest.add("tip", "tool", along_x(7)));
}

TEST_CASE("readers see consistent structures while frames are added and removed and moved") {
  Forest forest;
  plant_churned(forest);
  StructureReader readers[kReaders];
  Finding writers[2];
  std::atomic<bool> stop{false};
  std::atomic<int> newest{0};
  std::vector<std::thread> threads;
  threads.emplace_back([&] { churn_tool(forest, stop, writers[1]); });
  for (int i = 0; i < kReaders; ++i) {
    threads.emplace_back(
        [&, i] { readers[i].run(forest, stop, newest, 600U + static_cast<unsigned>(i)); });
  }
  const auto go_on = [&](int n) {
    if (n >= kMostRounds) return false;
    if (n < 2000) return true;
    for (const StructureReader& reader : readers) {
      if (!reader.saw_enough()) return true;
    }
    return false;
  };
  churn_leaves(forest, newest, go_on, writers[0]);
  stop.store(true, std::memory_order_release);
  for (std::thread& thread : threads) thread.join();
  CHECK(writers[0].text == "");
  CHECK(writers[1].text == "");
  for (const StructureReader& reader : readers) {
    CHECK(reader.finding.text == "");
    CHECK(reader.leaves.load() >= kStates);
    CHECK(reader.too_late.load() >= kStates);
    CHECK(reader.moves.load() >= kStates / 4);
  }
}

TEST_CASE("short-lived threads can read and write") {
  // Each thread takes the place of an earlier one among the readers.
  constexpr int kRounds = 200;
  Forest forest;
  plant_chain(forest);
  std::atomic<int> wrong{0};
  for (int round = 1; round <= kRounds; ++round) {
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t) {
      threads.emplace_back([&, t] {
        const std::string id = "own " + std::to_string(t);
        wrong += forest.add(id, link_id(kLinks), along_x(round)) ? 0 : 1;
        wrong += x_of(forest.lookup(link_id(kLinks), id)) == round ? 0 : 1;
        wrong += forest.update(id, along_x(-round)) ? 0 : 1;
        wrong += x_of(forest.lookup(link_id(kLinks), id)) == -round ? 0 : 1;
        wrong += forest.remove(id) ? 0 : 1;
        wrong += forest.exists(id) ? 1 : 0;
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
  CHECK(wrong.load() == 0);
  CHECK(forest.frames().size() == kLinks + 1);
}

}  // namespace
}  // namespace tfdude
