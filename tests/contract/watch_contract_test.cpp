// Paths that owners push, over each transport: what reaches a watcher, and when; and what pushing
// leaves behind.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "partition/messages.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"
#include "support/recorder.hpp"
#include "support/sanitizers.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Join;
using testing::joined_by;
using testing::outcome;
using testing::Random;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

// world -> base -> arm -> hand, of two partitions and a client without frames.
struct Robot {
  explicit Robot(Join joined, const EdgeTiming& of_hand = {}) : join(std::move(joined)) {
    const Transform exact = Transform::exact({});
    base.emplace(
        Node::open(join("base"), "base", {{"world", "", exact}, {"base", "world", exact}}).value());
    FrameSpec hand{"hand", "arm", exact};
    hand.timing = of_hand;
    arm.emplace(Node::open(join("arm"), "arm", {{"arm", "base", exact}, hand}).value());
    client.emplace(Client::open(join("")).value());
  }
  Join join;
  std::optional<Node> base;
  std::optional<Node> arm;
  std::optional<Client> client;
};

// A rate that no other watch has, so that each watch has its own group.
WatchOptions one_more() {
  static int count = 0;
  WatchOptions options;
  options.rate = 1e9 / (1000.0 + ++count);
  return options;
}

#ifndef TFDUDE_THREAD_SANITIZER
// DDS over the loopback interface. The writers of one partition are counted.
class CountedDomain {
 public:
  TransportPtr join(const std::string& partition, bool counted = false) {
    const auto counters = counted ? counters_ : nullptr;
    return *make_fastdds_transport({lease_.number(), TFDUDE_LOOPBACK_PROFILE, partition, counters});
  }
  std::uint64_t writers() const { return counters_->writers; }

 private:
  testing::DomainLease lease_;
  std::shared_ptr<FastDdsCounters> counters_ = std::make_shared<FastDdsCounters>();
};
#endif

}  // namespace

TEST_CASE("watch: a waiting lookup is answered as soon as its path is pushed") {
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))));
  const auto watched = robot.client->watch("arm", "hand");
  REQUIRE(watched);
  std::vector<double> late;
  // The stamps are so far ahead that the owner is asked only every 50 ms.
  const auto now = std::chrono::time_point_cast<Time::duration>(std::chrono::system_clock::now());
  REQUIRE(robot.arm->update("hand", along_x(0), now));
  for (int i = 1; i <= 15; ++i) {
    const Time stamp = now + i * 1s;
    Query query;
    query.at = stamp;
    auto waiting = robot.client->lookup_async("arm", "hand", query, 20s);
    std::this_thread::sleep_for(Milliseconds(60 + 7 * i % 50));
    REQUIRE(robot.arm->update("hand", along_x(i), stamp));
    const auto written = std::chrono::steady_clock::now();
    const auto found = waiting.get();
    late.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - written)
            .count());
    CHECK(x_of(found) == i);
  }
  std::sort(late.begin(), late.end());
  INFO("median " << late[late.size() / 2] << " ms");
  CHECK(late[late.size() / 2] < 10);
}

TEST_CASE("watch: late samples and process noise give the same values as a lookup") {
  Random random(1601);
  INFO("seed " << random.seed());
  EdgeTiming noisy;
  noisy.process_noise = random.covariance(0.01, 0.01);
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))), noisy);
  const auto path = robot.client->watch("world", "hand");
  REQUIRE(path);
  // Waits for discovery first.
  REQUIRE(robot.arm->update("hand", random.transform(), ms(1000)));
  REQUIRE(eventually([&] { return path->latest() && path->latest().value().stamp == ms(1000); }));
  for (const int t : {3000, 2000, 4000, 1500, 3990}) {
    REQUIRE(robot.arm->update("hand", random.transform(), ms(t)));
  }
  const auto as_looked_up = [&](std::int64_t t) {
    Query query;
    query.at = ms(t);
    const auto expected = robot.client->lookup("world", "hand", query);
    const auto watched = path->at(ms(t));
    if (!expected || !watched) return outcome(expected) + ", watched: " + outcome(watched);
    return testing::transform_diff(*watched, *expected, 1e-9);
  };
  for (int t = 1000; t <= 4000; t += 125) {
    REQUIRE(eventually([&] { return as_looked_up(t).empty(); }));
  }
}

TEST_CASE("watch: late samples and static edges change composed segments as they change lookups") {
  Random random(1602);
  INFO("seed " << random.seed());
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))));
  WatchOptions options;
  options.composed = true;
  const auto path = robot.client->watch("world", "hand", options);
  REQUIRE(path);
  const std::vector<int> stamps{1000, 3000, 2000, 4000, 1500, 3990};
  for (const int t : stamps) {
    REQUIRE(robot.arm->update("hand", random.transform(), ms(t)));
    // From here on all is pushed.
    if (t == 1000) {
      REQUIRE(
          eventually([&] { return path->latest() && path->latest().value().stamp == ms(1000); }));
    }
  }
  const auto agree = [&] {
    return std::all_of(stamps.begin(), stamps.end(), [&](int t) {
      Query query;
      query.at = ms(t);
      const auto expected = robot.client->lookup("world", "hand", query);
      const auto watched = path->at(ms(t));
      return expected && watched && testing::transform_diff(*watched, *expected, 1e-9).empty();
    });
  };
  CHECK(eventually(agree));
  REQUIRE(robot.arm->update("arm", random.transform()));
  CHECK(eventually(agree));
}

TEST_CASE("watch: a segment with process noise cannot be watched composed") {
  EdgeTiming noisy;
  noisy.process_noise = *Covariance::from_stddev({0.1, 0.1, 0.1, 0.1, 0.1, 0.1});
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))), noisy);
  REQUIRE(robot.arm->update("hand", along_x(1), ms(1)));
  WatchOptions options;
  options.composed = true;
  const auto path = robot.client->watch("world", "hand", options);
  REQUIRE(outcome(path) == "invalid_input");
  CHECK(path.error().message.find("process noise") != std::string::npos);
  CHECK(robot.client->watch("world", "hand"));
}

TEST_CASE("watch: a static value that is set as a watch begins arrives at once") {
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))));
  for (int i = 1; i <= 20; ++i) {
    const auto path = robot.client->watch("world", "hand", one_more());
    REQUIRE(path);
    REQUIRE(robot.base->update("base", along_x(i)));
    const auto set = std::chrono::steady_clock::now();
    REQUIRE(eventually([&] { return x_of(path->latest()) == i; }));
    CHECK(std::chrono::steady_clock::now() - set < 400ms);
  }
}

TEST_CASE("watch: a new watch starts at the latest common time of its edges") {
  Robot robot(joined_by(GENERATE(from_range(testing::networks()))));
  for (int t = 1; t <= 50; ++t) {
    REQUIRE(robot.base->update("base", along_x(t), ms(10 * t)));
    REQUIRE(robot.arm->update("arm", along_x(t), ms(10 * t + 3)));
    REQUIRE(robot.arm->update("hand", along_x(t), ms(10 * t - 7)));
    if (t < 3) continue;
    const auto path = robot.client->watch("world", "hand", one_more());
    REQUIRE(path);
    const auto found = path->latest();
    CHECK(outcome(found) == "ok");
    CHECK(found.value().stamp == ms(10 * t - 7));
  }
  // There is none yet where an edge has only just begun: it is waited for.
  REQUIRE(robot.base->add("new", "base", {}));
  REQUIRE(robot.base->update("new", along_x(1), ms(600)));
  REQUIRE(eventually([&] { return robot.arm->move("arm", "new").has_value(); }));
  REQUIRE(robot.arm->update("arm", along_x(1), ms(601)));
  REQUIRE(eventually([&] {
    const auto route = robot.client->path("new", "arm");
    return route && route->size() == 1;
  }));
  std::thread source([&] {
    std::this_thread::sleep_for(50ms);
    (void)robot.base->update({{"new", along_x(2)}, {"base", along_x(2)}}, ms(602));
    (void)robot.arm->update({{"arm", along_x(2)}, {"hand", along_x(2)}}, ms(602));
  });
  const auto path = robot.client->watch("world", "hand", one_more());
  source.join();
  REQUIRE(path);
  CHECK(outcome(path->latest()) == "ok");
}

TEST_CASE("watch: a path is read without a break while an owner restarts") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Robot robot(join);
  const auto path = robot.client->watch("world", "hand");
  REQUIRE(path);
  std::atomic<bool> stop{false};
  std::string wrong;
  std::thread reader([&] {
    while (!stop && wrong.empty()) {
      const auto found = path->latest();
      if (!found) wrong = found.error().message;
      if (found && x_of(found) != 0 && x_of(found) != 7) wrong = std::to_string(x_of(found));
    }
  });
  robot.arm.reset();
  robot.arm.emplace(
      Node::open(join("arm"), "arm", {{"arm", "base", {}}, {"hand", "arm", along_x(7)}}).value());
  CHECK(eventually([&] { return x_of(path->latest()) == 7; }));
  stop = true;
  reader.join();
  CHECK(wrong == "");
}

TEST_CASE("watch: an invalid rate is rejected") {
  Robot robot(joined_by(0));
  for (const double rate : {-1.0, 1e-4, 1e-300, 2e6, std::numeric_limits<double>::infinity(),
                            std::numeric_limits<double>::quiet_NaN()}) {
    WatchOptions options;
    options.rate = rate;
    CHECK(outcome(robot.client->watch("world", "hand", options)) == "invalid_input");
  }
  WatchOptions options;
  options.rate = 0.001;
  CHECK(robot.client->watch("world", "hand", options));
}

TEST_CASE("watch: a path of too many edges is rejected at once") {
  const Join join = testing::join_loopback();
  std::vector<FrameSpec> frames{{"link0", "", {}}};
  for (int i = 1; i <= 4097; ++i) {
    frames.push_back({"link" + std::to_string(i), "link" + std::to_string(i - 1), {}});
  }
  const auto node = Node::open(join("chain"), "chain", frames);
  REQUIRE(node);
  Options patient;
  patient.timeout = 60'000ms;
  Client client = Client::open(join(""), patient).value();
  const auto begin = std::chrono::steady_clock::now();
  const auto watch = client.watch("link0", "link4097");
  REQUIRE_FALSE(watch);
  CHECK(watch.error().code == Errc::kInvalidInput);
  CHECK_THAT(watch.error().message, ContainsSubstring("4097 edges at once, of at most 4096"));
  CHECK(std::chrono::steady_clock::now() - begin < 30s);
}

#ifndef TFDUDE_THREAD_SANITIZER  // ThreadSanitizer does not see the locks of Fast DDS
// Not more, because each costs milliseconds; pusher_test.cpp has 1,000 watches.
TEST_CASE("watch: no writer is left after watches and clients have ended") {
  CountedDomain domain;
  auto base = Node::open(domain.join("base", true), "base",
                         {{"world", "", {}}, {"base", "world", {}}, {"spare", "world", {}}})
                  .value();
  auto client = Client::open(domain.join("")).value();
  REQUIRE(client.lookup("world", "base"));
  REQUIRE(eventually([&] { return domain.writers() == 3; }));  // one of them for replies
  const std::uint64_t before = domain.writers();
  for (int i = 0; i < 200; ++i) REQUIRE(client.watch("world", "base", one_more()));
  for (int i = 0; i < 20; ++i) {
    // Its frame is removed, so it cannot be renewed. The client may see the new frame late.
    std::optional<PathWatch> path;
    REQUIRE(eventually([&] {
      auto watched = client.watch("world", "spare", one_more());
      if (watched) path.emplace(*std::move(watched));
      return path.has_value();
    }));
    REQUIRE(base.remove("spare"));
    REQUIRE(base.add("spare", "world", {}));
  }
  for (int i = 0; i < 50; ++i) {
    auto passing = Client::open(domain.join("")).value();
    REQUIRE(passing.watch("world", "base", one_more()));
  }
  CHECK(eventually([&] { return domain.writers() == before; }));
}

TEST_CASE("watch: a reply to a peer that has left creates no writer") {
  CountedDomain domain;
  testing::Recorder owner;
  owner.frames = {"hand"};
  std::mutex mutex;
  std::optional<PeerId> peer;
  owner.answer = [&](const PeerId& from, const Request&) {
    const std::lock_guard lock(mutex);
    peer = from;
  };
  const auto transport = domain.join("arms", true);
  REQUIRE(transport->start(owner));
  REQUIRE(transport->serve("arms"));
  const std::uint64_t before = domain.writers();
  const auto deadline = [] { return std::chrono::steady_clock::now() + 10s; };
  const auto asked_by = [&](Transport& asking) {
    {
      const std::lock_guard lock(mutex);
      peer.reset();
    }
    return eventually([&] {
      REQUIRE(asking.send("arms", Request{1, "hand", LookupRequest{}}, deadline()));
      const std::lock_guard lock(mutex);
      return peer.has_value();
    });
  };
  for (int i = 0; i < 20; ++i) {
    testing::Recorder nobody;
    const auto asking = domain.join("");
    REQUIRE(asking->start(nobody));
    REQUIRE(asked_by(*asking));
    asking->stop();
    REQUIRE(eventually([&] { return domain.writers() == before; }));
    transport->reply(*peer, Reply{1, 0, Done{}});
  }
  // A sample of an existing writer arrives, after everything that was to be done before.
  testing::Recorder asker;
  const auto asking = domain.join("");
  REQUIRE(asking->start(asker));
  REQUIRE(asked_by(*asking));
  REQUIRE(eventually([&] {
    transport->reply(*peer, Reply{1, 0, Done{}});
    return asker.hears([](const auto& heard) { return !heard.replies.empty(); }, 50ms);
  }));
  CHECK(domain.writers() == before + 1);
}
#endif

// world -> base moves, world -> object stands, each of another partition.
TEST_CASE("watch: a path that was just observed is as certain as a lookup says") {
  const Join join = testing::join_loopback();
  const bool drifts = GENERATE(false, true);
  const bool noisy = GENERATE(false, true);
  INFO("drifts " << drifts << ", noisy " << noisy);
  const auto sigma = [](double size) {
    return *Covariance::from_stddev({size, size, size, size, size, size});
  };
  FrameSpec of_base{"base", "world", Transform::exact({})};
  of_base.timing = EdgeTiming();
  of_base.timing->drifts = drifts;
  if (noisy) of_base.timing->process_noise = sigma(0.02);
  auto base = Node::open(join("base"), "base", {{"world", "", {}}, of_base}).value();
  const Transform guess{along_x(2).pose, sigma(0.5)};
  auto object = Node::open(join("object"), "object", {{"object", "world", guess}}).value();
  auto client = Client::open(join("")).value();
  const auto drive = [&](int t) {
    REQUIRE(base.update("base", {along_x(1e-3 * t).pose, sigma(0.05)}, ms(t)));
  };
  drive(1000);
  const auto watch = client.watch("base", "object").value();
  const auto is_same = [&](int at) {
    Query query;
    query.at = ms(at);
    query.extrapolate = ms(50).time_since_epoch();
    const auto expected = client.lookup("base", "object", query).value();
    INFO("at " << at);
    REQUIRE(eventually([&] {
      const auto X = watch.lookup(query);
      return X && testing::transform_diff(*X, expected, 1e-9) == "";
    }));
  };
  for (const int t : {1100, 1200, 1300}) {
    drive(t);
    REQUIRE(eventually([&] {
      const auto X = watch.latest();
      return X && X->stamp == ms(t);
    }));
    is_same(t - 30);
    // An image is older than the newest odometry.
    for (const int seen : {t - 100, t}) {
      const Transform Z{along_x(2.1 - 1e-3 * seen).pose, sigma(0.005)};
      const auto found = client.observe("base", "object", Z, ms(seen));
      REQUIRE(found);
      REQUIRE(found->accepted);
      for (const int at : {seen, t - 30, t - 70}) is_same(at);
      // What it was given tells how it moves. Of other edges, watchers do not know that.
      if (drifts) is_same(t + 30);
    }
  }
}

}  // namespace tfdude
