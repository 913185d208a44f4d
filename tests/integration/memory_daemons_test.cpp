// Lookups in the memory of daemons, compared with lookups over DDS.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <set>
#include <string>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/test_domain.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using testing::eventually;
using testing::outcome;
using testing::Random;
using testing::ThesisDaemons;
using testing::transform_diff;

Time at_ms(std::int64_t ms) { return time_of(1'700'000'000'000'000'000 + ms * 1'000'000); }

PartitionInfo partition(Client& client, const std::string& name) {
  const auto all = client.partitions().value();
  for (const PartitionInfo& one : all) {
    if (one.name == name) return one;
  }
  return {};
}

bool all_in_memory(Client& client) {
  client.find_memory();
  const auto all = client.partitions().value();
  return std::all_of(all.begin(), all.end(),
                     [](const PartitionInfo& one) { return one.in_memory; });
}

// Two daemons, and two clients, of which the second asks over DDS.
struct Two : ThesisDaemons {
  Client memory = Client::open(domain.options()).value();
  Client dds = Client::open([this] {
                 Options options = domain.options();
                 options.shared_memory = false;
                 return options;
               }())
                   .value();
};

}  // namespace

TEST_CASE("memory: the first lookup attaches the owner, and partitions() says so") {
  Two d;
  CHECK_FALSE(partition(d.memory, "arms").in_memory);
  const std::string how = GENERATE("lookup", "wait", "many", "trajectory");
  CAPTURE(how);
  REQUIRE(eventually([&] {
    if (how == "wait") {
      return d.memory.lookup_async("world", "hand_left", {}, std::chrono::seconds(20))
          .get()
          .has_value();
    }
    if (how == "many") return d.memory.lookup_many({{"world", "hand_left"}}, {})[0].has_value();
    if (how == "lookup") return d.memory.lookup("world", "hand_left").has_value();
    const auto all = d.memory.trajectory("world", "hand_left", {at_ms(0)});
    return all && all->missing.empty();
  }));
  CHECK(eventually([&] { return partition(d.memory, "arms").in_memory; }));
  CHECK(partition(d.memory, "arms").why_not_in_memory.empty());
  REQUIRE(d.dds.lookup("world", "hand_left"));
  CHECK(partition(d.dds, "arms").why_not_in_memory == "it is switched off here");
  const auto shown = d.domain.cli({"partitions"});
  CHECK_THAT(shown.out, testing::ContainsSubstring("lookups read its memory"));
  const auto off = d.domain.cli({"--no-shared-memory", "partitions"});
  CHECK_THAT(off.out,
             testing::ContainsSubstring("lookups ask it over DDS: it is switched off here"));
}

TEST_CASE("memory: answers are those over DDS, and what was acknowledged is seen at once") {
  Two d;
  Random random(11);
  INFO("seed " << random.seed());
  REQUIRE(eventually([&] { return all_in_memory(d.memory); }));
  std::vector<std::string> ids;
  const auto frames = d.memory.frames().value();
  for (const Frame& frame : frames) ids.push_back(frame.id);
  const auto any = [&]() -> const std::string& { return ids[random.index(ids.size())]; };
  std::int64_t now = 1000;
  int made = 0;
  int answers = 0;
  int correlated = 0;
  std::set<std::string> with_common;
  for (int step = 0; step < 300; ++step) {
    const std::string changed = any();
    const std::size_t dice = random.index(24);
    std::optional<Transform> written;
    if (dice == 0) {
      const std::string id = "new " + std::to_string(made++);
      if (d.memory.add(id, changed, random.transform())) ids.push_back(id);
    } else if (dice == 1) {
      (void)d.memory.move(changed, any());
    } else if (dice < 12) {
      const Transform X = random.transform();
      if (d.dds.update(changed, X, at_ms(now += 1 + static_cast<std::int64_t>(random.index(5))))) {
        written = X;
      }
    } else if (dice > 21) {
      (void)d.dds.observe(changed, any(), random.transform(2.0, 1.0, 1.0));
    } else if (dice > 19) {
      const bool unknown = random.index(3) == 0;
      const CommonError common{"source " + std::to_string(random.index(3)), false,
                               random.loading(2, 0.003)};
      with_common.insert(changed);
      (void)d.dds.correlate(changed, {unknown, {common}, {}});
    } else {
      const Transform X = random.transform();
      const std::int64_t late = dice < 15 ? static_cast<std::int64_t>(random.index(30)) : 0;
      (void)d.dds.update(changed, X, at_ms(now - late));
    }
    if (written) {
      const auto parent = d.memory.parent(changed).value();
      const auto seen =
          parent.empty() ? written : d.memory.lookup(parent, changed).value().transform();
      CHECK(testing::pose_diff(seen->pose, written->pose, 1e-12) == "");
      if (with_common.count(changed) == 0) CHECK(transform_diff(*seen, *written, 1e-12) == "");
    }
    for (int i = 0; i < 3; ++i) {
      const std::string a = any();
      const std::string b = any();
      Query query;
      if (random.index(3) > 0) {
        query.at = at_ms(now - 40 + static_cast<std::int64_t>(random.index(60)));
      }
      if (random.index(3) == 0) query.extrapolate = std::chrono::milliseconds(random.index(40));
      if (random.index(5) == 0) query.order = Order::kFourth;
      CAPTURE(step, a, b, query.extrapolate.count(), static_cast<int>(query.order), now);
      CAPTURE(query.at ? nanoseconds(*query.at) : 0);
      // The other client may not know the structure yet.
      std::string differs;
      CHECK(eventually([&] {
        const auto found = d.memory.lookup(a, b, query);
        auto expected = d.dds.lookup(a, b, query);
        // Over DDS it may be a predicted instant, up to two periods before the latest common one.
        if (found && expected && !query.at && found->stamp > expected->stamp) {
          Query then = query;
          then.at = found->stamp;
          expected = d.dds.lookup(a, b, then);
        }
        differs = outcome(found) == outcome(expected) ? "" : outcome(found);
        if (!found || !expected) return differs.empty();
        differs = transform_diff(*found, *expected, 1e-9, 1e-7);
        ++answers;
        if (!found->basis.sources.empty()) ++correlated;
        return differs.empty() && found->stamp == expected->stamp &&
               found->basis.unspecified == expected->basis.unspecified &&
               found->basis.sources == expected->basis.sources &&
               found->basis.bound == expected->basis.bound;
      }));
      REQUIRE(differs == "");
    }
  }
  CHECK(answers > 200);
  CHECK(correlated > 50);
  CHECK(all_in_memory(d.memory));
}

TEST_CASE("memory: a watched path keeps the last values of an owner that dies, and goes on after") {
  Two d;
  REQUIRE(eventually([&] { return all_in_memory(d.memory); }));
  REQUIRE(d.dds.update("hand_left", testing::along_x(3)));
  auto watch = d.memory.watch("world", "hand_left").value();
  const auto before = watch.latest();
  REQUIRE(before);
  d.arms->kill();
  REQUIRE(eventually([&] { return !watch.health(); }));
  CHECK(watch.health().error().code == Errc::kUnreachable);
  REQUIRE(watch.latest());
  CHECK(transform_diff(*watch.latest(), *before, 1e-12) == "");
  CHECK(outcome(d.memory.lookup("world", "hand_left")) == "unreachable");
  d.arms.emplace(d.domain.serve(testing::kArmsFile));
  // While it returns, there always is a value.
  bool always = true;
  REQUIRE(eventually([&] {
    always = always && watch.latest().has_value();
    return watch.health().has_value();
  }));
  CHECK(always);
  REQUIRE(eventually([&] { return d.dds.update("hand_left", testing::along_x(4)).has_value(); }));
  const auto parent = d.dds.parent("hand_left").value();
  CHECK(eventually([&] {
    const auto now = watch.latest();
    const auto expected = d.dds.lookup("world", "hand_left");
    return now && expected && transform_diff(*now, *expected, 1e-9, 1e-7).empty();
  }));
  CHECK(eventually([&] { return all_in_memory(d.memory); }));
  CHECK(testing::x_of(d.dds.lookup(parent, "hand_left")) == 4);
}

TEST_CASE("memory: a watched path keeps as much as it was asked to, wherever it is read") {
  testing::TestDomain domain;
  FrameSpec tool{"tool", "base", {}};
  tool.timing = EdgeTiming();
  tool.timing->span = std::chrono::seconds(2);
  tool.timing->max_ahead = std::chrono::nanoseconds::max();
  Node node = Node::open("arm", {{"base", "", {}}, tool}, domain.options()).value();
  Client client = Client::open(domain.options()).value();
  REQUIRE(eventually([&] { return all_in_memory(client); }));
  WatchOptions options;
  options.timing.span = std::chrono::seconds(60);
  auto watch = client.watch("base", "tool", options).value();
  auto plain = client.watch("base", "tool").value();
  for (int s = 0; s <= 20; ++s) {
    REQUIRE(node.update("tool", testing::along_x(s), at_ms(1000 * s)));
    REQUIRE(eventually([&] { return watch.latest() && testing::x_of(watch.latest()) == s; }));
  }
  Query early;
  early.at = at_ms(5000);
  CHECK(testing::x_of(watch.lookup(early)) == 5);
  // That of its owner, in whose memory it is read.
  CHECK(outcome(plain.lookup(early)) == "too_old");
}

TEST_CASE("memory: a killed owner is unreachable at once, and its next process is read again") {
  Two d;
  REQUIRE(eventually([&] { return all_in_memory(d.memory); }));
  REQUIRE(d.memory.lookup("world", "hand_left"));
  d.arms->kill();
  const auto killed = std::chrono::steady_clock::now();
  std::optional<Error> error;
  while (!error) {
    const auto asked = d.memory.lookup("world", "hand_left");
    if (!asked) error = asked.error();
  }
  const auto known = std::chrono::steady_clock::now() - killed;
  const double known_ms = std::chrono::duration<double, std::milli>(known).count();
  CAPTURE(known_ms);
  CHECK(error->code == Errc::kUnreachable);
  CHECK(known < std::chrono::milliseconds(300));  // 450 over DDS
  d.arms.emplace(d.domain.serve(testing::kArmsFile));
  REQUIRE(eventually([&] { return d.memory.lookup("world", "hand_left").has_value(); }));
  CHECK(eventually([&] { return all_in_memory(d.memory); }));
  REQUIRE(d.dds.update("hand_left", testing::along_x(3)));
  const auto parent = d.memory.parent("hand_left").value();
  CHECK(testing::x_of(d.memory.lookup(parent, "hand_left")) == 3);
}

TEST_CASE("memory: the last values of an owner that died are there for who asks for them") {
  Two d;
  REQUIRE(eventually([&] { return all_in_memory(d.memory); }));
  REQUIRE(d.dds.update("hand_left", testing::along_x(3)));
  Query last;
  last.last_known = true;
  const auto before = d.memory.lookup("world", "hand_left", last);
  REQUIRE(before);
  CHECK(before->basis.lost.empty());
  d.arms->kill();
  REQUIRE(
      eventually([&] { return outcome(d.memory.lookup("world", "hand_left")) == "unreachable"; }));
  CHECK(outcome(d.memory.lookup("world", "hand_left", Query{})) == "unreachable");
  const auto after = d.memory.lookup("world", "hand_left", last);
  REQUIRE(after);
  CHECK(transform_diff(*after, *before, 1e-12) == "");
  REQUIRE(after->basis.lost.size() == 1);
  CHECK(after->basis.lost[0].partition == "arms");
  CHECK(after->basis.lost[0].ago < std::chrono::seconds(30));
  const auto later = d.memory.lookup("world", "hand_left", last);
  REQUIRE(later);
  CHECK(later->basis.lost[0].ago > after->basis.lost[0].ago);
  // A client that has not read the memory has nothing.
  CHECK(outcome(d.dds.lookup("world", "hand_left", last)) == "unreachable");
  // What is known of the next process counts.
  d.arms.emplace(d.domain.serve(testing::kArmsFile));
  CHECK(eventually([&] {
    const auto now = d.memory.lookup("world", "hand_left", last);
    return now && now->basis.lost.empty();
  }));
}

TEST_CASE("memory: an owner that hangs is lost as over DDS, and is read again when it goes on") {
  Two d;
  REQUIRE(eventually([&] { return all_in_memory(d.memory); }));
  d.arms->freeze();
  REQUIRE(eventually([&] {
    const auto asked = d.memory.lookup("world", "hand_left");
    return !asked && asked.error().code == Errc::kUnreachable;
  }));
  d.arms->signal(SIGCONT);
  REQUIRE(eventually([&] { return d.memory.lookup("world", "hand_left").has_value(); }));
  CHECK(eventually([&] { return all_in_memory(d.memory); }));
}

TEST_CASE("memory: an owner that stops is not taken for a dead one") {
  Two d;
  REQUIRE(eventually([&] { return all_in_memory(d.memory); }));
  d.arms->signal(SIGTERM);
  REQUIRE(eventually([&] { return !partition(d.memory, "arms").reachable; }));
  CHECK(partition(d.memory, "arms").stopped);
}

TEST_CASE("memory: velocities, two instants and many are those over DDS, and ask nobody") {
  Two d;
  Random random(15);
  INFO("seed " << random.seed());
  REQUIRE(eventually([&] { return all_in_memory(d.memory); }));
  // Of two owners, and one edge that is on both ways.
  const std::vector<std::string> moving{"robot_1", "arm_1", "hand_left"};
  REQUIRE(d.dds.correlate("robot_2", {false, {{"supply", false, random.loading(2, 0.003)}}, {}}));
  // What turns by more than half a turn has no velocity.
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < moving.size(); ++i) poses.push_back(random.pose(1.0));
  for (int ms = 0; ms < 200; ms += 10) {
    for (std::size_t i = 0; i < moving.size(); ++i) {
      poses[i] = poses[i] * tfdude::exp(random.twist(0.2, 0.1));
      const Transform X{poses[i], random.covariance(0.1, 0.01)};
      REQUIRE(d.dds.update(moving[i], X, at_ms(1000 + ms)));
    }
  }
  const auto asks = [&](Client& client, int i) {
    VelocityQuery query;
    query.over = std::chrono::milliseconds(20 + i);
    query.at = at_ms(1050 + 5 * i);
    return client.velocity("world", "hand_left", query);
  };
  const auto asks_two = [&](Client& client, int i) {
    Query then;
    Query now;
    then.at = at_ms(1020 + i);
    now.at = at_ms(1100 + 3 * i);
    return client.lookup("hand_left", then, "robot_2", now, "world");
  };
  for (int i = 0; i < 20; ++i) {
    CAPTURE(i);
    const Velocity found = asks(d.memory, i).value();
    const Velocity expected = asks(d.dds, i).value();
    CHECK((found.linear - expected.linear).norm() < 1e-9);
    CHECK((found.angular - expected.angular).norm() < 1e-9);
    const Matrix6d sigma = expected.covariance.of_specified().matrix();
    CHECK((found.covariance.of_specified().matrix() - sigma).norm() <= 1e-7 * sigma.norm());
    CHECK(found.covariance.complete() == expected.covariance.complete());
    CHECK(found.basis.sources == expected.basis.sources);
    CHECK(found.basis.bound == expected.basis.bound);
    const StampedTransform two = asks_two(d.memory, i).value();
    const StampedTransform two_expected = asks_two(d.dds, i).value();
    CHECK(transform_diff(two, two_expected, 1e-9, 1e-7) == "");
    CHECK(two.basis.bound == two_expected.basis.bound);
  }
  // Some are outside of what is kept.
  std::vector<Time> instants;
  for (int ms = 980; ms < 1210; ms += 3) instants.push_back(at_ms(ms));
  const auto many = d.memory.trajectory("world", "hand_left", instants).value();
  const auto many_expected = d.dds.trajectory("world", "hand_left", instants).value();
  CHECK(many.missing.size() == many_expected.missing.size());
  for (std::size_t i = 0; i < instants.size(); ++i) {
    CAPTURE(i);
    REQUIRE(many.X_AB[i].has_value() == many_expected.X_AB[i].has_value());
    if (!many.X_AB[i]) continue;
    CHECK(transform_diff(*many.X_AB[i], *many_expected.X_AB[i], 1e-9, 1e-7) == "");
  }
  instants.resize(40);
  instants.erase(instants.begin(), instants.begin() + 8);
  // Over DDS there would be no answer: it is not counted as lost before 450 ms.
  REQUIRE(asks_two(d.memory, 0));
  REQUIRE(d.memory.velocity("world", "arm_1"));
  d.arms->freeze();
  CHECK(asks_two(d.memory, 0));
  CHECK(d.memory.velocity("world", "arm_1"));
  CHECK(d.memory.trajectory("world", "hand_left", instants));
  d.arms->signal(SIGCONT);
  REQUIRE(eventually([&] { return d.dds.lookup("world", "arm_1").has_value(); }));
  // What the owner has made up tells no velocity, and it is the owner who says so.
  REQUIRE(d.dds.update("hand_left", random.transform()));
  CHECK(outcome(d.memory.velocity("world", "hand_left")) ==
        outcome(d.dds.velocity("world", "hand_left")));
}

TEST_CASE("memory: of a path over an owner that must be asked, the rest is read") {
  testing::TestDomain domain;
  auto robot = domain.start_daemon({"--config", testing::kRobotFile, "--no-shared-memory"});
  auto arms = domain.start_daemon({"--config", testing::kArmsFile});
  testing::await_ready(robot);
  testing::await_ready(arms);
  auto memory = Client::open(domain.options()).value();
  Options asking = domain.options();
  asking.shared_memory = false;
  auto dds = Client::open(asking).value();
  Random random(14);
  INFO("seed " << random.seed());
  REQUIRE(eventually([&] {
    memory.find_memory();
    return partition(memory, "arms").in_memory;
  }));
  CHECK_FALSE(partition(memory, "robot").in_memory);
  for (int i = 0; i < 50; ++i) {
    REQUIRE(dds.update(i % 2 == 0 ? "hand_left" : "arm_1", random.transform(), at_ms(1000 + i)));
    Query query;
    if (i > 10 && i % 3 == 0) query.at = at_ms(1000 + i - 5);
    const auto found = memory.lookup("world", "hand_left", query);
    const auto expected = dds.lookup("world", "hand_left", query);
    CAPTURE(i, outcome(found), outcome(expected));
    REQUIRE(outcome(found) == outcome(expected));
    if (!found) continue;
    CHECK(transform_diff(*found, *expected, 1e-9, 1e-7) == "");
    CHECK(found->stamp == expected->stamp);
  }
  // Over DDS there would be no answer: it is not counted as lost before 450 ms.
  REQUIRE(memory.lookup("world", "hand_left"));
  arms.freeze();
  CHECK(memory.lookup("world", "hand_left"));
  arms.signal(SIGCONT);
}

TEST_CASE("memory: an owner that lets nobody read is asked over DDS") {
  testing::TestDomain domain;
  auto arms = domain.start_daemon({"--config", testing::kArmsFile, "--no-shared-memory"});
  testing::await_ready(arms);
  auto client = Client::open(domain.options()).value();
  REQUIRE(eventually([&] { return client.lookup("arm_1", "hand_left").has_value(); }));
  CHECK(eventually(
      [&] { return partition(client, "arms").why_not_in_memory == "it is switched off there"; }));
}

}  // namespace tfdude
