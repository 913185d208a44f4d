// Measurements of paths over owners that reject, write in the meantime, or leave.

#include "runtime/observations.hpp"

#include <atomic>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/rig.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using testing::outcome;
using testing::Rig;
using testing::ScriptedOwner;

struct Observer : Rig {
  explicit Observer(LoopbackNetwork& network) : Rig(network.join()), observations(context) {}

  Result<Observed> observe(const Transform& X_AB) {
    return observations.observe({"world", "hand", X_AB, std::nullopt, {}}, deadline());
  }
  Observations observations;
};

Transform uncertain(double metres) {
  return {testing::along_x(metres).pose,
          Covariance::trusted(Matrix6d(1e-2 * Matrix6d::Identity()))};
}

const std::vector<FrameSpec> kBase{{"world", "", {}}, {"mount", "world", uncertain(1)}};
const std::vector<FrameSpec> kArm{{"hand", "mount", uncertain(2)}};

}  // namespace

TEST_CASE("observations: a measurement corrects the edges of all owners of its path") {
  LoopbackNetwork network;
  ScriptedOwner base(network, "base", kBase);
  ScriptedOwner arm(network, "arm", kArm);
  Observer observer(network);
  const auto observed = observer.observe(uncertain(3.1));
  REQUIRE(observed);
  CHECK(observed->accepted);
  CHECK(observed->corrected.size() == 2);
  CHECK(base.node().lookup("world", "mount")->pose.translation().x() > 1.01);
  CHECK(arm.node().lookup("mount", "hand")->pose.translation().x() > 2.01);
  const auto consistency = observer.observations.consistency("arm");
  REQUIRE(consistency);
  CHECK(consistency->size() == 1);
}

TEST_CASE("observations: an observation is repeated if an edge was written in the meantime") {
  LoopbackNetwork network;
  std::atomic<int> revisions{0};
  ScriptedOwner arm(
      network, "arm", kArm, [&](Transport& transport, const PeerId& from, const Request& request) {
        if (!std::holds_alternative<ReviseRequest>(request.body)) return false;
        if (revisions++ > 0) return false;
        transport.reply(from,
                        {request.sequence, 0, Error{Errc::kChangedMeanwhile, "it was written"}});
        return true;
      });
  ScriptedOwner base(network, "base", kBase);
  Observer observer(network);
  CHECK(outcome(observer.observe(uncertain(3))) == "ok");
  CHECK(revisions == 2);
}

TEST_CASE("observations: what an owner has applied is taken back if another one has not") {
  LoopbackNetwork network;
  const ScriptedOwner arm(network, "arm", kArm);
  const ScriptedOwner base(
      network, "base", kBase, [](Transport& transport, const PeerId& from, const Request& request) {
        if (!std::holds_alternative<ReviseRequest>(request.body)) return false;
        transport.reply(from, {request.sequence, 0, Error{Errc::kState, "the disk is full"}});
        return true;
      });
  Observer observer(network);
  const auto observed = observer.observe(uncertain(3));
  REQUIRE(outcome(observed) == "state");
  CHECK_THAT(observed.error().message,
             ContainsSubstring("the disk is full") &&
                 ContainsSubstring("0 of 2 partitions have applied their part"));
}

TEST_CASE("observations: an invalid measurement is rejected before any owner is asked") {
  LoopbackNetwork network;
  const ScriptedOwner base(network, "base", kBase);
  const ScriptedOwner arm(network, "arm", kArm);
  Observer observer(network);
  Transform bad = uncertain(std::nan(""));
  CHECK(outcome(observer.observe(bad)) == "invalid_input");
  CHECK(arm.asked() == 0);
}

}  // namespace tfdude
