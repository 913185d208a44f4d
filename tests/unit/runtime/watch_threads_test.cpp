// Readers of a watched path always see one of its legal transforms while it changes.

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/transport/loopback.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::eventually;

// A translation by `x` with that variance.
Transform uncertain(double x, double variance) {
  Transform X = along_x(x);
  X.covariance = Covariance::from_stddev({std::sqrt(variance), 0, 0, 0, 0, 0}).value();
  return X;
}

// Reads a path until it is destroyed, and keeps the first error.
class Reader {
 public:
  using Judge = std::function<std::string(const StampedTransform&)>;

  Reader(PathWatch path, Judge judge)
      : path_(std::move(path)), judge_(std::move(judge)), thread_([this] { run(); }) {}
  ~Reader() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  // @return what was wrong
  std::string end() {
    stop_ = true;
    thread_.join();
    return wrong_;
  }
  std::uint64_t reads() const { return reads_; }
  // Waits for some more reads.
  void await_reads() const {
    const std::uint64_t before = reads_;
    REQUIRE(eventually([&] { return reads_ > before + 10 || ended_; }));
  }

 private:
  void run() {
    while (!stop_ && wrong_.empty()) {
      const auto found = path_.latest();
      wrong_ = found ? judge_(*found) : "a read failed: " + found.error().message;
      ++reads_;
    }
    ended_ = true;
  }

  const PathWatch path_;
  const Judge judge_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> reads_{0};
  std::atomic<bool> ended_{false};
  std::string wrong_;
  std::thread thread_;
};

// world -> left, right of "base"; tool, below one of them, of "tool".
struct Robot {
  Robot() {
    base.emplace(*Node::open(network.join(), "base",
                             {{"world", "", {}},
                              {"left", "world", uncertain(10'000, 1)},
                              {"right", "world", uncertain(20'000, 2)},
                              {"arm", "left", {}},
                              {"hand", "arm", {}}}));
    open_tool(0);
    client.emplace(*Client::open(network.join()));
  }
  void open_tool(double x) {
    tool.emplace(*Node::open(network.join(), "tool", {{"tool", "left", uncertain(x, 10 + x)}}));
  }

  LoopbackNetwork network;
  std::optional<Node> base;
  std::optional<Node> tool;
  std::optional<Client> client;
};

// Even steps are below the left frame, odd ones below the right. Step k has x = k and the variance
// 10 + k.
std::string judge_step(const StampedTransform& X, double& last) {
  const double x = X.pose.translation().x();
  const bool left = x < 15'000;
  const double k = x - (left ? 10'000 : 20'000);
  const std::string what = "x " + std::to_string(x) + " with variance " +
                           std::to_string(X.covariance.of_specified().matrix()(0, 0));
  if (k != std::floor(k) || (static_cast<std::int64_t>(k) % 2 == 0) != left) return what;
  if (std::abs(X.covariance.of_specified().matrix()(0, 0) - (left ? 1 : 2) - (10 + k)) > 1e-9)
    return what;
  if (k < last) return what + ", after " + std::to_string(last);
  last = k;
  return "";
}

}  // namespace

TEST_CASE("watch: a rerouted path always reads a transform that existed and never goes back") {
  const bool composed = GENERATE(false, true);
  Robot robot;
  WatchOptions options;
  options.composed = composed;
  const auto path = robot.client->watch("world", "tool", options);
  REQUIRE(path);
  std::vector<double> last(2, -1);
  Reader one(*path, [&](const StampedTransform& X) { return judge_step(X, last[0]); });
  Reader two(*path, [&](const StampedTransform& X) { return judge_step(X, last[1]); });
  double k = 0;
  for (int move = 1; move <= 200; ++move) {
    ++k;
    REQUIRE(robot.client->move("tool", move % 2 == 0 ? "left" : "right", uncertain(k, 10 + k)));
    if (move % 3 == 0) one.await_reads();
    k += 2;
    REQUIRE(robot.tool->update("tool", uncertain(k, 10 + k)));
    // Most steps do not wait until the path has the value.
    if (move % 10 == 0) {
      REQUIRE(eventually(
          [&] { return path->latest()->covariance.of_specified().matrix()(0, 0) > 10 + k; }));
    }
  }
  CHECK(one.end() == "");
  CHECK(two.end() == "");
}

TEST_CASE("watch: a path stays readable while an owner restarts") {
  Robot robot;
  const auto path = robot.client->watch("world", "tool");
  REQUIRE(path);
  double last = -1;
  Reader reader(*path, [&](const StampedTransform& X) { return judge_step(X, last); });
  for (int i = 1; i <= 20; ++i) {
    reader.await_reads();
    robot.tool.reset();
    reader.await_reads();
    robot.open_tool(2 * i);
    REQUIRE(eventually([&] { return path->latest()->pose.translation().x() == 10'000 + 2 * i; }));
  }
  CHECK(reader.end() == "");
}

TEST_CASE("watch: a path stays readable while the first sample of an edge is ahead of the others") {
  Robot robot;
  const auto move_left = [&](std::int64_t k) {
    return robot.base->update("left", along_x(static_cast<double>(k)), Time(k * 10ms));
  };
  REQUIRE(robot.tool->update("tool", along_x(1000)));
  REQUIRE(move_left(50));
  const auto path = robot.client->watch("world", "tool");
  REQUIRE(path);
  REQUIRE(eventually([&] { return path->latest()->stamp == Time(500ms); }));
  Time last{};
  Reader reader(*path, [&](const StampedTransform& X) -> std::string {
    if (!X.stamp) return "no stamp";
    const double x = X.pose.translation().x();
    const double expected = std::chrono::duration<double>(X.stamp->time_since_epoch()) / 10ms +
                            (*X.stamp < Time(1s) ? 1000 : 2000);
    const std::string what = std::to_string(x) + " at " + to_string(*X.stamp);
    if (std::abs(x - expected) > 1e-9) return what + ", not " + std::to_string(expected);
    if (*X.stamp < last) return what + ", after " + to_string(last);
    last = *X.stamp;
    return "";
  });
  REQUIRE(robot.tool->update("tool", along_x(2000), Time(1s)));
  const auto heard = [&](std::uint64_t before) {
    return eventually([&] { return path->messages() > before; });
  };
  for (const std::int64_t k : {60, 70, 110, 111}) {
    reader.await_reads();
    const std::uint64_t before = path->messages();
    REQUIRE(move_left(k));
    REQUIRE(heard(before));
    reader.await_reads();
  }
  CHECK(eventually([&] { return path->latest()->stamp == Time(1s); }));
  REQUIRE(robot.tool->update("tool", along_x(2000), Time(1100ms)));
  CHECK(eventually([&] { return path->latest()->stamp == Time(1100ms); }));
  CHECK(reader.end() == "");
}

TEST_CASE("watch: a path stays readable while its new route has no common instant") {
  Robot robot;
  REQUIRE(robot.tool->add("gripper", "tool", {}));
  REQUIRE(robot.tool->update("gripper", along_x(1), Time(1s)));
  REQUIRE(robot.base->update("left", along_x(10), Time(1s)));
  REQUIRE(robot.base->update("right", along_x(20), Time(5s)));
  std::atomic<bool> rerouted{false};
  WatchOptions options;
  options.on_route = [&](const std::string&) { rerouted = true; };
  REQUIRE(eventually([&] { return robot.client->exists("gripper"); }));
  const auto path = robot.client->watch("world", "gripper", options);
  REQUIRE(path);
  Reader reader(*path, [&](const StampedTransform& X) -> std::string {
    // The last sample of the tool may come before that of the base: then they have 5 s in common.
    const double x = X.pose.translation().x();
    const bool legal = (x == 11 && X.stamp == Time(1s)) || (x == 21 && X.stamp == Time(5s)) ||
                       (x == 22 && X.stamp == Time(6s));
    return legal ? "" : std::to_string(x);
  });
  REQUIRE(robot.client->move("tool", "right"));
  REQUIRE(eventually([&] { return rerouted.load(); }));
  reader.await_reads();
  CHECK(path->latest()->pose.translation().x() == 11);
  Query then;
  then.at = Time(1s);
  CHECK(testing::outcome(path->lookup(then)) == "too_old");
  REQUIRE(robot.base->update("right", along_x(21), Time(6s)));
  REQUIRE(robot.tool->update("gripper", along_x(1), Time(6s)));
  CHECK(eventually([&] { return path->latest()->pose.translation().x() == 22; }));
  CHECK(reader.end() == "");
}

TEST_CASE("watch: edges that are updated in one call are read in one commit") {
  Robot robot;
  const auto path = robot.client->watch("left", "hand");
  REQUIRE(path);
  const auto in_one_piece = [](const StampedTransform& X) -> std::string {
    return X.pose.translation().x() == 0 ? "" : std::to_string(X.pose.translation().x());
  };
  Reader reader(*path, in_one_piece);
  int step = 0;
  const auto start = std::chrono::steady_clock::now();
  // Longer than the period of a renewal.
  while (std::chrono::steady_clock::now() - start < 1500ms) {
    ++step;
    REQUIRE(robot.base->update({{"arm", along_x(step)}, {"hand", along_x(-step)}}));
  }
  CHECK(step > 1000);
  CHECK(reader.end() == "");
}

TEST_CASE("watch: renewals never bring an older value and a late value arrives at once") {
  Robot robot;
  std::atomic<bool> stop{false};
  std::atomic<int> step{0};
  std::thread writer([&] {
    while (!stop) {
      const int k = step + 2;
      (void)robot.tool->update("tool", uncertain(k, 10 + k));
      step = k;
    }
  });
  for (int i = 0; i < 20; ++i) {
    const auto path = robot.client->watch("world", "tool");
    REQUIRE(path);
    double last = -1;
    Reader reader(*path, [&](const StampedTransform& X) -> std::string {
      const double k = X.pose.translation().x() - 10'000;
      const double variance = X.covariance.of_specified().matrix()(0, 0);
      if (k < last || std::abs(variance - (11 + k)) > 1e-9 * variance) {
        return std::to_string(k) + " with variance " + std::to_string(variance) + ", after " +
               std::to_string(last);
      }
      last = k;
      return "";
    });
    if (i == 0) std::this_thread::sleep_for(1500ms);  // beyond a renewal
    reader.await_reads();
    stop = i % 2 == 1;
    if (stop) {
      writer.join();
      const auto set = std::chrono::steady_clock::now();
      const double x = 10'000 + step;
      REQUIRE(eventually([&] { return path->latest()->pose.translation().x() == x; }));
      CHECK(std::chrono::steady_clock::now() - set < 500ms);
      stop = false;
      writer = std::thread([&] {
        while (!stop) {
          const int k = step + 2;
          (void)robot.tool->update("tool", uncertain(k, 10 + k));
          step = k;
        }
      });
    }
    CHECK(reader.end() == "");
  }
  stop = true;
  writer.join();
}

TEST_CASE("watch: a route callback may watch and look up and end its watch") {
  Robot robot;
  std::mutex mutex;
  std::vector<std::string> outcomes;
  std::optional<PathWatch> path;
  WatchOptions options;
  options.on_route = [&](const std::string&) {
    const auto watched = robot.client->watch("world", "left");
    const auto found = robot.client->lookup("world", "tool");
    const std::lock_guard lock(mutex);
    outcomes.push_back(testing::outcome(watched) + " " + testing::outcome(found));
    path.reset();
  };
  {
    const std::lock_guard lock(mutex);
    path = *robot.client->watch("world", "tool", options);
  }
  REQUIRE(robot.client->move("tool", "right"));
  REQUIRE(eventually([&] {
    const std::lock_guard lock(mutex);
    return outcomes.size() == 1;
  }));
  CHECK(outcomes.at(0) == "ok ok");
}

TEST_CASE("watch: no route callback runs after the client has ended") {
  Robot robot;
  std::atomic<int> told{0};
  std::atomic<bool> ended{false};
  WatchOptions options;
  options.on_route = [&](const std::string&) {
    ++told;
    robot.client.reset();
    ended = true;
  };
  const auto path = robot.client->watch("world", "tool", options);
  REQUIRE(path);
  auto mover = *Client::open(robot.network.join());
  for (const char* side : {"right", "left", "right"}) REQUIRE(mover.move("tool", side));
  REQUIRE(eventually([&] { return ended.load(); }));
  for (const char* side : {"left", "right"}) REQUIRE(mover.move("tool", side));
  CHECK(told == 1);
  CHECK(testing::outcome(path->latest()) == "transport");
}

}  // namespace tfdude
