// When a new participant may say that something unknown does not exist.

#include "runtime/discovery.hpp"

#include <atomic>
#include <functional>
#include <future>
#include <string>
#include <thread>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/replica.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using testing::outcome;
using testing::quick;

/// A transport that may not have discovered all participants yet.
class Meeting final : public testing::Relay {
 public:
  using Relay::Relay;
  bool discovered() const override { return met_all; }
  bool awaits_presence() const override {
    if (if_asked) if_asked();
    return met_somebody;
  }

  std::function<void()> if_asked;
  std::atomic<bool> met_all{false};
  std::atomic<bool> met_somebody{false};
};

struct Joiner {
  explicit Joiner(const Options& options = quick())
      : own(std::make_unique<Meeting>(network.join())),
        meeting(*own),
        rig(std::move(own), "", options) {}

  LoopbackNetwork network;
  std::unique_ptr<Meeting> own;
  Meeting& meeting;
  testing::Rig rig;
};

Result<int> missing() { return fail(Errc::kUnknownFrame, "no frame 'hand'"); }

}  // namespace

TEST_CASE("discovery: without other participants it is complete after the discovery time") {
  Joiner joiner;
  const auto before = Deadline::Clock::now();
  CHECK_FALSE(joiner.rig.discovery.complete());
  REQUIRE(joiner.rig.discovery.await(joiner.rig.deadline()));
  CHECK(Deadline::Clock::now() - before >= 40ms);
  const auto found =
      joiner.rig.requests.find(joiner.rig.deadline(), [](const Directory&) { return missing(); });
  REQUIRE_FALSE(found);
  CHECK(found.error().code == Errc::kUnknownFrame);
  CHECK(found.error().message ==
        "no frame 'hand'; no partition answers: domains, profiles or discovery servers may differ");
}

TEST_CASE("discovery: no negative answer before all participants are discovered") {
  Options options = quick();
  options.discovery = 10s;
  Joiner joiner(options);
  const Deadline soon(20ms);
  const auto found = joiner.rig.requests.find(soon, [](const Directory&) { return missing(); });
  REQUIRE_FALSE(found);
  CHECK(found.error().code == Errc::kTimeout);
  CHECK_THAT(found.error().message, ContainsSubstring("no frame 'hand'") &&
                                        ContainsSubstring("no participant was discovered yet"));
  joiner.meeting.met_somebody = true;
  CHECK_THAT(joiner.rig.discovery.await(soon).error().message,
             ContainsSubstring("a discovered participant has not announced yet what it owns"));
  joiner.meeting.met_all = true;
  CHECK(joiner.rig.discovery.await(soon));
}

// A transport may take the same lock for this call and when it reports a presence, and the latter
// takes the structure's lock.
TEST_CASE("discovery: the transport is called without the lock of the structure") {
  Options options = quick();
  options.discovery = 10s;
  Joiner joiner(options);
  int asked = 0;
  int locked = 0;
  joiner.meeting.if_asked = [&] {
    ++asked;
    std::thread([&] {
      Mutex& mutex = joiner.rig.structure.mutex;
      if (!mutex.try_lock()) {
        ++locked;
      } else {
        mutex.unlock();
      }
    }).join();
  };
  CHECK_FALSE(joiner.rig.discovery.await(Deadline(20ms)));
  CHECK(asked > 0);
  CHECK(locked == 0);
}

TEST_CASE("discovery: an operation is repeated until its missing frame has arrived") {
  Options options = quick();
  options.discovery = 10s;
  options.timeout = 20s;
  Joiner joiner(options);
  std::atomic<int> tries{0};
  std::thread other([&] {
    while (tries == 0) std::this_thread::yield();
    joiner.rig.on_presence(testing::presence_of("arm", 1, 1));
    joiner.rig.on_page(Page{"arm", 0, 1, 1, {{"hand", "", 1}}});
  });
  const auto found =
      joiner.rig.requests.find(joiner.rig.deadline(), [&](const Directory&) -> Result<int> {
        const bool is_known = joiner.rig.structure.forest.exists("hand");
        ++tries;
        return is_known ? Result<int>(1) : missing();
      });
  other.join();
  CHECK(found);
  CHECK(tries > 1);
}

TEST_CASE("discovery: what a partition has that comes later is waited for, but not for long") {
  Joiner joiner;
  REQUIRE(joiner.rig.discovery.await(Deadline(10s)));
  joiner.rig.on_presence(testing::presence_of("arm", 1, 1));
  const auto find = [&](const std::string& id) {
    return joiner.rig.requests.find(Deadline(30s), [&](const Directory&) -> Result<int> {
      if (joiner.rig.structure.forest.exists(id)) return 1;
      return missing();
    });
  };
  SECTION("it comes") {
    auto hand = std::async(std::launch::async, [&] { return find("hand"); });
    CHECK(hand.wait_for(20ms) == std::future_status::timeout);
    joiner.rig.on_page(Page{"arm", 0, 1, 1, {{"hand", "", 1}}});
    CHECK(hand.get());
    const auto begin = Deadline::Clock::now();
    CHECK(outcome(find("finger")) == "unknown_frame");
    CHECK(Deadline::Clock::now() - begin < 500ms);
  }
  SECTION("it does not come") { CHECK(outcome(find("hand")) == "unknown_frame"); }
}

TEST_CASE("discovery: an error that more discovery cannot change is returned at once") {
  Joiner joiner;
  int tries = 0;
  const auto found =
      joiner.rig.requests.find(joiner.rig.deadline(), [&](const Directory&) -> Result<int> {
        ++tries;
        return fail(Errc::kCycle, "a cycle");
      });
  CHECK(found.error().code == Errc::kCycle);
  CHECK(tries == 1);
}

TEST_CASE("discovery: it waits for a change that an owner has announced but that has not arrived") {
  Joiner joiner;
  joiner.meeting.met_all = true;
  joiner.rig.on_presence(testing::presence_of("arm", 1, 1));
  joiner.rig.on_page(Page{"arm", 0, 1, 1, {{"hand", "", 1}}});
  REQUIRE(joiner.rig.discovery.complete());
  {
    const std::lock_guard lock(joiner.rig.structure.mutex);
    joiner.rig.structure.directory.note_announced_epoch(
        *joiner.rig.structure.directory.owner("arm"), 2);
  }
  CHECK_THAT(joiner.rig.discovery.await(Deadline(10ms)).error().message,
             ContainsSubstring("partition 'arm' has made a change that has not arrived here yet"));
  joiner.rig.on_page(Page{"arm", 0, 1, 2, {{"hand", "", 1}, {"finger", "hand", 2}}});
  CHECK(joiner.rig.discovery.await(Deadline(10s)));
}

TEST_CASE("discovery: the end of the client ends the waits, and says so") {
  Options options = quick();
  options.discovery = 60s;
  Joiner joiner(options);
  Result<void> all;
  Result<int> found;
  std::thread knows_all([&] { all = joiner.rig.discovery.await(Deadline(60s)); });
  std::thread finds([&] {
    found = joiner.rig.requests.find(Deadline(60s), [](const Directory&) { return missing(); });
  });
  joiner.rig.discovery.end_waits();
  knows_all.join();
  finds.join();
  REQUIRE_FALSE(all);
  CHECK(all.error().code == Errc::kTransport);
  REQUIRE_FALSE(found);
  CHECK(found.error().code == Errc::kTransport);
  CHECK(found.error().message == "the client was closed: no frame 'hand'");
  CHECK_FALSE(joiner.rig.discovery.await_known(Deadline(60s)));
}

TEST_CASE("discovery: a call may also take the rest of the discovery time") {
  Options options = quick();
  options.discovery = 10s;
  Joiner joiner(options);
  CHECK(joiner.rig.deadline().at() > Deadline::Clock::now() + 9s);
  joiner.meeting.met_all = true;
  REQUIRE(joiner.rig.discovery.complete());
  const auto until = joiner.rig.deadline().at();
  CHECK(until <= Deadline::Clock::now() + options.timeout);
}

}  // namespace tfdude
