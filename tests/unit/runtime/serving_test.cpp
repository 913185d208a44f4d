// How a participant becomes the owner of its partition, and which frames it yields.

#include "runtime/serving.hpp"

#include <atomic>
#include <condition_variable>
#include <future>
#include <memory>
#include <mutex>
#include <string>
#include <unistd.h>
#include <vector>

#include "runtime/observations.hpp"
#include "runtime/yielding.hpp"
#include "support/captured_log.hpp"
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
using testing::CapturedLog;
using testing::ContainsSubstring;
using testing::eventually;
using testing::outcome;
using testing::presence_of;
using testing::Rig;
using testing::ScriptedOwner;

struct OwnerRig : Rig {
  explicit OwnerRig(TransportPtr to, const std::string& partition = "arm")
      : Rig(std::move(to), partition), yielding(context), serving(context) {
    on_contest = [this] { yielding.ask(); };
  }
  ~OwnerRig() override { yielding.stop(); }
  Result<void> serve(const std::vector<FrameSpec>& frames) { return serving.serve(frames); }
  Yielding yielding;
  Serving serving;
};

const std::vector<FrameSpec> kArm{{"arm", "", {}}, {"hand", "arm", along_x(4)}};

/// A disk that may block.
struct Disk {
  std::mutex mutex;
  std::condition_variable changed;
  bool stands_still = false;
  int waiting = 0;

  void let_it_stand_still(bool still) {
    {
      const std::lock_guard lock(mutex);
      stands_still = still;
    }
    changed.notify_all();
  }
  void write() {
    std::unique_lock lock(mutex);
    ++waiting;
    changed.wait(lock, [this] { return !stands_still; });
    --waiting;
  }
  [[nodiscard]] bool is_waited_for() {
    const std::lock_guard lock(mutex);
    return stands_still && waiting > 0;
  }
};

class SlowStore final : public StateStore {
 public:
  explicit SlowStore(Disk& disk) : disk_(disk) {}
  Result<StoredState> load() override { return StoredState{}; }
  Result<void> save(const StateChange&) override {
    disk_.write();
    return {};
  }
  Result<void> make_room() override { return {}; }

 private:
  Disk& disk_;
};

}  // namespace

TEST_CASE("serving: the configured frames are owned and published") {
  LoopbackNetwork network;
  OwnerRig owner(network.join());
  REQUIRE(owner.serve(kArm));
  Rig other(network.join());
  CHECK(other.structure.forest.exists("hand"));
  CHECK(owner.member.partition()->frame_count() == 2);
  CHECK_FALSE(owner.member.out());
  owner.member.say_goodbye();
  CHECK_FALSE(other.structure.directory.serving("arm"));
}

TEST_CASE("serving: a name that is taken is rejected and the error names its owner") {
  LoopbackNetwork network;
  const ScriptedOwner first(network, "arm", kArm);
  OwnerRig second(network.join());
  const auto served = second.serve(kArm);
  REQUIRE(outcome(served) == "partition_taken");
  CHECK_THAT(served.error().message,
             ContainsSubstring("'arm' is served already, on host ") &&
                 ContainsSubstring("by process " + std::to_string(getpid())));
}

TEST_CASE("serving: an invalid frame is named and nothing is served") {
  LoopbackNetwork network;
  OwnerRig owner(network.join());
  const auto served = owner.serve({{"arm", "", {}}, {"arm", "", {}}});
  REQUIRE_FALSE(served);
  CHECK_THAT(served.error().message, ContainsSubstring("'arm'"));
  Rig other(network.join());
  CHECK_FALSE(other.structure.forest.exists("arm"));
}

TEST_CASE("member runner: arrivals and losses of others are passed to the other parts") {
  LoopbackNetwork network;
  Rig rig(network.join());
  rig.on_presence(presence_of("leg", 7, 1));
  rig.on_page(Page{"leg", 0, 7, 1, {{"foot", "", 1}}});
  const int before = rig.routes;
  CHECK(before >= 1);
  rig.on_lost("leg", 7);
  const std::lock_guard lock(rig.mutex);
  CHECK(rig.gone == std::vector<std::string>{"leg"});
  CHECK(rig.routes == before + 1);
}

TEST_CASE("member runner: a listener gets changes in order until it unsubscribes") {
  LoopbackNetwork network;
  Rig rig(network.join());
  std::mutex mutex;
  std::vector<ChangeKind> heard;
  auto subscription = rig.member.on_change([&](const Change& change) {
    const std::lock_guard lock(mutex);
    heard.push_back(change.kind);
  });
  const auto count = [&] {
    const std::lock_guard lock(mutex);
    return heard.size();
  };
  rig.on_presence(presence_of("leg", 7, 1));
  rig.on_page(Page{"leg", 0, 7, 1, {{"foot", "", 1}}});
  rig.on_lost("leg", 7);
  REQUIRE(eventually([&] { return count() >= 2; }));
  subscription.reset();
  const std::size_t before = count();
  rig.on_presence(presence_of("leg", 8, 1));
  CHECK(count() == before);
  CHECK(heard.front() == ChangeKind::kPartitionUp);
}

TEST_CASE("member runner: a participant without a partition stores and rejects nothing") {
  LoopbackNetwork network;
  Rig rig(network.join());
  CHECK(rig.member.partition() == nullptr);
  CHECK(rig.member.check_owns_partition());
  rig.member.tell(Deadline(1s));
  const Error error{Errc::kUnknownFrame, "no frame 'hand'"};
  CHECK(rig.member.unless_unsaved(error, "hand").message == error.message);
}

TEST_CASE("member runner: an owner's own updates do not wait for the disk") {
  const bool structural = GENERATE(false, true);
  LoopbackNetwork network;
  Disk disk;
  OwnerRig owner(network.join());
  const std::vector<FrameSpec> frames{
      {"arm", "", {}},
      {"hand", "arm", {}},
      testing::moved_by("finger", "hand", testing::revolute_named("bend"))};
  owner.member.with_rules([](Member& member) { member.claim("here", 1, Time(1s), 1); });
  owner.member.open(std::make_unique<SlowStore>(disk), 1ms);
  const StoredState nothing;
  REQUIRE(owner.member.serve(&nothing, frames));
  REQUIRE(owner.member.publish_all());
  disk.let_it_stand_still(true);
  std::future<Result<void>> change;
  if (structural) {
    change = std::async(std::launch::async, [&] {
      return owner.requests.change(Deadline(20s), {}, [](const Directory&) -> Result<Part> {
        return Part{kHeldHere, "arm", {1, "tool", AddRequest{"hand", {}}}};
      });
    });
  } else {
    REQUIRE(owner.structure.forest.update("hand", along_x(1)));
  }
  REQUIRE(eventually([&] { return disk.is_waited_for(); }));
  auto own = std::async(std::launch::async, [&] {
    for (int i = 1; i <= 100; ++i) {
      if (auto set = owner.structure.forest.update("hand", along_x(i)); !set) return set;
      auto moved = owner.member.apply(JointUpdate{{{"bend", 0.01 * i}}, {}});
      if (!moved) return Result<void>(tl::unexpected(moved.error()));
    }
    return Result<void>();
  });
  const bool in_time = own.wait_for(5s) == std::future_status::ready;
  CHECK(disk.is_waited_for());
  CHECK(testing::x_of(owner.structure.forest.lookup("arm", "hand")) == 100);
  CHECK(testing::yaw(owner.structure.forest.lookup("hand", "finger")) == testing::Approx(1));
  disk.let_it_stand_still(false);
  CHECK(in_time);
  CHECK(outcome(own.get()) == "ok");
  if (structural) CHECK(outcome(change.get()) == "ok");
}

TEST_CASE("member runner: an owner's own observation and correlation return once they are stored") {
  const bool observes = GENERATE(false, true);
  LoopbackNetwork network;
  Disk disk;
  OwnerRig owner(network.join());
  owner.member.with_rules([](Member& member) { member.claim("here", 1, Time(1s), 1); });
  owner.member.open(std::make_unique<SlowStore>(disk), 1h);
  const StoredState nothing;
  Transform X = along_x(4);
  X.covariance = Covariance::from_stddev({1, 1, 1, 1, 1, 1}).value();
  REQUIRE(owner.member.serve(&nothing, {{"arm", "", {}}, {"hand", "arm", X}}));
  REQUIRE(owner.member.publish_all());
  Observations observations(owner.context);
  disk.let_it_stand_still(true);
  auto change = std::async(std::launch::async, [&]() -> Result<void> {
    if (observes) {
      auto seen = observations.observe({"arm", "hand", X, {}, {}}, Deadline(20s));
      return seen ? Result<void>() : tl::unexpected(seen.error());
    }
    return owner.requests.change(Deadline(20s), {}, [&](const Directory&) -> Result<Part> {
      return Part{kHeldHere, "arm", {1, "hand", CorrelateRequest{{true, {}, {}}}}};
    });
  });
  const bool waited = eventually([&] { return disk.is_waited_for(); });
  CHECK(change.wait_for(20ms) == std::future_status::timeout);
  disk.let_it_stand_still(false);
  CHECK(waited);
  CHECK(outcome(change.get()) == "ok");
}

TEST_CASE("member runner: ignored messages of a process are logged once") {
  const CapturedLog logged;
  LoopbackNetwork network;
  Rig rig(network.join());
  rig.on_presence(presence_of("leg", 8, 1));
  for (int i = 0; i < 3; ++i) {
    rig.on_presence(presence_of("leg", 7, 1));
    rig.on_page(Page{"leg", 0, 7, 1, {{"foot", "", 1}}});
  }
  CHECK_FALSE(rig.structure.forest.exists("foot"));
  CHECK(logged.count("messages of process 7 of partition 'leg' are ignored") == 1);
  rig.on_presence(presence_of("leg", 6, 1));
  CHECK(logged.count("messages of process 6 of partition 'leg' are ignored") == 1);
  CHECK(logged.count("are ignored") == 2);
}

TEST_CASE("yielding: a frame is yielded only after the other owner has confirmed its older claim") {
  LoopbackNetwork network;
  std::atomic<bool> silent{true};
  // The first owner claimed the hand first; the second one does not know that when it claims it.
  ScriptedOwner first(network, "first", {{"arm", "", {}}},
                      [&](Transport&, const PeerId&, const Request& request) {
                        return silent && std::holds_alternative<RemoveRequest>(request.body);
                      });
  OwnerRig second(network.join(), "second");
  REQUIRE(second.serve({{"leg", "", {}}, {"hand", "leg", {}}}));
  REQUIRE(second.structure.forest.holds("hand"));
  const auto firsts = second.structure.directory.serving("first");
  REQUIRE(firsts);
  // A page of the first owner brings a claim that is older than any other.
  const std::uint64_t epoch =
      second.structure.directory.epoch(*second.structure.directory.owner("first"));
  second.on_page(
      Page{"first", 0, firsts->incarnation, epoch + 1, {{"arm", "", 1}, {"hand", "arm", 1}}});
  // The second keeps the frame until the first has answered.
  REQUIRE(eventually([&] { return first.asked() > 0; }));
  CHECK(second.structure.forest.holds("hand"));
  silent = false;
  CHECK(eventually([&] { return !second.structure.forest.holds("hand"); }));
}

}  // namespace tfdude
