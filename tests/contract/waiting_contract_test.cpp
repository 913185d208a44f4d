// Waits of calls that read, and being told: watched values, messages with stamps, the clock.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/message_filter.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/joint_frames.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using testing::eventually;

Time instant(int ms) { return Time(std::chrono::seconds(1'000'000)) + Milliseconds(ms); }

Transform ahead(double x) {
  return Transform::exact(Pose::trusted(Eigen::Quaterniond::Identity(), {x, 0, 0}));
}

Query at(int ms) {
  Query query;
  query.at = instant(ms);
  return query;
}

struct World {
  testing::Join join = testing::join_loopback();
  Node node =
      Node::open(join("base"), "base",
                 {{"world", "", {}}, {"base", "world", ahead(0)}, {"tip", "base", ahead(1)}})
          .value();
  Client client = Client::open(join("")).value();
};

// Runs a call that has to wait, and what it waits for.
template <class Call, class Then>
auto after(Call call, Then then) {
  std::atomic<bool> begun{false};
  std::thread later([&] {
    (void)eventually([&] { return begun.load(); });
    std::this_thread::sleep_for(5ms);
    then();
  });
  begun = true;
  auto result = call();
  later.join();
  return result;
}

// What a filter has passed on.
struct Passed {
  void add(const std::string& what) {
    const std::lock_guard lock(mutex);
    all.push_back(what);
  }
  [[nodiscard]] std::vector<std::string> now() {
    const std::lock_guard lock(mutex);
    return all;
  }
  [[nodiscard]] bool gets(std::size_t count) {
    return eventually([&] { return now().size() >= count; });
  }
  std::mutex mutex;
  std::vector<std::string> all;
};

}  // namespace

TEST_CASE("waiting: each call that reads waits for frames and data") {
  World world;
  REQUIRE(world.node.update("base", ahead(1), instant(0)));
  Client& client = world.client;
  CHECK(client.can_lookup("world", "tip", at(10)).error().code == Errc::kNotYet);
  int ms = 0;
  const auto next = [&] {
    ms += 10;
    return [&world, ms] { CHECK(world.node.update("base", ahead(ms), instant(ms))); };
  };
  CHECK(after([&] { return client.can_lookup("world", "tip", at(ms), 20s); }, next()));
  const auto X =
      after([&] { return client.transform("world", "tip", ahead(1), at(ms), 20s); }, next());
  REQUIRE(X);
  CHECK(X->pose.translation().x() == 22);
  CHECK(after([&] { return client.transform("world", "tip", std::vector<Point>{{}}, at(ms), 20s); },
              next()));
  CHECK(after([&] { return client.lookup("tip", at(0), "tip", at(ms), "world", 20s); }, next()));
  CHECK(after([&] { return client.velocity("world", "tip", {instant(ms), 10ms}, 20s); }, next()));
  // A history that reaches no further than the newest interval will.
  CHECK(client.velocity("world", "tip", {{}, 60ms}).error().code == Errc::kTooOld);
  CHECK(client.velocity("world", "tip", {{}, 60ms}, 20ms).error().code == Errc::kTooOld);
  CHECK(client.velocity("world", "tip", {Time{}, 60ms}, 20s).error().code == Errc::kTooOld);
  CHECK(after(
      [&] {
        return client.velocity("world", "tip", {{}, 60ms}, 20s);
      },
      [&] { CHECK(world.node.update("base", ahead(60), instant(60))); }));
  ms = 60;
  CHECK(after([&] { return client.trajectory("world", "tip", {instant(ms)}, {}, 20s); }, next())
            ->missing.empty());
  const auto watch = after([&] { return client.watch("world", "hand", {}, 20s); },
                           [&] { CHECK(world.node.add("hand", "tip", ahead(1))); });
  CHECK(watch);
  // A wait ends in time, with the reason.
  const auto never = client.can_lookup("world", "tip", at(100'000), 20ms);
  REQUIRE_FALSE(never);
  CHECK(never.error().code == Errc::kNotYet);
  CHECK(client.watch("world", "nowhere", {}, 20ms).error().code == Errc::kUnknownEnd);
}

TEST_CASE("waiting: wait_next() of a client that has ended does not wait") {
  World world;
  auto ended = std::make_unique<Client>(Client::open(world.join("")).value());
  auto watch = ended->watch("world", "base", {}, 20s);
  REQUIRE(watch);
  ended.reset();
  const auto begin = std::chrono::steady_clock::now();
  // Also the first time, when it would wait for a value.
  const auto never = watch->wait_next(20s);
  REQUIRE_FALSE(never);
  CHECK(never.error().code == Errc::kTransport);
  CHECK(std::chrono::steady_clock::now() - begin < 10s);
}

TEST_CASE("waiting: wait_next() returns when the path or the client ends meanwhile") {
  World world;
  auto client = std::make_unique<Client>(Client::open(world.join("")).value());
  auto watch = client->watch("world", "base", {}, 20s);
  REQUIRE(watch);
  REQUIRE(watch->wait_next(20s));
  const auto begin = std::chrono::steady_clock::now();
  SECTION("the path") {
    const auto gone =
        after([&] { return watch->wait_next(20s); }, [&] { CHECK(world.node.remove("base")); });
    REQUIRE_FALSE(gone);
    CHECK(gone.error().code == Errc::kUnknownEnd);
  }
  SECTION("the client") {
    const auto ended = after([&] { return watch->wait_next(20s); }, [&] { client.reset(); });
    REQUIRE_FALSE(ended);
    CHECK(ended.error().code == Errc::kTransport);
    CHECK_FALSE(watch->wait_for_more(watch->messages(), begin + 20s));
  }
  CHECK(std::chrono::steady_clock::now() - begin < 10s);
}

TEST_CASE("waiting: the end of a path is told once, and its return is waited for") {
  World world;
  auto watch = world.client.watch("world", "base");
  REQUIRE(watch);
  REQUIRE(watch->wait_next(20s));
  REQUIRE(world.node.remove("base"));
  const auto gone = watch->wait_next(20s);
  REQUIRE_FALSE(gone);
  CHECK(gone.error().code == Errc::kUnknownEnd);
  std::atomic<int> news{0};
  const Subscription listening = watch->on_news([&] { ++news; });
  const auto begin = std::chrono::steady_clock::now();
  const auto still = watch->wait_next(300ms);
  REQUIRE_FALSE(still);
  CHECK(still.error().code == Errc::kUnknownEnd);
  CHECK(std::chrono::steady_clock::now() - begin >= 300ms);
  CHECK(news <= 1);
  REQUIRE(world.node.add("base", "world", ahead(7)));
  const auto back = watch->wait_next(20s);
  REQUIRE(back);
  CHECK(back->pose.translation().x() == 7);
}

TEST_CASE("waiting: wait_next() returns each new value once, and the newest of several") {
  World world;
  REQUIRE(world.node.update("base", ahead(1), instant(0)));
  auto watch = world.client.watch("world", "base");
  REQUIRE(watch);
  const auto x_of = [](const Result<StampedTransform>& X) {
    return X ? X->pose.translation().x() : -1;
  };
  CHECK(x_of(watch->wait_next(20s)) == 1);
  const auto nothing = watch->wait_next(1ms);
  REQUIRE_FALSE(nothing);
  CHECK(nothing.error().code == Errc::kTimeout);
  CHECK_THAT(nothing.error().message, ContainsSubstring("'world'"));
  PathWatch other = *watch;
  REQUIRE(world.node.update("base", ahead(2), instant(10)));
  CHECK(x_of(watch->wait_next(20s)) == 2);
  CHECK(x_of(other.wait_next(20s)) == 2);  // each copy has its own place
  REQUIRE(world.node.update("base", ahead(3), instant(20)));
  REQUIRE(world.node.update("base", ahead(4), instant(30)));
  double last = 0;
  while (last != 4) {
    const auto X = watch->wait_next(20s);
    REQUIRE(X);
    CHECK(X->pose.translation().x() > last);
    last = X->pose.translation().x();
  }
  REQUIRE(world.node.remove("base"));
  REQUIRE(eventually([&] { return !watch->latest(); }));
  CHECK(watch->wait_next(1ms).error().code == watch->latest().error().code);
}

TEST_CASE("waiting: messages that leave the value as it is bring nothing new") {
  const testing::Join join = testing::join_loopback();
  FrameSpec base{"base", "world", ahead(0)};
  base.timing = EdgeTiming();
  FrameSpec arm{"arm", "base", ahead(0)};
  arm.timing = EdgeTiming();
  Node below = Node::open(join("base"), "base", {{"world", "", {}}, base}).value();
  Node above = Node::open(join("arm"), "arm", {arm}).value();
  Client client = Client::open(join("")).value();
  for (int i = 0; i < 2; ++i) {
    REQUIRE(below.update("base", ahead(i), instant(10 * i)));
    REQUIRE(above.update("arm", ahead(0), instant(10 * i)));
  }
  auto watch = client.watch("world", "arm");
  REQUIRE(watch);
  REQUIRE(eventually([&] { return watch->latest() && watch->latest()->stamp == instant(10); }));
  std::atomic<int> calls{0};
  const Subscription values = watch->on_value([&](const Result<StampedTransform>&) { ++calls; });
  REQUIRE(watch->wait_next(20s));
  REQUIRE(eventually([&] { return calls == 1; }));
  // The arm has no later sample, so the path stays at the instant of its last one.
  for (int i = 2; i < 6; ++i) REQUIRE(below.update("base", ahead(i), instant(10 * i)));
  REQUIRE(eventually([&] {
    const auto X = client.lookup("world", "base", Query{});
    return X && X->stamp == instant(50);
  }));
  const auto nothing = watch->wait_next(5ms);
  REQUIRE_FALSE(nothing);
  CHECK(nothing.error().code == Errc::kTimeout);
  REQUIRE(above.update("arm", ahead(1), instant(20)));
  const auto next = watch->wait_next(20s);
  REQUIRE(next);
  CHECK(next->stamp == instant(20));
  REQUIRE(eventually([&] { return calls == 2; }));
}

TEST_CASE("waiting: on_value() calls with the newest value, and with the reason at its end") {
  World world;
  REQUIRE(world.node.update("base", ahead(1), instant(0)));
  auto watch = world.client.watch("world", "base");
  REQUIRE(watch);
  Passed passed;
  const auto note = [&](const Result<StampedTransform>& X) {
    passed.add(X ? std::to_string(std::lround(X->pose.translation().x()))
                 : std::string(to_string(X.error().code)));
  };
  Subscription values = watch->on_value(note);
  REQUIRE(passed.gets(1));
  CHECK(passed.now() == std::vector<std::string>{"1"});
  REQUIRE(world.node.update("base", ahead(2), instant(10)));
  REQUIRE(passed.gets(2));
  CHECK(passed.now().back() == "2");
  REQUIRE(world.node.remove("base"));
  REQUIRE(passed.gets(3));
  CHECK(passed.now().back() == "unknown_end");
  values = Subscription();
  REQUIRE(world.node.add("base", "world", ahead(5)));
  REQUIRE(eventually([&] { return watch->latest().has_value(); }));
  CHECK(passed.now().size() == 3);
  // A callback may end its own subscription, and a slow one gets the newest next.
  std::atomic<int> calls{0};
  Subscription once;
  std::mutex assigned;
  {
    const std::lock_guard lock(assigned);
    once = watch->on_value([&](const Result<StampedTransform>&) {
      const std::lock_guard wait(assigned);
      ++calls;
      once = Subscription();
    });
  }
  REQUIRE(eventually([&] { return calls.load() == 1; }));
  REQUIRE(world.node.update("base", ahead(6)));
  CHECK(watch->wait_next(20s));
  CHECK(calls.load() == 1);
}

TEST_CASE("waiting: on_value() calls nothing any more once nobody watches the path") {
  World world;
  REQUIRE(world.node.update("base", ahead(1), instant(0)));
  auto watch = std::make_optional(world.client.watch("world", "base").value());
  Passed passed;
  const auto note = [&](const Result<StampedTransform>&) { passed.add("value"); };
  const Subscription values = watch->on_value(note);
  REQUIRE(passed.gets(1));
  // What a later watch has told, the first one would have told before.
  const auto other = world.client.watch("world", "base");
  REQUIRE(other);
  Passed later;
  const Subscription others =
      other->on_value([&](const Result<StampedTransform>&) { later.add("value"); });
  REQUIRE(later.gets(1));
  auto copy = watch;
  watch.reset();
  REQUIRE(world.node.update("base", ahead(2), instant(10)));
  REQUIRE(passed.gets(2));
  REQUIRE(later.gets(2));
  copy.reset();
  REQUIRE(world.node.update("base", ahead(3), instant(20)));
  REQUIRE(later.gets(3));
  CHECK(passed.now().size() == 2);
}

TEST_CASE("waiting: a filter passes messages on when their transform can be had") {
  World world;
  REQUIRE(world.node.update("base", ahead(0), instant(0)));
  const bool in_order = GENERATE(false, true);
  Passed passed;
  MessageFilter<std::string> filter(
      world.client, {"world", 20s, 4, in_order},
      [&](const std::string& message, const StampedTransform& X) {
        passed.add(message + " at " + std::to_string(std::lround(X.pose.translation().x())));
      },
      [&](const std::string& message, const Error& why) {
        passed.add("no " + message + ": " + std::string(to_string(why.code)));
      });
  filter.push("later", "tip", instant(20));
  filter.push("now", "tip", instant(0));
  if (!in_order) {
    REQUIRE(passed.gets(1));
    CHECK(passed.now() == std::vector<std::string>{"now at 1"});
  }
  REQUIRE(world.node.update("base", ahead(20), instant(20)));
  REQUIRE(passed.gets(2));
  CHECK(passed.now().back() == (in_order ? "now at 1" : "later at 21"));
  // Too old at once; too many: the oldest is displaced.
  filter.push("old", "tip", instant(-5));
  REQUIRE(passed.gets(3));
  CHECK(passed.now().back() == "no old: too_old");
  for (int i = 0; i < 5; ++i) filter.push("m" + std::to_string(i), "tip", instant(100 + i));
  REQUIRE(passed.gets(4));
  CHECK(passed.now().back() == "no m0: too_much");
  CHECK(filter.waiting() == 4);
}

TEST_CASE("waiting: who waited only for a displaced message is passed on with it") {
  World world;
  REQUIRE(world.node.update("base", ahead(0), instant(0)));
  Passed passed;
  std::unique_ptr<MessageFilter<int>> filter;
  filter = std::make_unique<MessageFilter<int>>(
      world.client, MessageFilterOptions{"world", 20s, 2, true},
      [&](int message, const StampedTransform&) { passed.add(std::to_string(message)); },
      [&](int message, const Error&) {
        passed.add("no " + std::to_string(message));
        if (message == 4) filter.reset();
      });
  filter->push(1, "tip", instant(100));
  filter->push(2, "tip", instant(0));
  filter->push(3, "tip", instant(100));  // the answer for 2 may have come before
  REQUIRE(passed.gets(2));
  CHECK(passed.now() == std::vector<std::string>{"no 1", "2"});
  filter->push(4, "tip", instant(100));
  filter->push(5, "tip", instant(100));  // displaces 3
  filter->push(6, "tip", instant(100));
  CHECK(filter == nullptr);
  CHECK(passed.now().back() == "no 4");
}

TEST_CASE("waiting: a filter drops messages by their age, and says what was missing") {
  World world;
  Passed passed;
  MessageFilter<int> filter(
      world.client, {"world", 10ms}, [](int, const StampedTransform&) {},
      [&](int message, const Error& why) {
        passed.add(std::to_string(message) + " " + std::string(to_string(why.code)));
      });
  filter.push(7, "nowhere", instant(0));
  REQUIRE(passed.gets(1));
  CHECK(passed.now() == std::vector<std::string>{"7 unknown_end"});
}

TEST_CASE("waiting: a filter may be used and destroyed by its own functions, and by any thread") {
  World world;
  REQUIRE(world.node.update("base", ahead(0), instant(0)));
  std::unique_ptr<MessageFilter<int>> filter;
  std::atomic<int> passed{0};
  std::atomic<bool> destroyed{false};
  const auto on_ready = [&](int message, const StampedTransform&) {
    ++passed;
    if (message < 100) filter->push(message + 100, "tip", instant(0));
    if (message == 199) {
      filter.reset();
      destroyed = true;
    }
  };
  filter = std::make_unique<MessageFilter<int>>(
      world.client, MessageFilterOptions{"world", 20s, 1000, true}, on_ready);
  std::vector<std::thread> pushing;
  for (int t = 0; t < 2; ++t) {
    pushing.emplace_back([&, t] {
      for (int i = 0; i < 49; ++i) filter->push(2 * i + t, "tip", instant(0));
    });
  }
  for (std::thread& one : pushing) one.join();
  filter->push(99, "tip", instant(0));
  REQUIRE(eventually([&] { return destroyed.load(); }));
  CHECK(passed.load() >= 100);
  // What waits is cancelled.
  {
    MessageFilter<int> waits(world.client, {"world", 20s},
                             [&](int, const StampedTransform&) { FAIL_CHECK("passed on"); });
    waits.push(1, "tip", instant(1000));
  }
}

TEST_CASE("waiting: until a time of the client's clock") {
  const auto join = testing::join_loopback();
  Options options;
  options.clock = ClockKind::kExternal;
  auto node = Node::open(join("sim"), "sim", {{"world", "", {}}}, options);
  auto system = Client::open(join(""));
  REQUIRE((node && system));
  REQUIRE(node->set_time(external_time(instant(0))));
  CHECK(node->wait_until(instant(0), 0ms));
  const auto early = node->wait_until(instant(10), 5ms);
  REQUIRE_FALSE(early);
  CHECK(early.error().code == Errc::kTimeout);
  CHECK(after([&] { return node->wait_until(instant(10), 20s); },
              [&] { CHECK(node->set_time(external_time(instant(10)))); }));
  CHECK(system->wait_until(*system->now() + 10ms, 20s));
  CHECK_FALSE(system->wait_until(*system->now() + std::chrono::hours(1), 1ms));
}

TEST_CASE("calls about the structure wait for what comes later") {
  const testing::Join join = testing::joined_by(GENERATE(from_range(testing::networks())));
  Node base = Node::open(join("base"), "base", {{"world", "", {}}}).value();
  Client client = Client::open(join("")).value();
  REQUIRE(client.exists("world"));
  std::optional<Node> arm;
  const auto open_arm = [&] {
    FrameSpec upper{"upper", "world", {}};
    upper.joint = testing::revolute_named("shoulder");
    arm.emplace(Node::open(join("arm"), "arm", {upper, {"hand", "upper", ahead(1)}}).value());
  };
  SECTION("history") {
    CHECK(client.history("hand").error().code == Errc::kUnknownFrame);
    CHECK(client.history("hand", 20ms).error().code == Errc::kUnknownFrame);
    CHECK(after([&] { return client.history("hand", 10s); }, open_arm));
  }
  SECTION("histories") {
    CHECK(client.histories("arm", 20ms).error().code == Errc::kUnknownPartition);
    CHECK(after([&] { return client.histories("arm", 10s); }, open_arm));
  }
  SECTION("joints") {
    CHECK(client.joints("arm", 20ms).error().code == Errc::kUnknownPartition);
    const auto joints = after([&] { return client.joints("arm", 10s); }, open_arm);
    REQUIRE(joints);
    CHECK(joints->at(0).name == "shoulder");
  }
  SECTION("watched edges") {
    CHECK(client.watch_edges({"hand"}, {}, 20ms).error().code == Errc::kUnknownFrame);
    const auto watch = after(
        [&] {
          return client.watch_edges({"upper", "hand"}, {}, 10s);
        },
        open_arm);
    REQUIRE(watch);
    CHECK(eventually([&] { return watch->lookup("upper", "hand").has_value(); }));
  }
}

TEST_CASE("whether a frame exists is told from not knowing it") {
  const testing::Join join = testing::joined_by(GENERATE(from_range(testing::networks())));
  Node base = Node::open(join("base"), "base", {{"world", "", {}}}).value();
  Client client = Client::open(join("")).value();
  CHECK(client.whether_exists("world").value());
  CHECK_FALSE(client.whether_exists("nowhere").value());
  CHECK_FALSE(client.exists("nowhere"));
}

TEST_CASE("nobody can say whether a frame of a partition that was lost before exists") {
  const testing::Join join = testing::join_loopback();
  Node base = Node::open(join("base"), "base", {{"world", "", {}}}).value();
  {
    const Node arm = Node::open(join("arm"), "arm", {{"hand", "world", {}}}).value();
    REQUIRE(eventually([&] { return base.exists("hand"); }));
  }
  REQUIRE(eventually([&] {
    const auto partitions = base.partitions().value();
    return std::any_of(partitions.begin(), partitions.end(), [](const PartitionInfo& one) {
      return one.name == "arm" && !one.reachable;
    });
  }));
  Client late = Client::open(join("")).value();
  Result<bool> exists;
  REQUIRE(eventually([&] { return !(exists = late.whether_exists("nowhere")); }));
  CHECK(exists.error().code == Errc::kUnreachable);
  CHECK(exists.error().frame == "nowhere");
  CHECK(exists.error().partition == "arm");
  CHECK_FALSE(late.exists("nowhere"));
}

TEST_CASE("exists: where no partition answers nobody can say") {
  const testing::Join join = testing::joined_by(GENERATE(from_range(testing::networks())));
  Client client = Client::open(join("")).value();
  const auto exists = client.whether_exists("world");
  REQUIRE_FALSE(exists);
  CHECK(exists.error().code == Errc::kUnreachable);
  CHECK_FALSE(client.exists("world"));
}

}  // namespace tfdude
