// Changes that a participant makes to its own frames and to those of others.

#include "runtime/writes.hpp"

#include <string>
#include <thread>
#include <vector>

#include "support/captured_log.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::outcome;
using testing::Rig;
using testing::ScriptedOwner;
using testing::x_of;

struct Writer : Rig {
  explicit Writer(LoopbackNetwork& network) : Rig(network.join()), writes(context) {}
  Writes writes;
};

const std::vector<FrameSpec> kArm{{"arm", "", {}}, {"hand", "arm", {}}};
const std::vector<FrameSpec> kLeg{{"leg", "", {}}, {"foot", "leg", {}}};

/// One of two owners is never discovered, the other one only after a while.
class Unmet final : public testing::Relay {
 public:
  Unmet(TransportPtr real, std::string never, Deadline met)
      : Relay(std::move(real)), never_(std::move(never)), met_(met) {}

  using Relay::send;
  Result<void> send(const std::string& partition, const Update& update,
                    Deadline deadline) override {
    auto met = await(partition, deadline);
    return met ? Relay::send(partition, update, deadline) : met;
  }
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    auto met = await(partition, deadline);
    return met ? Relay::send(partition, request, deadline) : met;
  }

 private:
  Result<void> await(const std::string& partition, Deadline deadline) const {
    const bool in_time = partition != never_ && met_ <= deadline;
    std::this_thread::sleep_until(in_time ? met_ : deadline);
    if (in_time || (partition != never_ && met_ <= Deadline::clock::now())) return {};
    return fail(Errc::kTimeout, partition + " was not met");
  }

  const std::string never_;
  const Deadline met_;
};

}  // namespace

TEST_CASE("writes: reachable owners get their part while another is not discovered") {
  const bool as_request = GENERATE(false, true);
  for (const std::string never : {"arm", "leg"}) {
    LoopbackNetwork network;
    ScriptedOwner arm(network, "arm", kArm);
    ScriptedOwner leg(network, "leg", kLeg);
    const auto start = Deadline::Clock::now();
    Options options = testing::quick();
    options.timeout = 2000ms;
    Rig rig(std::make_unique<Unmet>(network.join(), never, start + 50ms), "", options);
    Writes writes(rig.context);
    REQUIRE(rig.discovery.await(rig.deadline()));
    Result<void> sent;
    std::thread sender([&] {
      const std::vector<EdgeUpdate> both{{"hand", along_x(5)}, {"foot", along_x(5)}};
      sent = as_request ? writes.update(both, std::nullopt) : writes.publish(both, std::nullopt);
    });
    const auto arrived = [&] {
      return x_of(never == "arm" ? leg.node().lookup("leg", "foot")
                                 : arm.node().lookup("arm", "hand")) == 5;
    };
    while (!arrived() && Deadline::Clock::now() - start < 10s) std::this_thread::yield();
    CHECK(Deadline::Clock::now() - start < options.timeout / 2);
    sender.join();
    REQUIRE(outcome(sent) == "timeout");
    CHECK_THAT(sent.error().message, ContainsSubstring(never));
  }
}

TEST_CASE("writes: frames of others are added and moved and removed at their owner") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm);
  Writer writer(network);
  REQUIRE(writer.writes.add("finger", {"hand", along_x(1)}, ""));
  CHECK(x_of(arm.node().lookup("hand", "finger")) == 1);
  REQUIRE(writer.writes.move("finger", {"arm", along_x(2)}));
  CHECK(x_of(arm.node().lookup("arm", "finger")) == 2);
  CHECK(writer.structure.forest.info("finger")->parent == "arm");
  REQUIRE(writer.writes.remove("finger"));
  CHECK_FALSE(arm.node().exists("finger"));
  CHECK(outcome(writer.writes.remove("finger")) == "unknown_frame");
  CHECK(outcome(writer.writes.add("toe", {"foot", {}}, "")) == "unknown_parent");
}

TEST_CASE("writes: a removal succeeds if another participant has just removed the frame") {
  LoopbackNetwork network;
  ScriptedOwner* owner = nullptr;
  std::thread other;
  bool removed = false;
  ScriptedOwner arm(
      network, "arm", kArm, [&](Transport& transport, const PeerId& from, const Request& request) {
        other = std::thread([&] { removed = owner->node().remove("hand").has_value(); });
        transport.reply(from, {request.sequence, 0, Error{Errc::kNotOwner, "not mine"}});
        return true;
      });
  owner = &arm;
  Writer writer(network);
  CHECK(outcome(writer.writes.remove("hand")) == "ok");
  other.join();
  CHECK(removed);
  CHECK(arm.asked() == 1);
}

TEST_CASE("writes: each owner applies its part of an update") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm);
  ScriptedOwner leg(network, "leg", kLeg);
  Writer writer(network);
  REQUIRE(writer.writes.update(std::vector<EdgeUpdate>{{"hand", along_x(1)}, {"foot", along_x(2)}},
                               std::nullopt));
  CHECK(x_of(arm.node().lookup("arm", "hand")) == 1);
  CHECK(x_of(leg.node().lookup("leg", "foot")) == 2);
  PartialUpdate rest;
  rest.id = "foot";
  rest.X_PC.covariance = Covariance::trusted(Matrix6d(0.01 * Matrix6d::Identity()));
  REQUIRE(writer.writes.update_partial({rest}, std::nullopt));
  CHECK(x_of(leg.node().lookup("leg", "foot")) == 2);
}

TEST_CASE("writes: reachable owners get published values and the error names the lost one") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm);
  ScriptedOwner leg(network, "leg", kLeg);
  Writer writer(network);
  const std::vector<EdgeUpdate> both{{"hand", along_x(1)}, {"foot", along_x(2)}};
  REQUIRE(writer.writes.publish(both, std::nullopt));
  CHECK(x_of(leg.node().lookup("leg", "foot")) == 2);
  leg.leave();
  const auto sent = writer.writes.publish(
      std::vector<EdgeUpdate>{{"hand", along_x(3)}, {"foot", along_x(3)}}, std::nullopt);
  CHECK(outcome(sent) == "unreachable");
  CHECK_THAT(sent.error().message, ContainsSubstring("'leg'"));
  CHECK(x_of(arm.node().lookup("arm", "hand")) == 3);
}

TEST_CASE("writes: a correlation is checked before it is sent to the owner") {
  LoopbackNetwork network;
  const ScriptedOwner arm(network, "arm", kArm);
  Writer writer(network);
  Correlation correlation;
  correlation.common_errors.push_back({"camera", false, Matrix6d(1e-3 * Matrix6d::Identity())});
  const int before = arm.asked();
  CHECK(writer.writes.correlate("hand", correlation));
  const int asked = arm.asked();
  CHECK(asked > before);  // more than once if the reply is late
  correlation.common_errors.push_back(correlation.common_errors.front());
  CHECK(outcome(writer.writes.correlate("hand", correlation)) == "invalid_input");
  CHECK(outcome(writer.writes.correlate("foot", {})) == "unknown_frame");
  CHECK(arm.asked() == asked);
}

TEST_CASE("writes: an unreachable partition is forgotten by all reachable participants") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm);
  ScriptedOwner leg(network, "leg", kLeg);
  Writer writer(network);
  REQUIRE(writer.discovery.await(Deadline(10s)));
  CHECK(outcome(writer.writes.forget("leg")) == "partition_taken");
  CHECK(outcome(writer.writes.forget("tail")) == "unknown_partition");
  leg.leave();
  REQUIRE(writer.writes.forget("leg"));
  CHECK_FALSE(writer.structure.forest.exists("foot"));
  CHECK_FALSE(arm.node().exists("foot"));
  // No other participant is left that could tell the partition when it returns.
  arm.leave();
  CHECK(outcome(writer.writes.forget("arm")) == "unreachable");
  CHECK(writer.structure.forest.exists("hand"));
}

TEST_CASE("writes: who may tell one owner that a partition is gone need not be able to tell all") {
  LoopbackNetwork network;
  bool denies_all = false;
  const auto deny = [](Transport& transport, const PeerId& from, const Request& request) {
    transport.reply(from, {request.sequence, 0, Error{Errc::kNotPermitted, "not yours"}});
    return true;
  };
  ScriptedOwner arm(network, "arm", kArm, [&](Transport& t, const PeerId& from, const Request& r) {
    return denies_all && deny(t, from, r);
  });
  const ScriptedOwner eye(network, "eye", {}, deny);
  ScriptedOwner leg(network, "leg", kLeg);
  Writer writer(network);
  REQUIRE(writer.discovery.await(Deadline(10s)));
  leg.leave();
  SECTION("one is told") {
    REQUIRE(writer.writes.forget("leg"));
    CHECK_FALSE(writer.structure.forest.exists("foot"));
    CHECK_FALSE(arm.node().exists("foot"));
  }
  SECTION("none is told") {
    denies_all = true;
    CHECK(outcome(writer.writes.forget("leg")) == "not_permitted");
    CHECK(writer.structure.forest.exists("foot"));
  }
}

TEST_CASE("writes: nobody waits for the structure of a partition without frames") {
  LoopbackNetwork network;
  const ScriptedOwner idle(network, "idle", {});
  ScriptedOwner leg(network, "leg", kLeg);
  Writer writer(network);
  REQUIRE(writer.discovery.await(Deadline(10s)));
  leg.leave();
  const testing::CapturedLog log;
  REQUIRE(writer.writes.forget("leg"));
  CHECK(log.count("has not arrived here") == 0);
}

}  // namespace tfdude
