// Requests to owners, sent and planned again under one deadline.

#include "runtime/requests.hpp"

#include <chrono>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "partition/routing.hpp"
#include "runtime/descriptions.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/joint_frames.hpp"
#include "support/process.hpp"
#include "support/replica.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::ContainsSubstring;
using testing::outcome;
using testing::Rig;
using testing::ScriptedOwner;

const std::vector<FrameSpec> kArm{{"arm", "", {}}, {"hand", "arm", {}}};
constexpr std::uint64_t kFarEpoch = std::uint64_t{1} << 62U;  // that is never reached

/// To add "finger" below the hand.
Result<void> add_finger(Rig& rig, const Deadline& deadline) {
  return rig.requests.change(deadline, {}, [&](const Directory& directory) {
    return route_add(rig.structure.forest, directory, "finger", AddRequest{"hand", along_x(1)}, "");
  });
}

}  // namespace

TEST_CASE("requests: a request is sent until its reply comes and applied once") {
  LoopbackNetwork network;
  int lost = 0;
  ScriptedOwner arm(network, "arm", kArm,
                    [&](Transport&, const PeerId&, const Request&) { return lost++ < 3; });
  Rig rig(network.join());
  REQUIRE(add_finger(rig, rig.deadline()));
  CHECK(arm.asked() >= 4);
  // Known here as soon as it is acknowledged.
  CHECK(rig.structure.forest.exists("finger"));
  CHECK(arm.node().own_frames() == 3);
}

TEST_CASE("requests: a time-out names the owner and how often it was asked") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm,
                    [](Transport&, const PeerId&, const Request&) { return true; });
  Rig rig(network.join());
  const auto start = Deadline::Clock::now();
  const auto added = add_finger(rig, Deadline(50ms));
  CHECK(Deadline::Clock::now() - start >= 50ms);
  REQUIRE(outcome(added) == "timeout");
  CHECK_THAT(added.error().message, ContainsSubstring("'arm'") &&
                                        ContainsSubstring("asked " + std::to_string(arm.asked())));
}

TEST_CASE("requests: a request fails at once if its owner leaves") {
  LoopbackNetwork network;
  ScriptedOwner* owner = nullptr;
  std::thread leaving;
  ScriptedOwner arm(network, "arm", kArm, [&](Transport&, const PeerId&, const Request&) {
    if (!leaving.joinable()) leaving = std::thread([&] { owner->leave(); });
    return true;
  });
  owner = &arm;
  Rig rig(network.join());
  const auto added = add_finger(rig, Deadline(30s));
  leaving.join();
  CHECK(outcome(added) == "unreachable");
}

TEST_CASE("requests: a request fails with not_owner after a limited number of attempts") {
  LoopbackNetwork network;
  ScriptedOwner arm(
      network, "arm", kArm, [](Transport& transport, const PeerId& from, const Request& request) {
        transport.reply(from, {request.sequence, 0, Error{Errc::kNotOwner, "not mine"}});
        return true;
      });
  Rig rig(network.join());
  CHECK(outcome(add_finger(rig, Deadline(30s))) == "not_owner");
  CHECK(arm.asked() == Call::kAttempts);
}

TEST_CASE("requests: a request is tried more often if the structure changes after each attempt") {
  LoopbackNetwork network;
  Node eye = Node::open(network.join(), "eye", {}).value();
  std::set<std::uint32_t> denied;  // each perhaps more than once
  ScriptedOwner arm(
      network, "arm", kArm, [&](Transport& transport, const PeerId& from, const Request& request) {
        if (denied.insert(request.sequence).second) {
          (void)eye.add("mark_" + std::to_string(denied.size()), "", along_x(1));
        }
        transport.reply(from, {request.sequence, 0, Error{Errc::kNotOwner, "not mine"}});
        return true;
      });
  Rig rig(network.join());
  CHECK(outcome(add_finger(rig, Deadline(30s))) == "not_owner");
  CHECK(denied.size() == Call::kAttemptsInChange);
}

TEST_CASE("requests: an owner that does not know a parent yet is asked until it does") {
  LoopbackNetwork network;
  std::set<std::uint32_t> denied;  // each perhaps more than once
  ScriptedOwner arm(
      network, "arm", kArm, [&](Transport& transport, const PeerId& from, const Request& request) {
        if (denied.size() == 4 && denied.count(request.sequence) == 0) return false;
        denied.insert(request.sequence);
        transport.reply(from, {request.sequence, 0, Error{Errc::kUnknownParent, "no 'hand'"}});
        return true;
      });
  Rig rig(network.join());
  CHECK(outcome(add_finger(rig, Deadline(30s))) == "ok");
  CHECK(denied.size() == 4);
}

TEST_CASE("requests: an owner that restarts before it answers may have applied the change") {
  LoopbackNetwork network;
  Rig* caller = nullptr;
  std::uint64_t process = 0;
  ScriptedOwner arm(
      network, "arm", kArm, [&](Transport& transport, const PeerId& from, const Request& request) {
        caller->on_presence(testing::presence_of("arm", process, 1));
        caller->on_page(
            {"arm", 0, process, 1, {{"arm", "", 1}, {"hand", "arm", 1}, {"finger", "hand", 1}}});
        transport.reply(from,
                        {request.sequence, 0, Error{Errc::kAlreadyExists, "'finger' exists"}});
        return true;
      });
  Rig rig(network.join());
  REQUIRE(rig.discovery.await(Deadline(10s)));
  caller = &rig;
  const auto number = [&] {
    const Lock lock(rig.structure.mutex);
    return rig.structure.directory.serving("arm")->incarnation;
  };
  SECTION("another process answers") {
    process = number() + 1;
    const auto added = add_finger(rig, Deadline(10s));
    REQUIRE(outcome(added) == "unreachable");
    CHECK_THAT(added.error().message, ContainsSubstring("'arm' was restarted before it answered"));
  }
  SECTION("the same process answers: somebody else has added the frame") {
    process = number();
    CHECK(outcome(add_finger(rig, Deadline(10s))) == "already_exists");
  }
}

TEST_CASE("requests: a change that is acknowledged but does not arrive is not denied") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm,
                    [](Transport& transport, const PeerId& from, const Request& request) {
                      transport.reply(from, {request.sequence, kFarEpoch, Done{}});
                      return true;
                    });
  Rig rig(network.join());
  REQUIRE(rig.discovery.await(Deadline(10s)));
  CHECK(outcome(add_finger(rig, Deadline(20ms))) == "ok");
  CHECK_FALSE(rig.discovery.complete());
  CHECK(outcome(rig.requests.find(Deadline(10ms), [](const Directory&) -> Result<int> {
          return fail(Errc::kUnknownFrame, "no frame 'finger'");
        })) == "timeout");
}

TEST_CASE("requests: owners that have applied their share are not asked for it again") {
  LoopbackNetwork network;
  std::optional<std::uint32_t> denied;
  const auto denies_first = [&](Transport& transport, const PeerId& from, const Request& request) {
    if (denied.value_or(request.sequence) != request.sequence) return false;
    denied = request.sequence;
    transport.reply(from, {request.sequence, 0, Error{Errc::kNotOwner, "not mine"}});
    return true;
  };
  std::set<std::uint32_t> applied;
  ScriptedOwner arm(network, "arm",
                    {{"arm", "", {}},
                     {"wrist", "arm", {}},
                     testing::moved_by("hand", "arm", testing::revolute_named("a"))},
                    [&](Transport&, const PeerId&, const Request& request) {
                      applied.insert(request.sequence);
                      return false;
                    });
  ScriptedOwner leg(network, "leg",
                    {{"leg", "arm", {}},
                     {"ankle", "leg", {}},
                     testing::moved_by("foot", "leg", testing::revolute_named("b"))},
                    denies_first);
  Rig rig(network.join());
  REQUIRE(rig.discovery.await(Deadline(10s)));
  const Time stamp = Time(1s);
  const bool of_joints = GENERATE(false, true);
  const auto changed = rig.requests.change(
      Deadline(30s), {}, [&](const Directory& directory) -> Result<std::vector<Part>> {
        if (of_joints) return route_joints(directory, {{{"a", 1, 0}, {"b", 1, 0}}, stamp});
        const std::vector<EdgeUpdate> edges{{"wrist", {}}, {"ankle", {}}};
        return route_update(rig.structure.forest, directory, edges, stamp);
      });
  CHECK(outcome(changed) == "ok");
  CHECK(denied);
  CHECK(applied.size() == 1);
}

TEST_CASE("requests: a process that lost its partition sends no requests") {
  LoopbackNetwork network;
  const ScriptedOwner arm(network, "arm", kArm);
  Rig rig(network.join());
  rig.owns_partition = [] { return fail(Errc::kPartitionTaken, "served by another process"); };
  CHECK(outcome(add_finger(rig, Deadline(10s))) == "partition_taken");
  CHECK(arm.asked() == 0);
}

TEST_CASE("requests: an owner that has left before it was asked is not waited for") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm);
  Rig rig(network.join());
  auto part = rig.requests.find(Deadline(10s), [](const Directory& directory) {
    return route_to_partition(directory, Request{0, "arm", HistoryRequest{true}});
  });
  REQUIRE(part);
  arm.leave();
  REQUIRE(testing::eventually([&] {
    const Lock lock(rig.structure.mutex);
    return !rig.structure.directory.reachable(part->owner);
  }));
  // As a second round, or a lookup that waits, may do.
  std::vector<Part> parts{*part};
  const auto start = Deadline::Clock::now();
  const std::vector<Reply> replies = rig.requests.ask(parts, Deadline(20s));
  CHECK(Deadline::Clock::now() - start < 10s);
  const auto* error = std::get_if<Error>(&replies.at(0).body);
  REQUIRE(error != nullptr);
  CHECK(error->code == Errc::kUnreachable);
}

TEST_CASE("requests: a list of an owner is returned and so is its error") {
  LoopbackNetwork network;
  ScriptedOwner arm(network, "arm", kArm);
  REQUIRE(arm.node().update("hand", along_x(1), Time(1s)));
  Rig rig(network.join());
  const auto all = rig.requests.ask_all<HistoryInfo>("arm", HistoryRequest{true}, rig.deadline());
  REQUIRE(all);
  REQUIRE(all->size() == 1);
  CHECK(all->front().id == "hand");
  CHECK(outcome(rig.requests.ask_all<HistoryInfo>("leg", HistoryRequest{true}, rig.deadline())) ==
        "unknown_partition");
}

TEST_CASE("requests: no more of a description is asked for than it may have") {
  LoopbackNetwork network;
  std::uint64_t size = (std::uint64_t{64} << 20U) + 1;
  std::uint64_t grows = 0;
  ScriptedOwner arm(network, "arm", kArm,
                    [&](Transport& transport, const PeerId& from, const Request& request) {
                      if (!std::holds_alternative<DescriptionRequest>(request.body)) return false;
                      const DescriptionPart part{size, 1, std::string(kMaxDescriptionPart, '<')};
                      transport.reply(from, {request.sequence, 0, part});
                      size += grows;
                      return true;
                    });
  Rig rig(network.join());
  Descriptions descriptions(rig.requests, "");
  const auto of_none = descriptions.of("arm", Deadline(10s));
  REQUIRE(outcome(of_none) == "too_much");
  CHECK(of_none.error().message == "partition 'arm' has a description of 67108865 bytes");
  CHECK(arm.asked() == 1);
  // One that grows while it is read is another one, and is read from its beginning.
  grows = 1;
  size = 3 * kMaxDescriptionPart - 4;
  CHECK(outcome(descriptions.of("arm", Deadline(50ms))) == "timeout");
}

}  // namespace tfdude
