// Many lookups in one call, and one at many instants: beside single lookups, over each transport.

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/lossy_requests.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::ContainsSubstring;
using testing::Random;
using testing::transform_diff;

constexpr int kSamples = 20;

Time instant(int number) {
  return Time(std::chrono::seconds(1'000'000)) + number * Milliseconds(10);
}

// Three owners: world, its arm, and a hand below the arm. Each has moving and static edges; those
// of different owners have their samples at different instants.
struct Robot {
  explicit Robot(const testing::Join& join, Random& random) {
    const auto frame = [&](const std::string& id, const std::string& parent) {
      return FrameSpec{id, parent, parent.empty() ? Transform() : random.transform()};
    };
    nodes.push_back(Node::open(join("base"), "base",
                               {frame("world", ""), frame("base", "world"), frame("mast", "base")})
                        .value());
    nodes.push_back(
        Node::open(join("arm"), "arm", {frame("arm", "mast"), frame("elbow", "arm")}).value());
    nodes.push_back(
        Node::open(join("hand"), "hand", {frame("hand", "elbow"), frame("tip", "hand")}).value());
    const std::vector<std::string> moving = {"base", "elbow", "hand"};
    for (int k = 0; k < kSamples; ++k) {
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        const Time stamp = instant(k) + std::chrono::milliseconds(i);
        REQUIRE(nodes[i].update(moving[i], random.transform(), stamp));
      }
    }
  }
  std::vector<Node> nodes;
};

const std::vector<FramePair> kPairs = {{"world", "tip"},  {"tip", "world"}, {"base", "elbow"},
                                       {"mast", "hand"},  {"arm", "arm"},   {"elbow", "tip"},
                                       {"world", "base"}, {"mast", "base"}, {"world", "hand"}};

// A client that counts its lookups on the wire, and so reads no memory.
struct Counting {
  explicit Counting(TransportPtr transport)
      : client(Client::open(std::make_unique<testing::LossyRequests>(
                                std::move(transport),
                                [this](const Request& request) {
                                  if (std::holds_alternative<LookupRequest>(request.body)) ++asked;
                                  return false;
                                }),
                            by_requests())
                   .value()) {}
  static ClientOptions by_requests() {
    ClientOptions options;
    options.shared_memory = false;
    return options;
  }
  std::atomic<int> asked{0};
  Client client;
};

}  // namespace

TEST_CASE("many: all pairs are looked up at one instant, with one request to each owner") {
  const auto join = testing::joined_by(GENERATE(from_range(testing::networks())));
  Random random(4601);
  INFO("seed " << random.seed());
  const Robot robot(join, random);
  Counting counting(join(""));
  Client& client = counting.client;
  Query query;
  query.at = instant(7) + Milliseconds(3);
  REQUIRE(client.lookup("world", "tip", query));  // all is discovered
  counting.asked = 0;
  const auto found = client.lookup_many(kPairs, query);
  CHECK(counting.asked == 3);
  REQUIRE(found.size() == kPairs.size());
  for (std::size_t i = 0; i < kPairs.size(); ++i) {
    INFO(kPairs[i].a << " to " << kPairs[i].b);
    REQUIRE(found[i]);
    CHECK(found[i]->stamp == query.at);
    const auto single = client.lookup(kPairs[i].a, kPairs[i].b, query);
    REQUIRE(single);
    CHECK(transform_diff(*found[i], *single, 1e-12) == "");
  }

  // The newest instant that all have is that of the slowest owner, though the others have later
  // samples.
  const auto newest = client.lookup_many("world", {"tip", "base", "mast"});
  Query at;
  at.at = instant(kSamples - 1);
  for (const std::string frame : {"tip", "base", "mast"}) {
    const auto& one = newest[frame == "tip" ? 0 : frame == "base" ? 1 : 2];
    REQUIRE(one);
    CHECK(one->stamp == at.at);
    CHECK(transform_diff(*one, *client.lookup("world", frame, at), 1e-12) == "");
  }
}

TEST_CASE(
    "many: rounds pause for a pair that has an answer, but not at the instant of the others") {
  using namespace std::chrono_literals;
  const auto join = testing::join_loopback();
  Node node = Node::open(join("base"), "base",
                         {{"world", "", {}}, {"old", "world", {}}, {"new", "world", {}}})
                  .value();
  REQUIRE(node.update("old", {}, instant(0)));
  for (int k = 0; k < 5; ++k) REQUIRE(node.update("new", {}, instant(1000 + k)));
  Counting counting(join(""));
  REQUIRE(counting.client.lookup("world", "old"));
  counting.asked = 0;
  const auto begin = std::chrono::steady_clock::now();
  const auto found = counting.client.lookup_many("world", {"new", "old"}, {}, 500ms);
  CHECK(std::chrono::steady_clock::now() - begin >= 500ms);
  CHECK(found[0]);
  REQUIRE_FALSE(found[1]);
  CHECK(found[1].error().code == Errc::kTooOld);
  // Some 16 rounds of a few requests each.
  CHECK(counting.asked < 300);
}

TEST_CASE("many: a pair without an answer has its own error, and does not delay the others") {
  const auto join = testing::join_loopback();
  Random random(4602);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  // Many more frames of one owner, one of which has stopped long ago, and one begins late.
  std::vector<FramePair> pairs;
  for (int i = 0; i < 40; ++i) {
    const std::string id = "finger" + std::to_string(i);
    REQUIRE(robot.nodes[2].add(id, "hand", random.transform()));
    pairs.push_back({"world", id});
  }
  REQUIRE(robot.nodes[2].update("finger7", random.transform(), instant(0) - std::chrono::hours(1)));
  Counting counting(join(""));
  Client& client = counting.client;
  // An owner announces changes a little later.
  REQUIRE(testing::eventually([&] { return client.exists("finger39"); }));
  const auto all = client.lookup_many(pairs);
  for (std::size_t i = 0; i < all.size(); ++i) {
    INFO(i);
    if (i == 7) {
      REQUIRE_FALSE(all[i]);
      CHECK(all[i].error().code == Errc::kTooOld);
      continue;
    }
    // The stopped one does not count for the common instant.
    REQUIRE(all[i]);
    CHECK(all[i]->stamp == instant(kSamples - 1));
  }
  pairs.push_back({"world", "nowhere"});
  pairs.push_back({"nobody", "world"});
  Query query;
  query.at = instant(9);
  const auto some = client.lookup_many(pairs, query);
  REQUIRE(some.size() == 42);
  for (std::size_t i = 0; i < 40; ++i) {
    INFO(i);
    if (i == 7) continue;
    REQUIRE(some[i]);
    const auto single = client.lookup(pairs[i].a, pairs[i].b, query);
    REQUIRE(single);
    CHECK(transform_diff(*some[i], *single, 1e-12) == "");
  }
  REQUIRE_FALSE(some[7]);
  CHECK(some[7].error().code == Errc::kNotYet);
  CHECK_THAT(some[7].error().message, ContainsSubstring("finger7"));
  CHECK(some[40].error().code == Errc::kUnknownEnd);
  CHECK(some[41].error().code == Errc::kUnknownStart);

  // An owner that leaves takes its own pairs only.
  robot.nodes.pop_back();
  const auto left = client.lookup_many({{"world", "tip"}, {"world", "elbow"}}, query);
  REQUIRE_FALSE(left[0]);
  CHECK(left[0].error().code == Errc::kUnreachable);
  CHECK(left[1]);
  CHECK(client.lookup_many(std::vector<FramePair>()).empty());
}

TEST_CASE("many: one edge that nobody updates any more does not keep others from their answer") {
  const auto join = testing::join_loopback();
  Random random(4609);
  INFO("seed " << random.seed());
  const Robot robot(join, random);
  std::vector<FrameSpec> frames = {{"screen", "world", random.transform()}};
  std::vector<FramePair> pairs = {{"world", "tip"}, {"mast", "elbow"}};
  for (int i = 0; i < 20; ++i) {
    frames.push_back({"lamp" + std::to_string(i), "world", random.transform()});
    pairs.push_back({"world", frames.back().id});
  }
  auto lamps = Node::open(join("lamps"), "lamps", frames);
  REQUIRE(lamps);
  REQUIRE(lamps->update("lamp13", random.transform(), instant(0) - std::chrono::hours(1)));
  auto client = Client::open(join(""));
  REQUIRE(client);
  const auto found = client->lookup_many(pairs);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    INFO(pairs[i].b);
    if (pairs[i].b == "lamp13") {
      REQUIRE_FALSE(found[i]);
      CHECK(found[i].error().code == Errc::kTooOld);
      CHECK_THAT(found[i].error().message, ContainsSubstring("'lamps'"));
    } else {
      REQUIRE(found[i]);
      CHECK(found[i]->stamp == instant(kSamples - 1));
    }
  }
}

TEST_CASE("many: edges with shared sources, unspecified ones, and own ones") {
  const auto join = testing::join_loopback();
  Random random(4603);
  INFO("seed " << random.seed());
  Robot robot(join, random);
  Correlation heat;
  heat.common_errors.push_back({"heat", false, random.twist(0.01, 0.01)});
  REQUIRE(robot.nodes[0].correlate("mast", heat));
  REQUIRE(robot.nodes[2].correlate("tip", heat));
  REQUIRE(robot.nodes[1].update("arm", {random.pose(), StatedCovariance()}));
  auto client = Client::open(join(""));
  REQUIRE(client);
  Query query;
  query.at = instant(5);
  for (Client* asker : {&*client, static_cast<Client*>(&robot.nodes[1])}) {
    const auto found = asker->lookup_many(kPairs, query);
    for (std::size_t i = 0; i < kPairs.size(); ++i) {
      INFO(kPairs[i].a << " to " << kPairs[i].b);
      const auto single = client->lookup(kPairs[i].a, kPairs[i].b, query);
      REQUIRE((single && found[i]));
      CHECK(transform_diff(*found[i], *single, 1e-12) == "");
      CHECK(found[i]->basis.sources == single->basis.sources);
      CHECK(found[i]->basis.unspecified == single->basis.unspecified);
    }
  }
}

TEST_CASE("many: a wait ends when all pairs have an answer") {
  const auto join = testing::join_loopback();
  auto base = Node::open(join("base"), "base", {{"world", "", {}}});
  auto client = Client::open(join(""));
  REQUIRE((base && client));
  std::atomic<bool> done{false};
  std::vector<Result<StampedTransform>> found;
  std::thread waits([&] {
    found = client->lookup_many("world", {"hand", "world"}, {}, std::chrono::seconds(20));
    done = true;
  });
  REQUIRE(base->add("hand", "world", Transform::exact({})));
  waits.join();
  REQUIRE(found.size() == 2);
  CHECK((found[0] && found[1]));
}

TEST_CASE("trajectory: each instant as a lookup of its own") {
  const int network = GENERATE(from_range(testing::networks()));
  const auto join = testing::joined_by(network);
  Random random(4604);
  INFO("seed " << random.seed());
  const Robot robot(join, random);
  auto client = Client::open(join(""));
  REQUIRE(client);
  std::vector<Time> instants;
  for (int i = 0; i < 150; ++i) {
    instants.push_back(instant(-3) +
                       std::chrono::microseconds(random.index((kSamples + 6) * 10'000)));
  }
  instants.push_back(instants.front());
  instants.push_back(Time{} - Milliseconds(1));
  instants.push_back(instant(4));
  // Of three owners, of one other, and of an own and others.
  for (const auto& [asker, a, b] :
       {std::tuple<const Client*, std::string, std::string>{&*client, "world", "tip"},
        {&*client, "tip", "elbow"},
        {&robot.nodes[0], "tip", "world"},
        {&robot.nodes[0], "world", "mast"},
        {&*client, "mast", "arm"}}) {
    INFO(a << " to " << b);
    Client& from = const_cast<Client&>(*asker);
    const auto trajectory = from.trajectory(a, b, instants);
    REQUIRE(trajectory);
    REQUIRE(trajectory->X_AB.size() == instants.size());
    std::size_t missing = 0;
    for (const MissingInstants& one : trajectory->missing) missing += one.count;
    std::size_t empty = 0;
    for (std::size_t i = 0; i < instants.size(); ++i) {
      Query query;
      query.at = instants[i];
      const auto single = from.lookup(a, b, query);
      INFO("instant " << i << ": " << nanoseconds(instants[i]));
      REQUIRE(trajectory->X_AB[i].has_value() == single.has_value());
      if (single) {
        CHECK(transform_diff(*trajectory->X_AB[i], *single, 1e-12) == "");
        continue;
      }
      ++empty;
      const auto of_it = std::find_if(
          trajectory->missing.begin(), trajectory->missing.end(),
          [&](const MissingInstants& one) { return i >= one.first && i < one.first + one.count; });
      REQUIRE(of_it != trajectory->missing.end());
      CHECK(of_it->error.code == single.error().code);
    }
    CHECK(empty == missing);
  }
  CHECK(client->trajectory("world", "nowhere", instants).error().code == Errc::kUnknownEnd);
  CHECK(client->trajectory("world", "tip", {})->X_AB.empty());
}

}  // namespace tfdude
