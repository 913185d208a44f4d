// What was believed before, asked of one and of two owners, over each transport.

#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"
#include "tfdude/client/watch.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/pose_diff.hpp"
#include "support/process.hpp"
#include "support/random.hpp"
#include "support/relay.hpp"

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

NodeOptions remembering() {
  NodeOptions options;
  options.history.believed = 60s;
  return options;
}

Query asked(std::optional<Time> at, std::optional<Time> believed_at) {
  Query query;
  query.at = at;
  query.believed_at = believed_at;
  return query;
}

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::nan("");
}

// Two owners of a path from map to hand, of whom one has a static edge, and each a dynamic one.
struct Two {
  explicit Two(const Join& join, std::uint64_t seed)
      : random(seed),
        base(Node::open(join("base"), "base",
                        {{"map", "", {}},
                         {"odom", "map", random.transform()},
                         {"mast", "odom", random.transform()}},
                        remembering())
                 .value()),
        arm(Node::open(
                join("arm"), "arm",
                {{"elbow", "mast", random.transform()}, {"hand", "elbow", random.transform()}},
                remembering())
                .value()),
        client(Client::open(join("")).value()) {
    began = *base.now();
    for (int i = 0; i < 20; ++i) {
      for (const char* id : {"odom", "hand"}) REQUIRE(write(id, began + i * 50ms));
    }
  }

  [[nodiscard]] Result<void> write(const std::string& id, std::optional<Time> stamp) {
    Node& owner = id == "odom" || id == "mast" ? base : arm;
    return owner.update(id, random.transform(), stamp);
  }
  Time instant() { return began + std::chrono::microseconds(random.index(950'000)); }

  /// @return what was done; some is rejected
  std::string change() {
    const std::string dynamic = random.index(2) == 0 ? "odom" : "hand";
    switch (random.index(4)) {
      case 0:
        return "late " + dynamic + ": " + outcome(write(dynamic, instant()));
      case 1: {
        const std::string fixed = random.index(2) == 0 ? "mast" : "elbow";
        return "update " + fixed + ": " + outcome(write(fixed, {}));
      }
      case 2: {
        const Time from = instant();
        const auto done =
            client.rewrite(dynamic, {from, from + 100ms},
                           {{from + 1ms, random.transform()}, {from + 50ms, random.transform()}});
        return "rewrite " + dynamic + ": " + outcome(done);
      }
      default:
        return "observe: " +
               outcome(client.observe("map", "hand", random.transform(), instant(), {1.0, true}));
    }
  }

  Random random;
  Node base;
  Node arm;
  Client client;
  Time began;
};

struct Answer {
  Time at;
  Time believed_at;
  std::string after;
  Result<StampedTransform> X_AB;
};

// Makes an owner answer as one of an earlier version.
class Earlier final : public testing::Relay {
 public:
  using Relay::Relay;

 private:
  void on_request(const PeerId& from, const Request& request) override {
    const auto* lookup = std::get_if<LookupRequest>(&request.body);
    if (lookup == nullptr || !lookup->query.believed_at) return Relay::on_request(from, request);
    Reply reply;
    reply.sequence = request.sequence;
    reply.body = Error{Errc::kUnsupported, "this kind of request is not known to protocol 1.0"};
    real().reply(from, reply);
  }
};

}  // namespace

TEST_CASE("believed: two owners answer again what they answered then") {
  const int transport = GENERATE(from_range(testing::networks()));
  Two two(joined_by(transport), 17);
  INFO("seed " << two.random.seed());
  std::vector<Answer> answers;
  for (int step = 0; step < 60; ++step) {
    const std::string done = two.change();
    const Time believed_at = *two.client.now();
    for (int i = 0; i < 3; ++i) {
      const Time at = two.instant();
      answers.push_back({at, believed_at, done, two.client.lookup("map", "hand", asked(at, {}))});
    }
  }
  const auto compare = [](const Result<StampedTransform>& found, const Answer& one) {
    if (!found || !one.X_AB) {
      CHECK(outcome(found) == outcome(one.X_AB));
      return;
    }
    CHECK(testing::transform_diff(*found, *one.X_AB, 1e-12) == "");
    CHECK(found->stamp == one.X_AB->stamp);
    CHECK(found->basis.sources == one.X_AB->basis.sources);
  };
  int found = 0;
  for (const Answer& one : answers) {
    INFO("after " << one.after);
    const Query query = asked(one.at, one.believed_at);
    compare(two.client.lookup("map", "hand", query), one);
    compare(two.arm.lookup("map", "hand", query), one);
    found += one.X_AB ? 1 : 0;
  }
  CHECK(found > 100);
  // As many lookups, and at many instants.
  const Answer& some = answers[answers.size() / 2];
  const Query query = asked(some.at, some.believed_at);
  compare(two.client.lookup_many("map", {"hand"}, query).at(0), some);
  compare(two.client.lookup_async("map", "hand", query, 1s).get(), some);
  const auto path = two.client.trajectory("map", "hand", {some.at}, query);
  REQUIRE(path);
  REQUIRE(path->X_AB.at(0));
  CHECK(testing::transform_diff(*path->X_AB[0], *some.X_AB, 1e-12) == "");
  const auto over = two.client.lookup("map", query, "hand", query, "mast");
  REQUIRE(over);
  CHECK(testing::pose_diff(over->pose, some.X_AB->pose, 1e-12) == "");
}

TEST_CASE("believed: the latest common time is that of then") {
  Two two(joined_by(GENERATE(from_range(testing::networks()))), 4);
  const Time then = *two.client.now();
  const auto known = two.client.lookup("map", "hand", asked(two.began + 950ms, {}));
  REQUIRE(known);
  for (int i = 20; i < 30; ++i) {
    REQUIRE(two.write("odom", two.began + i * 50ms));
    REQUIRE(two.write("hand", two.began + i * 50ms));
  }
  const auto X = two.client.lookup("map", "hand", asked({}, then));
  REQUIRE(X);
  CHECK(X->stamp == two.began + 950ms);
  CHECK(testing::transform_diff(*X, *known, 1e-12) == "");
  REQUIRE(eventually([&] {
    const auto now = two.client.lookup("map", "hand", Query());
    return now && now->stamp == two.began + 1450ms;
  }));
}

TEST_CASE("believed: who asks is told at once what can never be answered") {
  Two two(joined_by(GENERATE(from_range(testing::networks()))), 5);
  const Time now = *two.client.now();
  const auto began = std::chrono::steady_clock::now();
  const auto early = two.client.lookup("map", "hand", asked({}, two.began - 10min), 30s);
  CHECK(outcome(early) == "too_old");
  CHECK_THAT(early.error().message,
             ContainsSubstring("partition '") && ContainsSubstring("the edge of '"));
  CHECK(outcome(two.client.lookup("map", "hand", asked({}, Time() - 1s))) == "too_old");
  const auto late = two.client.lookup("map", "hand", asked(now + 1h, now), 30s);
  CHECK(outcome(late) == "not_yet");
  CHECK(outcome(two.client.lookup("map", "hand", asked({}, now + 1h), 30s)) == "not_yet");
  CHECK(std::chrono::steady_clock::now() - began < 20s);
}

TEST_CASE("believed: a watch has no answer of now instead") {
  Two two(joined_by(GENERATE(from_range(testing::networks()))), 6);
  const Time then = *two.client.now();
  auto watch = two.client.watch("map", "hand");
  REQUIRE(watch);
  REQUIRE(eventually([&] { return watch->lookup(asked(two.began + 500ms, {})).has_value(); }));
  CHECK_FALSE(watch->lookup(asked(two.began + 500ms, then)));
  CHECK_FALSE(watch->lookup(asked({}, then)));
}

TEST_CASE("believed: an owner of an earlier version is named, and gives no answer of now") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const Node base = Node::open(join("base"), "base", {{"map", "", {}}, {"odom", "map", along_x(1)}},
                               remembering())
                        .value();
  const Node arm = Node::open(std::make_unique<Earlier>(join("arm")), "arm",
                              {{"hand", "odom", along_x(1)}}, remembering())
                       .value();
  auto client = Client::open(join("")).value();
  REQUIRE(eventually([&] { return x_of(client.lookup("map", "hand", Query())) == 2; }));
  const auto X = client.lookup("map", "hand", asked({}, client.now().value()));
  CHECK(outcome(X) == "unsupported");
  CHECK_THAT(X.error().message, ContainsSubstring("partition 'arm'"));
  CHECK(X.error().partition == "arm");
  CHECK(x_of(client.lookup("map", "odom", asked({}, client.now().value()))) == 1);
}

TEST_CASE("believed: partitions that remember nothing say which edge that is") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  auto base =
      Node::open(join("base"), "base", {{"map", "", {}}, {"odom", "map", along_x(1)}}).value();
  auto client = Client::open(join("")).value();
  const auto X = client.lookup("map", "odom", asked({}, client.now().value()));
  CHECK(outcome(X) == "too_old");
  CHECK_THAT(X.error().message, ContainsSubstring("partition 'base': the edge of 'odom'") &&
                                    ContainsSubstring("`believed`"));
}

}  // namespace tfdude
