// Frames are handed over from one owner to another: who has them, whatever dies or is lost on the
// way.

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "support/arms.hpp"
#include "support/late_pages.hpp"
#include "support/lossy_requests.hpp"
#include "support/relay.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::agree;
using testing::along_x;
using testing::Arms;
using testing::check_writable;
using testing::difference;
using testing::eventually;
using testing::frames_of_arm1;
using testing::frames_of_arm2;
using testing::is_settled;
using testing::Join;
using testing::joined_by;
using testing::kEnd;
using testing::LatePages;
using testing::LossyRequests;
using testing::outcome;
using testing::owner_of;
using testing::seen;
using testing::TemporaryDirectory;

NodeOptions stored_in(const std::string& directory) {
  NodeOptions options;
  options.state = directory;
  return options;
}

// A transport that changes the parts that are given to the new owner, or gives them to another one.
class ChangedParts final : public testing::Relay {
 public:
  using Change = std::function<void(std::string& partition, AdoptRequest& part)>;
  ChangedParts(TransportPtr real, Change change)
      : Relay(std::move(real)), change_(std::move(change)) {}

  using Relay::send;
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    Request changed = request;
    std::string to = partition;
    if (auto* part = std::get_if<AdoptRequest>(&changed.body)) change_(to, *part);
    return Relay::send(to, changed, deadline);
  }

 private:
  const Change change_;
};

// A handover of which the new owner has everything, and the former one has not heard that.
struct Undecided {
  Undecided() {
    watched = arms.eye->on_change([this](const Change& change) {
      const std::lock_guard lock(mutex);
      if (change.kind == ChangeKind::kConflict) conflicts.push_back(change.message);
    });
    const auto before = seen(*arms.client);
    late.at("arm1")->hold("arm2");
    CHECK_FALSE(arms.client->hand_over("gripper", "arm2"));  // nobody knows that arm1 has let go
    for (Client* one : arms.clients()) CHECK(difference(seen(*one), before) == "");
    CHECK_FALSE(arms.client->update("gripper", along_x(3)));  // neither may change it
    CHECK_FALSE(arms.arm1->update("gripper", along_x(3)));
    CHECK_FALSE(arms.arm2->update("gripper", along_x(3)));
    CHECK(owner_of(*arms.client, "gripper") == "arm1");
  }

  void begin(const std::string& name) {
    auto frames = name == "arm1" ? frames_of_arm1() : frames_of_arm2();
    (name == "arm1" ? arms.arm1 : arms.arm2)
        .emplace(Node::open(join(name), name, frames, stored_in(directory.path())).value());
  }

  void check_no_conflicts() {
    const std::lock_guard lock(mutex);
    CHECK(conflicts.empty());
  }

  TemporaryDirectory directory;
  Join join = testing::join_loopback();
  std::map<std::string, LatePages*> late;  // of the first process of each
  std::mutex mutex;
  std::vector<std::string> conflicts;
  Join with_late = [this](const std::string& partition) -> TransportPtr {
    if (partition.empty()) return join(partition);
    auto transport = std::make_unique<LatePages>(join(partition));
    late.emplace(partition, transport.get());
    return transport;
  };
  Arms arms{with_late, stored_in(directory.path()), 500ms};
  Subscription watched;
};

}  // namespace

TEST_CASE("handover: if nothing reaches the new owner, the frame stays") {
  Arms arms(joined_by(GENERATE(from_range(testing::networks()))));
  const auto before = seen(*arms.client);
  const bool goes_on = GENERATE(true, false);  // whether the former owner hears of the failure
  const auto loses = [&](const Request& request) {
    const auto* handover = std::get_if<HandOverRequest>(&request.body);
    const bool lost_end = handover != nullptr && handover->step == HandOverRequest::Step::kCancel;
    return std::holds_alternative<AdoptRequest>(request.body) || (lost_end && !goes_on);
  };
  Options hasty;
  hasty.timeout = 300ms;
  Client lossy = Client::open(std::make_unique<LossyRequests>(arms.join(""), loses), hasty).value();
  REQUIRE(lossy.exists("gripper"));
  CHECK_FALSE(lossy.hand_over("gripper", "arm2"));
  CHECK(difference(seen(*arms.client), before) == "");
  check_writable(arms, 3);  // at once, or when its owner has waited long enough
  CHECK(owner_of(*arms.client, "gripper") == "arm1");
  REQUIRE(arms.client->hand_over("gripper", "arm2"));
  REQUIRE(is_settled(arms, "arm2"));
  check_writable(arms, 4);
}

TEST_CASE("handover: if the client is gone after the new owner has it, the former lets go") {
  Arms arms(joined_by(GENERATE(from_range(testing::networks()))));
  const auto before = seen(*arms.client);
  const auto loses = [&](const Request& request) {
    const auto* handover = std::get_if<HandOverRequest>(&request.body);
    return handover != nullptr && handover->step == HandOverRequest::Step::kEnd;
  };
  Options hasty;
  hasty.timeout = 300ms;
  Client lossy = Client::open(std::make_unique<LossyRequests>(arms.join(""), loses), hasty).value();
  REQUIRE(lossy.exists("gripper"));
  CHECK_FALSE(lossy.hand_over("gripper", "arm2"));
  REQUIRE(is_settled(arms, "arm2"));
  CHECK(difference(seen(*arms.client), before) == "");
  check_writable(arms, 3);
}

TEST_CASE("handover: who may change the new owner alone gets no frame by it") {
  Arms arms(joined_by(GENERATE(from_range(testing::networks()))));
  const auto before = seen(*arms.client);
  const std::string how =
      GENERATE("an earlier time", "a later time", "much later", "to another one", "only the top");
  INFO(how);
  const auto change = [&](std::string& partition, AdoptRequest& request) {
    for (HandedEdge& edge : request.part.edges) {
      if (how == "an earlier time") --edge.lamport_time;
      if (how == "a later time") ++edge.lamport_time;
      if (how == "much later") edge.lamport_time += 1'000'000;
      edge.X_PC = along_x(77);
    }
    if (how == "to another one") partition = "eye";
    if (how == "only the top") request.part.edges.resize(1);
    if (how == "only the top") request.part.is_last = true;
  };
  Options hasty;
  hasty.timeout = 500ms;
  Client forger =
      Client::open(std::make_unique<ChangedParts>(arms.join(""), change), hasty).value();
  REQUIRE(forger.exists("gripper"));
  CHECK_FALSE(forger.hand_over("gripper", "arm2"));
  // Even while the owner waits whether the other one takes it.
  CHECK(difference(seen(*arms.client), before) == "");
  CHECK(owner_of(*arms.client, "gripper") == "arm1");
  REQUIRE(eventually([&] { return arms.client->move("pad", "gripper").has_value(); }));
  // The process of arm2 itself may have heard last that arm1 has kept them.
  REQUIRE(is_settled(arms, "arm1"));
  check_writable(arms, 3);
  REQUIRE(arms.client->hand_over("gripper", "arm2"));
  REQUIRE(is_settled(arms, "arm2"));
  check_writable(arms, 4);
}

TEST_CASE("handover: the former owner hears late that the new one has all") {
  Undecided of;
  Arms& arms = of.arms;
  CHECK_FALSE(arms.eye->hand_over("gripper", "arm2"));  // which does not end that of the other
  of.late.at("arm1")->let_through();
  REQUIRE(is_settled(arms, "arm2"));
  check_writable(arms, 3);
  of.check_no_conflicts();
}

TEST_CASE("handover: the former owner dies undecided, and comes back") {
  Undecided of;
  Arms& arms = of.arms;
  arms.arm1.reset();
  REQUIRE(eventually([&] { return arms.arm2->update("gripper", along_x(3)).has_value(); }));
  of.begin("arm1");
  REQUIRE(is_settled(arms, "arm2"));
  check_writable(arms, 4);
}

TEST_CASE("handover: the former owner keeps the frame, and the new one gives it up") {
  Undecided of;
  Arms& arms = of.arms;
  REQUIRE(eventually([&] { return arms.arm1->update("gripper", along_x(3)).has_value(); }));
  of.late.at("arm1")->let_through();
  REQUIRE(is_settled(arms, "arm1"));
  for (Client* one : arms.clients()) {
    CHECK(eventually([&] { return testing::x_of(one->lookup("flange1", "gripper")) == 3; }));
  }
  check_writable(arms, 4);
  of.check_no_conflicts();
}

TEST_CASE("handover: the former owner keeps the frame and moves it, and the new one gives it up") {
  Undecided of;
  Arms& arms = of.arms;
  of.late.at("arm2")->hold("arm1");
  REQUIRE(eventually([&] { return arms.client->move("gripper", "base1").has_value(); }));
  SECTION("which hears of it first") {
    of.late.at("arm2")->let_through();
    of.late.at("arm1")->let_through();
  }
  SECTION("which hears of it last") {
    of.late.at("arm1")->let_through();
    CHECK(arms.arm1->parent("gripper").value() == "base1");
    of.late.at("arm2")->let_through();
  }
  REQUIRE(is_settled(arms, "arm1"));
  for (Client* one : arms.clients()) {
    CHECK(eventually([&] { return one->parent("gripper").value() == "base1"; }));
  }
  REQUIRE(eventually([&] { return arms.client->update("gripper", along_x(4)).has_value(); }));
  of.check_no_conflicts();
}

TEST_CASE(
    "handover: the former owner keeps the frame, and returns before the new one has heard of it") {
  Undecided of;
  Arms& arms = of.arms;
  of.late.at("arm2")->hold("arm1");
  REQUIRE(eventually([&] { return arms.arm1->update("gripper", along_x(3)).has_value(); }));
  arms.arm1.reset();
  of.begin("arm1");
  of.late.at("arm2")->let_through();
  REQUIRE(is_settled(arms, "arm1"));
  check_writable(arms, 4);
}

TEST_CASE("handover: the former owner returns at once, undecided") {
  Undecided of;
  Arms& arms = of.arms;
  arms.arm1.reset();
  of.begin("arm1");
  REQUIRE(eventually([&] { return arms.client->update("gripper", along_x(3)).has_value(); }));
  REQUIRE(eventually([&] { return agree(arms, owner_of(*arms.client, "gripper")); }));
  check_writable(arms, 4);
}

TEST_CASE("handover: the new owner dies undecided, and comes back when the other has heard of it") {
  Undecided of;
  Arms& arms = of.arms;
  arms.arm2.reset();
  of.late.at("arm1")->let_through();
  REQUIRE(eventually([&] { return arms.arm1->update("gripper", along_x(3)).has_value(); }));
  of.begin("arm2");
  REQUIRE(is_settled(arms, "arm1"));
  check_writable(arms, 4);
}

TEST_CASE(
    "handover: the new owner dies undecided, and comes back before the other has heard of it") {
  Undecided of;
  Arms& arms = of.arms;
  arms.arm2.reset();
  of.begin("arm2");
  of.late.at("arm1")->let_through();
  REQUIRE(eventually([&] {
    const std::string owner = owner_of(*arms.client, "gripper");
    return owner == "arm1" || owner == "arm2";
  }));
  REQUIRE(eventually([&] { return arms.client->update("gripper", along_x(4)).has_value(); }));
  REQUIRE(eventually([&] { return agree(arms, owner_of(*arms.client, "gripper")); }));
  check_writable(arms, 5);
}

TEST_CASE("handover: it outlives both owners") {
  const TemporaryDirectory directory;
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  Arms arms(join, stored_in(directory.path()));
  REQUIRE(arms.client->update("gripper", along_x(1)));
  REQUIRE(arms.client->hand_over("gripper", "arm2"));
  const std::string which = GENERATE("arm1 arm2", "arm2 arm1", "both");
  const auto end = [&](std::optional<Node>& node) { node.reset(); };
  const auto begin = [&](std::optional<Node>& node, const std::string& name) {
    auto frames = name == "arm1" ? frames_of_arm1() : frames_of_arm2();
    node.emplace(Node::open(join(name), name, frames, stored_in(directory.path())).value());
  };
  if (which == "both") {
    end(arms.arm1);
    end(arms.arm2);
    begin(arms.arm1, "arm1");
    begin(arms.arm2, "arm2");
  } else {
    const bool first = which == "arm1 arm2";
    end(first ? arms.arm1 : arms.arm2);
    begin(first ? arms.arm1 : arms.arm2, first ? "arm1" : "arm2");
    end(first ? arms.arm2 : arms.arm1);
    begin(first ? arms.arm2 : arms.arm1, first ? "arm2" : "arm1");
  }
  REQUIRE(is_settled(arms, "arm2"));
  for (Client* one : arms.clients()) {
    CHECK(eventually([&] { return testing::x_of(one->lookup("flange1", "gripper")) == 1; }));
  }
  check_writable(arms, 3);
}

// Before its requests 0 (begin), 1 and 3 (read), 2 and 4 (the parts) and 5 (end) reach anybody.
TEST_CASE("handover: an owner dies before each step, and comes back at once or later") {
  const TemporaryDirectory directory;
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const std::string dies = GENERATE("arm1", "arm2");
  const int step = GENERATE(0, 1, 2, 3, 4, 5);
  const bool at_once = GENERATE(true, false);
  INFO(dies << " dies before request " << step << (at_once ? ", at once back" : ""));
  Arms arms(join, stored_in(directory.path()));
  REQUIRE(arms.arm2->add("charger", "base2", along_x(1)));
  const auto restart = [&](bool ends, bool begins) {
    auto& node = dies == "arm1" ? arms.arm1 : arms.arm2;
    auto frames = dies == "arm1" ? frames_of_arm1() : frames_of_arm2();
    if (ends) node.reset();
    if (begins) {
      node.emplace(Node::open(join(dies), dies, frames, stored_in(directory.path())).value());
    }
  };
  int sent = 0;
  std::set<std::pair<std::size_t, std::uint32_t>> known;
  const auto die = [&](const Request& request) {
    const bool of_handover = std::holds_alternative<HandOverRequest>(request.body) ||
                             std::holds_alternative<AdoptRequest>(request.body);
    if (!of_handover || !known.emplace(request.body.index(), request.sequence).second) return false;
    if (sent++ == step) restart(true, at_once);
    return false;
  };
  Options hasty;
  hasty.timeout = 1s;
  Client client = Client::open(std::make_unique<LossyRequests>(join(""), die), hasty).value();
  REQUIRE(client.exists("charger"));
  const auto done = client.hand_over("gripper", "arm2");
  CHECK(sent > step);
  if (!at_once) restart(false, true);
  REQUIRE(eventually([&] {
    const std::string owner = owner_of(*arms.client, "gripper");
    return arms.client->update("gripper", along_x(2)).has_value() && agree(arms, owner);
  }));
  const std::string owner = owner_of(*arms.client, "gripper");
  INFO("then " << owner << " has the frame; the call: " << outcome(done));
  CHECK((owner == "arm2" || (owner == "arm1" && !done)));
  for (Client* one : arms.clients()) {
    CHECK(eventually([&] { return testing::x_of(one->lookup("flange1", "gripper")) == 2; }));
    CHECK(testing::x_of(one->lookup("gripper", "finger")) == 0.001 * kEnd);
    CHECK(one->lookup("finger", "pad").has_value());
    CHECK(one->lookup("base1", "charger").has_value());
  }
  REQUIRE(eventually([&] {
    return arms.client->hand_over("gripper", owner == "arm1" ? "arm2" : "arm1").has_value();
  }));
  check_writable(arms, 3);
}

}  // namespace tfdude
