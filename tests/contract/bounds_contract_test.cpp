// The maximum time of calls, over each transport.

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "tfdude/client/client.hpp"
#include "tfdude/client/node.hpp"

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/networks.hpp"
#include "support/relay.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::Join;
using testing::joined_by;
using testing::outcome;
using Clock = std::chrono::steady_clock;

/// The result of the first lookup of a new client, and the shortest time among several clients,
/// because any of them may take longer on a busy machine.
struct FirstLookup {
  FirstLookup(const Join& join, const std::string& frame, Milliseconds wait) {
    for (int i = 0; i < 5; ++i) {
      auto client = Client::open(join("")).value();
      const auto start = Clock::now();
      auto found = client.lookup("world", frame, {}, wait);
      took = std::min(took, Clock::now() - start);
      what = outcome(found);
      if (!found) message = found.error().message;
    }
  }
  Clock::duration took = Clock::duration::max();
  std::string what;
  std::string message;
};

/// All participants are discovered late, and owners do not say which frames they know.
class Late final : public testing::Relay {
 public:
  static constexpr Milliseconds kDiscovery{70};
  using Relay::Relay;
  using Relay::send;

  bool discovered() const override { return Clock::now() - begin_ >= kDiscovery; }
  Result<void> send(const std::string& partition, const Request& request,
                    Deadline deadline) override {
    const bool lost = std::holds_alternative<FramesRequest>(request.body);
    return lost ? Result<void>() : Relay::send(partition, request, deadline);
  }

 private:
  const Clock::time_point begin_ = Clock::now();
};

}  // namespace

TEST_CASE("bounds: a call of several steps has one deadline for all") {
  const Join join = testing::join_loopback();
  const auto base = Node::open(join("base"), "base", {{"world", "", {}}}).value();
  // A partition that was lost before, so the others are asked for its frames.
  { const auto arm = Node::open(join("arm"), "arm", {{"arm", "world", {}}}).value(); }
  ClientOptions options;
  options.timeout = Milliseconds(100);
  options.discovery = Milliseconds(0);
  const int call = GENERATE(0, 1, 2, 3);
  auto took = Clock::duration::max();
  for (int i = 0; i < 10 && took >= 130ms; ++i) {
    auto client = Client::open(std::make_unique<Late>(join("")), options).value();
    const auto start = Clock::now();
    if (call == 0) (void)client.frames();
    if (call == 1) (void)client.children("world");
    if (call == 2) (void)client.roots();
    if (call == 3) (void)client.whether_exists("nobody");
    took = std::min(took, Clock::now() - start);
  }
  INFO("call " << call);
  CHECK(took < 130ms);
}

TEST_CASE("bounds: alone in the domain a lookup ends at its maximum wait") {
  const int transport = GENERATE(from_range(testing::networks()));
  const FirstLookup alone(joined_by(transport), "tool", 50ms);
  INFO(alone.message);
  CHECK(alone.took >= 50ms);
  CHECK(alone.took < 70ms);
  // Inside one process all participants are discovered at once.
  CHECK(alone.what == (transport == 0 ? "unknown_start" : "timeout"));
  if (transport == 0) return;
  CHECK_THAT(alone.message, testing::ContainsSubstring("no participant was discovered yet"));
  CHECK_THAT(alone.message, testing::ContainsSubstring("'world'"));
}

TEST_CASE("bounds: alone in the domain every call returns a definite answer") {
  auto client = Client::open(joined_by(GENERATE(from_range(testing::networks())))("")).value();
  CHECK(client.frames().value().empty());
  CHECK(client.partitions().value().empty());
  CHECK(client.roots().value().empty());
  CHECK_FALSE(client.exists("world"));
  CHECK(outcome(client.children("world")) == "unknown_frame");
  CHECK(outcome(client.lookup("world", "tool", {}, 1ms)) == "unknown_start");
}

TEST_CASE("bounds: a client keeps no more of the structure of others than its limit") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  std::vector<FrameSpec> frames{{"world", "", {}}};
  for (int i = 0; i < 3000; ++i) frames.push_back({"shelf" + std::to_string(i), "world", {}});
  const auto store = Node::open(join("store"), "store", frames).value();
  const auto robot = Node::open(join("robot"), "robot", {{"tool", "", {}}}).value();
  Options options;
  options.others = 2000;
  auto client = Client::open(join(""), options).value();
  CHECK(client.exists("tool"));
  const auto X = client.lookup("tool", "absent");
  REQUIRE_FALSE(X);
  CHECK(X.error().code == Errc::kTimeout);
  CHECK_THAT(X.error().message,
             testing::ContainsSubstring("'store' has more frames than are kept here"));
  CHECK(Client::open(join("")).value().lookup("world", "shelf2999"));
}

TEST_CASE("bounds: the first lookup of a client ends at its maximum wait") {
  const Join join = joined_by(GENERATE(from_range(testing::networks())));
  const auto node =
      Node::open(join("robot"), "robot", {{"world", "", {}}, {"tool", "world", {}}}).value();
  const FirstLookup there(join, "tool", 20'000ms);
  INFO(there.message);
  CHECK(there.what == "ok");
  const FirstLookup missing(join, "nobody", 30ms);
  INFO(missing.message);
  CHECK((missing.what == "timeout" || missing.what == "unknown_end"));
  CHECK(missing.took < 50ms);
}

}  // namespace tfdude
