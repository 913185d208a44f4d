// What a restarted owner knows of its dynamic edges.

#include <string>
#include <vector>

#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_store.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::outcome;
using testing::Replica;

constexpr Time kNow{std::chrono::seconds(100)};

Time at(std::int64_t seconds) { return Time(std::chrono::seconds(seconds)); }

struct Arms : Replica {
  explicit Arms(testing::MemoryStore& state, std::vector<FrameSpec> frames = configured())
      : Replica("arms"), store(state), partition("arms", 7, forest, directory) {
    REQUIRE(partition.restore(*store.load(), frames, kNow));
    save();
  }
  static std::vector<FrameSpec> configured() {
    return {{"arm", "", along_x(1)}, {"hand", "arm", along_x(10)}, {"tool", "arm", along_x(100)}};
  }
  void save() { REQUIRE(store.save(testing::unsaved(partition, true))); }
  [[nodiscard]] Result<StampedTransform> hand(std::optional<Time> t = {}) const {
    Query query;
    query.at = t;
    return forest.lookup("arm", "hand", query);
  }

  testing::MemoryStore& store;
  Partition partition;
};

}  // namespace

TEST_CASE("a sample is restored with its stamp, and other instants have no value") {
  testing::MemoryStore store;
  {
    Arms arms(store);
    for (const int t : {10, 20}) REQUIRE(arms.forest.update("hand", along_x(t), at(t)));
    arms.save();
  }
  // A second time as well.
  for (int life = 0; life < 2; ++life) {
    CAPTURE(life);
    Arms arms(store);
    CHECK(arms.hand().value().stamp == at(20));
    CHECK(arms.hand(at(20)).value().pose.translation().x() == 20);
    CHECK(outcome(arms.hand(at(25))) == "not_yet");
    CHECK(outcome(arms.hand(at(15))) == "too_old");
    // A value without a stamp holds for all times.
    CHECK(arms.forest.lookup("arm", "tool", {at(25), {}, {}}));
    arms.save();
  }
  Arms arms(store);
  REQUIRE(arms.forest.update("hand", along_x(30), at(30)));
  CHECK(outcome(arms.hand(at(25))) == "too_old");
}

TEST_CASE("a configuration that replaces a sample replaces its stamp") {
  testing::MemoryStore store;
  {
    Arms arms(store);
    REQUIRE(arms.forest.update("hand", along_x(20), at(20)));
    arms.save();
  }
  auto frames = Arms::configured();
  frames[1].X_PC = along_x(11);
  const Arms arms(store, frames);
  CHECK_FALSE(arms.hand().value().stamp);
  CHECK(arms.hand(at(25)).value().pose.translation().x() == 11);
}

TEST_CASE("a cleared history is restored as one") {
  testing::MemoryStore store;
  {
    Arms arms(store);
    REQUIRE(arms.forest.update("hand", along_x(20), at(20)));
    REQUIRE(arms.forest.clear_history("hand"));
    arms.save();
  }
  const Arms arms(store);
  CHECK(outcome(arms.hand()) == "not_yet");
}

}  // namespace tfdude
