// Time from outside, over each transport.

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/networks.hpp"
#include "support/process.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::Approx;
using testing::ContainsSubstring;
using testing::eventually;
using testing::Join;
using testing::joined_by;
using testing::outcome;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

Query at(Time t) { return {t, 0ns, {}}; }

double x_of(const Result<StampedTransform>& X) {
  return X ? X->pose.translation().x() : std::numeric_limits<double>::quiet_NaN();
}

Options external(Milliseconds timeout = Milliseconds(1000)) {
  Options options;
  options.clock = ClockKind::kExternal;
  options.timeout = timeout;
  return options;
}

NodeOptions dynamic(Options common) {
  NodeOptions options = std::move(common);
  options.history.moving = true;
  return options;
}

// Empty: not known, or the partition is not known yet.
std::optional<ClockKind> clock_of(Client& client, const std::string& partition) {
  const auto partitions = client.partitions();
  REQUIRE(partitions);
  for (const PartitionInfo& one : *partitions) {
    if (one.name == partition) return one.clock;
  }
  return std::nullopt;
}

// A simulation: world -> arm -> hand of two partitions, a client with the external clock, and a
// publisher of the time, which uses the system's clock.
struct Simulation {
  explicit Simulation(const Join& join) {
    base.emplace(Node::open(join("base"), "base", {{"world", "", {}}, {"arm", "world", {}}},
                            dynamic(external()))
                     .value());
    tool.emplace(
        Node::open(join("tool"), "tool", {{"hand", "arm", along_x(1)}}, dynamic(external()))
            .value());
    client.emplace(Client::open(join(""), external()).value());
    publisher.emplace(Client::open(join("")).value());
  }

  // The time may be lost, so it is published until all have it.
  void tell(Time now) {
    REQUIRE(eventually([&] {
      REQUIRE(publisher->publish_clock(external_time(now)));
      const auto has = [now](Client& one) { return one.now() == now; };
      return has(*base) && has(*tool) && has(*client);
    }));
  }

  std::optional<Node> base;
  std::optional<Node> tool;
  std::optional<Client> client;
  std::optional<Client> publisher;
};

TEST_CASE("clock: before the first time, whatever needs the present fails and says so") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node base = Node::open(join("base"), "base", {{"world", "", {}}, {"arm", "world", {}}},
                         dynamic(external(Milliseconds(300))))
                  .value();
  Client client = Client::open(join(""), external(Milliseconds(300))).value();
  for (Client* caller : {static_cast<Client*>(&base), &client}) {
    const auto now = caller->now();
    CHECK(outcome(now) == "not_yet");
    CHECK_THAT(now.error().message, ContainsSubstring("nobody has published the time"));
    const auto unstamped = caller->update("arm", along_x(1));
    CHECK(outcome(unstamped) == "not_yet");
    CHECK_THAT(unstamped.error().message, ContainsSubstring("clock is external"));
    CHECK(outcome(caller->update("arm", along_x(1), ms(5))) == "not_yet");
  }
  CHECK(outcome(base.set_time(external_time(ms(-1)))) == "invalid_input");
  CHECK(outcome(base.publish_clock(external_time(ms(-1)))) == "invalid_input");
  REQUIRE(base.set_time(external_time(ms(0))));
  CHECK(outcome(client.update("arm", along_x(1))) == "ok");
  CHECK(client.lookup("world", "arm", Query{}).value().stamp == ms(0));
  Client other = Client::open(join("")).value();
  CHECK(outcome(other.set_time(external_time(ms(1)))) == "invalid_input");
  CHECK(outcome(other.now()) == "ok");
}

TEST_CASE("clock: unstamped samples and limits follow the published time") {
  Simulation sim(joined_by(GENERATE(from_range(testing::networks()))));
  sim.tell(ms(0));
  REQUIRE(sim.client->update({{"arm", along_x(1)}, {"hand", along_x(10)}}));
  CHECK(sim.client->lookup("world", "hand", Query{}).value().stamp == ms(0));
  // While it stands still, the sample is replaced.
  REQUIRE(sim.base->update("arm", along_x(2)));
  CHECK(sim.base->lookup("world", "arm", Query{}).value().stamp == ms(0));
  CHECK(x_of(sim.client->lookup("world", "arm", Query{})) == Approx(2));
  // Ten seconds at once.
  sim.tell(ms(10'000));
  REQUIRE(sim.client->update({{"arm", along_x(3)}, {"hand", along_x(20)}}));
  CHECK(sim.client->lookup("world", "hand", Query{}).value().stamp == ms(10'000));
  CHECK(x_of(sim.client->lookup("world", "hand", at(ms(5000)))) == Approx(2.5 + 15).epsilon(1e-6));
  CHECK(outcome(sim.client->update("arm", along_x(4), ms(70'001))) == "invalid_input");
  CHECK(outcome(sim.client->update("arm", along_x(4), ms(69'999))) == "ok");
}

TEST_CASE("clock: after a jump back a replay works") {
  Simulation sim(joined_by(GENERATE(from_range(testing::networks()))));
  const auto play = [&](double offset) {
    for (const int t : {0, 1000, 2000}) {
      sim.tell(ms(t));
      REQUIRE(sim.client->update({{"arm", along_x(t + offset)}, {"hand", along_x(0)}}, ms(t)));
    }
    CHECK(x_of(sim.client->lookup("world", "hand", at(ms(1500)))) == Approx(1500 + offset));
  };
  play(0);
  WatchOptions options;
  options.composed = GENERATE(false, true);
  INFO("composed " << options.composed);
  auto watch = sim.client->watch("world", "hand", options);
  REQUIRE(watch);
  CHECK(x_of(watch->latest()) == 2000);
  sim.tell(ms(500));
  // The values are of the future.
  CHECK(outcome(sim.client->lookup("world", "hand", Query{})) == "not_yet");
  CHECK(outcome(sim.base->lookup("world", "arm", at(ms(100)))) == "not_yet");
  CHECK(eventually([&] { return outcome(watch->latest()) == "not_yet"; }));
  // A watch that begins now is told, too.
  const auto other = sim.base->watch("world", "hand", options);
  CHECK(outcome(other ? other->latest() : tl::unexpected(other.error())) == "not_yet");
  play(7);
  CHECK(eventually([&] { return x_of(watch->latest()) == 2007; }));
  // Ownership, structure and static edges stay.
  REQUIRE(sim.client->add("camera", "hand", along_x(3)));
  sim.tell(ms(0));
  CHECK(sim.client->frames().value().size() == 4);
  CHECK(x_of(sim.client->lookup("hand", "camera", Query{})) == 3);
}

TEST_CASE("clock: a participant that starts later has the next time") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Simulation sim(join);
  sim.tell(ms(5000));
  Node late =
      Node::open(join("late"), "late", {{"camera", "hand", {}}}, dynamic(external())).value();
  // The time stands still, and is published again.
  CHECK(eventually([&] {
    REQUIRE(sim.publisher->publish_clock(external_time(ms(5000))));
    return late.now() == ms(5000);
  }));
  REQUIRE(late.update("camera", along_x(2)));
  CHECK(late.lookup("hand", "camera", Query{}).value().stamp == ms(5000));
}

TEST_CASE("clock: a joint has the position of its newest sample after a jump back") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  FrameSpec arm{"arm", "world", {}};
  arm.joint = testing::revolute_named("shoulder");
  Node node = Node::open(join("arm"), "arm", {{"world", "", {}}, arm}, dynamic(external())).value();
  REQUIRE(node.set_time(external_time(ms(9000))));
  REQUIRE(node.update_joints({"shoulder"}, {0.5}, {0}, ms(9000)));
  REQUIRE(node.set_time(external_time(ms(0))));
  CHECK(outcome(node.lookup("world", "arm", Query{})) == "not_yet");
  for (const int t : {0, 10}) {
    REQUIRE(node.update_joints({"shoulder"}, {1 + 0.01 * t}, {0}, ms(t)));
    CHECK(testing::yaw(node.lookup("world", "arm")) == Approx(1 + 0.01 * t));
    CHECK(node.joints("arm").value().front().position == 1 + 0.01 * t);
  }
}

TEST_CASE("clock: each participant says which clock it uses") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node sim =
      Node::open(join("sim"), "sim", {{"world", "", {}}, {"arm", "world", {}}}, dynamic(external()))
          .value();
  Node real = Node::open(join("real"), "real", {{"hand", "arm", along_x(1)}}).value();
  Client client = Client::open(join("")).value();
  for (Client* caller : {static_cast<Client*>(&sim), static_cast<Client*>(&real), &client}) {
    // The kind of the clock comes with the presence, which may be later than the first page.
    CHECK(eventually([&] { return clock_of(*caller, "sim") == ClockKind::kExternal; }));
    CHECK(eventually([&] { return clock_of(*caller, "real") == ClockKind::kSystem; }));
    Result<std::vector<PathSegment>> path;
    REQUIRE(eventually([&] { return (path = caller->path("world", "hand")).has_value(); }));
    REQUIRE(path->size() == 2);
    CHECK((*path)[0].clock == ClockKind::kExternal);
    CHECK((*path)[1].clock == ClockKind::kSystem);
  }
}

TEST_CASE("clock: the present of one clock is not taken for that of another") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node sim =
      Node::open(join("sim"), "sim", {{"world", "", {}}, {"arm", "world", {}}}, dynamic(external()))
          .value();
  Client client = Client::open(join("")).value();
  REQUIRE(sim.set_time(external_time(ms(5000))));
  for (const int t : {4000, 5000}) REQUIRE(sim.update("arm", along_x(t), ms(t)));
  // The clock comes with the presence, which may be later than the first page.
  REQUIRE(eventually([&] { return clock_of(client, "sim") == ClockKind::kExternal; }));
  const auto now = client.lookup("world", "arm", at(client.now().value()));
  CHECK(outcome(now) == "not_yet");
  CHECK_THAT(now.error().message,
             ContainsSubstring("partition 'sim' uses the external clock, and this participant the "
                               "system clock"));
  Query aged;
  aged.age_noise_until = client.now().value();
  const auto noise = client.lookup("world", "arm", aged);
  CHECK(outcome(noise) == "invalid_input");
  CHECK_THAT(noise.error().message, ContainsSubstring("'sim' uses the external clock"));
  CHECK(x_of(client.lookup("world", "arm", at(ms(4500)))) == 4500);
}

TEST_CASE("clock: an owner clears the history of one edge or of all") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Node arm =
      Node::open(join("arm"), "arm", {{"world", "", {}}, {"arm", "world", {}}, {"hand", "arm", {}}})
          .value();
  Node tool = Node::open(join("tool"), "tool", {{"tool", "hand", {}}}).value();
  Client client = Client::open(join("")).value();
  for (const int t : {1000, 2000}) {
    REQUIRE(
        client.update({{"arm", along_x(1)}, {"hand", along_x(2)}, {"tool", along_x(3)}}, ms(t)));
  }
  CHECK(outcome(arm.clear_history("nobody")) == "unknown_frame");
  CHECK(outcome(arm.clear_history("tool")) == "not_owner");
  REQUIRE(arm.clear_history("hand"));
  CHECK(outcome(client.lookup("world", "tool", Query{})) == "not_yet");
  CHECK(x_of(client.lookup("world", "arm", Query{})) == 1);
  // A lookup waits for the next sample.
  auto waiting = client.lookup_async("world", "tool", Query{}, 20s);
  REQUIRE(client.update("hand", along_x(5), ms(2000)));
  CHECK(x_of(waiting.get()) == 9);
  CHECK(arm.clear_history() == 2);
  CHECK(arm.clear_history() == 0);
  CHECK(outcome(client.lookup("world", "arm", Query{})) == "not_yet");
  CHECK(x_of(client.lookup("hand", "tool", Query{})) == 3);
  // Earlier stamps are accepted.
  REQUIRE(client.update({{"arm", along_x(6)}, {"hand", along_x(7)}}, ms(10)));
  CHECK(x_of(client.lookup("world", "hand", Query{})) == 13);
}

}  // namespace
}  // namespace tfdude
