// Time over partitions, over each transport: one instant for all owners, waiting for data, and
// pushed paths.

#include <atomic>
#include <chrono>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::Approx;
using testing::Join;
using testing::joined_by;
using testing::outcome;
using testing::Random;

Time wall_clock() {
  return std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
}

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

// world -> base -> arm -> hand -> tool, of three partitions and a client without frames.
struct Chain {
  explicit Chain(const Join& join) {
    base.emplace(
        Node::open(join("base"), "base", {{"world", "", {}}, {"base", "world", {}}}).value());
    arm.emplace(Node::open(join("arm"), "arm", {{"arm", "base", {}}, {"hand", "arm", {}}}).value());
    tool.emplace(Node::open(join("tool"), "tool", {{"tool", "hand", along_x(5)}}).value());
    client.emplace(Client::open(join("")).value());
  }
  std::optional<Node> base;
  std::optional<Node> arm;
  std::optional<Node> tool;
  std::optional<Client> client;
};

Query at(Time t) { return {t, 0ns, {}}; }
Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

// Each edge has its own twist, from the start of the test on: interpolation is exact for it.
class Motion {
 public:
  Motion(std::uint64_t seed, Time start) : random_(seed), start_(start) {
    for (const char* id : {"base", "arm", "hand", "tool"}) {
      edges_.push_back({id, random_.pose(), random_.twist(2.0, 3.0)});
    }
  }
  std::uint64_t seed() const { return random_.seed(); }
  Random& random() { return random_; }
  Pose edge(std::size_t i, Time t) const {
    return edges_[i].X * exp(std::chrono::duration<double>(t - start_).count() * edges_[i].twist);
  }
  const char* id(std::size_t i) const { return edges_[i].id; }
  // world to tool
  Pose whole(Time t) const { return edge(0, t) * edge(1, t) * edge(2, t) * edge(3, t); }

 private:
  struct Edge {
    const char* id;
    Pose X;
    Twist twist;
  };
  Random random_;
  Time start_;
  std::vector<Edge> edges_;
};

// A source of samples at 1 kHz, each published late by up to three of them.
class Source {
 public:
  Source(Node& node, const Motion& motion, std::vector<std::size_t> edges, std::uint64_t seed)
      : thread_([this, &node, &motion, edges = std::move(edges), seed] {
          Random random(seed);
          while (!stop_) {
            const Time stamp = wall_clock();
            std::this_thread::sleep_for(std::chrono::microseconds(random.index(3000)));
            std::vector<EdgeUpdate> batch;
            for (const std::size_t i : edges) {
              batch.push_back({motion.id(i), {motion.edge(i, stamp), {}}});
            }
            if (!node.update(batch, stamp)) ++failed_;
            std::this_thread::sleep_until(
                std::chrono::time_point_cast<std::chrono::system_clock::duration>(stamp + 1ms));
          }
        }) {}
  ~Source() {
    stop_ = true;
    thread_.join();
  }
  int failed() const { return failed_; }

 private:
  std::atomic<bool> stop_{false};
  std::atomic<int> failed_{0};
  std::thread thread_;
};

}  // namespace

TEST_CASE("an owner reports that a history was restarted") {
  Chain chain(joined_by(GENERATE(from_range(testing::networks()))));
  std::mutex mutex;
  std::vector<Change> heard;
  const Subscription subscription = chain.arm->on_change([&](const Change& change) {
    const std::lock_guard lock(mutex);
    if (change.kind == ChangeKind::kHistoryRestarted) heard.push_back(change);
  });
  REQUIRE(outcome(chain.client->update("hand", along_x(1), ms(1'000'000))) == "ok");
  for (int i = 1; i <= 4; ++i) {
    CHECK(outcome(chain.client->update("hand", along_x(2), ms(i))) == "too_old");
  }
  REQUIRE(outcome(chain.client->update("hand", along_x(2), ms(5))) == "ok");
  REQUIRE(testing::eventually([&] {
    const std::lock_guard lock(mutex);
    return !heard.empty();
  }));
  const std::lock_guard lock(mutex);
  REQUIRE(heard.size() == 1);
  CHECK(heard[0].frame == "hand");
  CHECK(heard[0].partition == "arm");
}

TEST_CASE("a negative stamp is rejected whoever owns the edge, and zero is the first") {
  Chain chain(joined_by(GENERATE(from_range(testing::networks()))));
  REQUIRE(outcome(chain.arm->update("hand", along_x(1), ms(1000))) == "ok");
  const Time stamp = GENERATE(ms(-1), Time::min());
  for (Client* caller : {&*chain.client, static_cast<Client*>(&*chain.arm)}) {
    CHECK(outcome(caller->update("hand", along_x(2), stamp)) == "invalid_input");
    CHECK(outcome(caller->publish({{"hand", along_x(2)}}, stamp)) == "invalid_input");
    CHECK(outcome(caller->update_joints({"nobody"}, {0}, {0}, stamp)) != "ok");
    auto stream = caller->stream({"hand"});
    REQUIRE(stream);
    REQUIRE(stream->try_publish({along_x(2)}, stamp).size() == 1);
    CHECK(stream->try_publish({along_x(2)}, stamp)[0].why == Errc::kInvalidInput);
    // As the instant of a lookup it is before all samples, not the newest one.
    CHECK(outcome(caller->lookup("arm", "hand", at(stamp))) == "too_old");
  }
  CHECK(x_of(chain.client->lookup("arm", "hand", at(ms(1000)))) == 1);
  for (Client* caller : {&*chain.client, static_cast<Client*>(&*chain.arm)}) {
    const Time start = caller == &*chain.client ? ms(0) : ms(1);
    CHECK(outcome(caller->update("hand", along_x(7), start)) == "ok");
    CHECK(x_of(caller->lookup("arm", "hand", at(start))) == 7);
  }
  CHECK(chain.arm->history("hand").value().front().oldest == ms(0));
}

TEST_CASE("all partitions answer for the same instant") {
  Chain chain(joined_by(GENERATE(from_range(testing::networks()))));
  for (const int t : {1000, 2000, 3000}) {
    REQUIRE(chain.client->update("base", along_x(t), ms(t)));
    REQUIRE(chain.client->update({{"arm", along_x(2 * t)}, {"hand", along_x(3 * t)}}, ms(t - 500)));
  }
  for (Client* caller : std::vector<Client*>{&*chain.client, &*chain.base, &*chain.tool}) {
    const auto newest = caller->lookup("world", "tool", Query{});
    REQUIRE(newest);
    CHECK(newest->stamp == ms(2500));
    CHECK(x_of(newest) == Approx(2500 + 5 * 3000 + 5));
    CHECK(x_of(caller->lookup("world", "tool", at(ms(1500)))) == Approx(1500 + 5 * 2000 + 5));
    CHECK(x_of(caller->lookup("tool", "world", at(ms(1500)))) == Approx(-(1500 + 5 * 2000 + 5)));
    const auto early = caller->lookup("world", "tool", at(ms(999)));
    CHECK(outcome(early) == "too_old");
    CHECK(early.error().message.find("'base'") != std::string::npos);
    const auto late = caller->lookup("world", "hand", at(ms(2750)));
    CHECK(outcome(late) == "not_yet");
    CHECK(late.error().message.find("250.000 ms older") != std::string::npos);
    CHECK(outcome(caller->can_lookup("world", "hand", at(ms(2750)))) == "not_yet");
    CHECK(outcome(caller->can_lookup("world", "hand")) == "ok");
    CHECK(x_of(caller->lookup("world", "hand", {ms(2750), 250ms, {}})) == Approx(2750 + 5 * 3250));
    // The tool at one instant, seen from the hand at another: over the world.
    const auto travelled = caller->lookup("hand", at(ms(1500)), "tool", at(ms(2500)), "world");
    CHECK(x_of(travelled) == Approx((2500 + 5 * 3000 + 5) - (1500 + 5 * 2000)));
    CHECK(caller->history("arm").value().at(0).samples == 3);
    CHECK(caller->history("tool").value().empty());
    CHECK(caller->histories("arm").value().size() == 2);
    CHECK(outcome(caller->history("nobody")) == "unknown_frame");
    CHECK(outcome(caller->histories("nobody")) == "unknown_partition");
  }
  CHECK(outcome(chain.client->update("arm", {}, ms(500))) == "stamp_taken");
  CHECK(chain.client->history("arm").value().at(0).refused_equal == 1);
}

TEST_CASE("a lookup over dynamic edges of several owners is the motion at its stamp") {
  Chain chain(joined_by(GENERATE(from_range(testing::networks()))));
  Motion motion(4242, wall_clock());
  INFO("seed " << motion.seed());
  const Source base(*chain.base, motion, {0}, motion.seed() + 1);
  const Source arm(*chain.arm, motion, {1, 2}, motion.seed() + 2);
  const Source tool(*chain.tool, motion, {3}, motion.seed() + 3);
  for (const char* id : {"base", "arm", "hand", "tool"}) {
    REQUIRE(testing::eventually([&] {
      const auto history = chain.client->history(id);
      return history && !history->empty();
    }));
  }
  // The first sample of one may be younger than the newest of another.
  REQUIRE(chain.client->lookup("world", "tool", Query{}, 5000ms));
  int naive_wrong = 0;
  constexpr int kLookups = 300;
  for (int i = 0; i < kLookups; ++i) {
    const auto found = chain.client->lookup("world", "tool", Query{});
    REQUIRE(found);
    REQUIRE(found->stamp.has_value());
    REQUIRE(testing::pose_diff(found->pose, motion.whole(*found->stamp), 1e-8) == "");
    // The instant is not old either: for consecutive lookups, no more than a moment.
    REQUIRE(wall_clock() - *found->stamp < 5s);
    const auto one = chain.client->lookup("world", "base", Query{});
    const auto two = chain.client->lookup("base", "hand", Query{});
    const auto three = chain.client->lookup("hand", "tool", Query{});
    REQUIRE((one && two && three));
    const Pose naive = one->pose * two->pose * three->pose;
    const auto off = [&](Time t) {
      return !testing::pose_diff(naive, motion.whole(t), 1e-8).empty();
    };
    naive_wrong += off(*one->stamp) && off(*two->stamp) && off(*three->stamp) ? 1 : 0;
    const Time past = *found->stamp - 20ms;
    if (const auto then = chain.client->lookup("world", "tool", at(past))) {
      REQUIRE(then->stamp == past);
      REQUIRE(testing::pose_diff(then->pose, motion.whole(past), 1e-8) == "");
    }
  }
  CHECK(naive_wrong > kLookups / 2);
  CHECK(base.failed() + arm.failed() + tool.failed() == 0);
}

TEST_CASE("a lookup waits for new samples up to its limit but not for dropped ones") {
  Chain chain(joined_by(GENERATE(from_range(testing::networks()))));
  REQUIRE(chain.arm->update("arm", along_x(1), ms(1000)));
  REQUIRE(chain.arm->update("arm", along_x(2), ms(2000)));
  const auto start = std::chrono::steady_clock::now();
  CHECK(outcome(chain.client->lookup("world", "tool", at(ms(500)), 20'000ms)) == "too_old");
  CHECK(std::chrono::steady_clock::now() - start < 10s);
  CHECK(outcome(chain.client->lookup("world", "tool", at(ms(3000)), 20ms)) == "not_yet");
  auto future = chain.client->lookup_async("world", "tool", at(ms(3000)), 20'000ms);
  std::promise<double> called;
  auto pending = chain.client->lookup_async(
      "world", "later", at(ms(3000)), 20'000ms,
      [&](const Result<StampedTransform>& X) { called.set_value(x_of(X)); });
  CHECK(future.wait_for(20ms) == std::future_status::timeout);
  REQUIRE(chain.arm->update("arm", along_x(4), ms(4000)));
  REQUIRE(chain.tool->add("later", "tool", along_x(100)));
  CHECK(x_of(future.get()) == Approx(3 + 5));
  CHECK(called.get_future().get() == Approx(3 + 5 + 100));
  // A callback may end the lookup that called it.
  std::atomic<bool> ended{false};
  PendingLookup ends_itself;
  std::mutex held;
  {
    const std::lock_guard lock(held);
    ends_itself = chain.client->lookup_async("world", "tool", {}, 1000ms, [&](const auto&) {
      const std::lock_guard wait(held);
      ends_itself.cancel();
      ended = true;
    });
  }
  REQUIRE(testing::eventually([&] { return ended.load(); }));
  std::atomic<int> calls{0};
  auto cancelled =
      chain.client->lookup_async("world", "never", {}, 20'000ms, [&](const auto&) { ++calls; });
  cancelled.cancel();
  auto left =
      chain.client->lookup_async("world", "never", {}, 20'000ms, [&](const auto&) { ++calls; });
  auto abandoned = chain.client->lookup_async("world", "never", {}, 20'000ms);
  chain.client.reset();
  CHECK(outcome(abandoned.get()) == "transport");
  CHECK(calls == 0);
}

TEST_CASE("a watched path follows what its owners write") {
  Chain chain(joined_by(GENERATE(from_range(testing::networks()))));
  REQUIRE(chain.base->update("base", along_x(1000), ms(1000)));
  for (Client* caller : std::vector<Client*>{&*chain.client, &*chain.arm}) {
    auto path = caller->watch("world", "tool");
    REQUIRE(path);
    CHECK(x_of(path->latest()) == x_of(caller->lookup("world", "tool", Query{})));
    const int from = caller == &*chain.client ? 1000 : 2000;
    for (int t = from + 10; t <= from + 500; t += 10) {
      REQUIRE(chain.base->update("base", along_x(t), ms(t)));
      REQUIRE(chain.tool->update("tool", along_x(1)));
    }
    REQUIRE(testing::eventually([&] { return x_of(path->latest()) == from + 500 + 1; }));
    CHECK(path->latest().value().stamp == ms(from + 500));
    CHECK(x_of(path->at(ms(from + 333))) == Approx(from + 333 + 1));
    CHECK(outcome(path->at(ms(from + 501))) == "not_yet");
    REQUIRE(chain.tool->update("tool", along_x(5)));
    REQUIRE(testing::eventually([&] { return x_of(path->latest()) == from + 500 + 5; }));
  }
  CHECK(outcome(chain.client->watch("world", "nobody")) == "unknown_end");
  WatchOptions options;
  options.rate = -1;
  CHECK(outcome(chain.client->watch("world", "tool", options)) == "invalid_input");
}

TEST_CASE("a watched path finds its new route after frames are moved or removed and added") {
  Chain chain(joined_by(GENERATE(from_range(testing::networks()))));
  std::atomic<int> told{0};
  WatchOptions options;
  options.on_route = [&](const std::string&) { ++told; };
  auto path = chain.client->watch("world", "tool", options);
  REQUIRE(path);
  REQUIRE(chain.client->move("tool", "base", along_x(7)));
  REQUIRE(testing::eventually([&] { return x_of(path->latest()) == 7; }));
  REQUIRE(testing::eventually([&] { return told == 1; }));
  REQUIRE(chain.base->update("base", along_x(1000), ms(1000)));
  REQUIRE(testing::eventually([&] { return x_of(path->latest()) == 1007; }));
  REQUIRE(chain.client->remove("tool"));
  REQUIRE(testing::eventually([&] { return outcome(path->latest()) == "unknown_end"; }));
  REQUIRE(chain.client->add("tool", "arm", along_x(9), "tool"));
  REQUIRE(testing::eventually([&] { return x_of(path->latest()) == 1009; }));
  CHECK(testing::eventually([&] { return told >= 3; }));
}

TEST_CASE("a watched path continues when an owner returns") {
  const auto join = joined_by(GENERATE(from_range(testing::networks())));
  Chain chain(join);
  auto path = chain.client->watch("world", "tool");
  REQUIRE(path);
  REQUIRE(chain.tool->update("tool", along_x(5), ms(1000)));
  REQUIRE(testing::eventually([&] {
    const auto X = path->latest();
    return X && X->stamp == ms(1000);
  }));
  chain.tool.reset();
  REQUIRE(testing::eventually(
      [&] { return outcome(chain.client->lookup("world", "tool")) == "unreachable"; }));
  CHECK(x_of(path->latest()) == 5);  // what is known still, with its stamp
  chain.tool.emplace(Node::open(join("tool"), "tool", {{"tool", "hand", along_x(6)}}).value());
  REQUIRE(testing::eventually([&] { return x_of(path->latest()) == 6; }));
  REQUIRE(chain.tool->update("tool", along_x(7), ms(500)));
  REQUIRE(testing::eventually([&] { return x_of(path->latest()) == 7; }));
}

TEST_CASE("a watch with composed segments gets no more messages than its rate allows") {
  Chain chain(joined_by(GENERATE(from_range(testing::networks()))));
  WatchOptions options;
  options.composed = true;
  options.rate = 20;
  auto path = chain.client->watch("tool", "base", options);
  REQUIRE(path);
  CHECK(x_of(path->latest()) == -5);
  const auto start = std::chrono::steady_clock::now();
  std::int64_t t = 0;
  const std::uint64_t before = path->messages();
  while (std::chrono::steady_clock::now() - start < 500ms) {
    ++t;
    REQUIRE(chain.arm->update({{"arm", along_x(1)}, {"hand", along_x(1)}}, ms(t)));
    std::this_thread::sleep_for(1ms);
  }
  const auto over = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  REQUIRE(testing::eventually([&] {
    const auto X = path->latest();
    return X && X->stamp == ms(t);
  }));
  CHECK(x_of(path->latest()) == -7);
  // Besides those of the rate there are the renewals, one a second of each of two owners.
  CHECK(static_cast<double>(path->messages() - before) <= 20 * over + 2 + 2 * (over + 1));
}

}  // namespace tfdude
