// All participants that receive the same messages agree on the owner of a frame, and a reachable
// owner keeps its frames. This holds for any deaths, hangs and returns of partitions, for forgotten
// partitions, and for any order of messages.

#include "support/catch.hpp"
#include "support/random.hpp"
#include "unit/partition/absences_world.hpp"

namespace tfdude {
namespace {

using testing::AbsencesWorld;
using testing::Random;

TEST_CASE("reachable partitions keep their frames and all agree through deaths and returns") {
  Random random(0xab5e);
  INFO("seed " << random.seed());
  AbsencesWorld::Counts counts;
  for (int round = 0; round < 300; ++round) {
    INFO("round " << round);
    AbsencesWorld world(random, counts);
    for (int part = 0; part < 3; ++part) {
      for (int step = 0; step < 100; ++step) world.step();
      world.run_until_quiet();
      world.demand_agreement();
    }
    world.return_all();
    world.demand_agreement();
  }
  // Otherwise the test has shown nothing.
  CHECK(counts.kept > 100);
  CHECK(counts.inherited > 100);
  CHECK(counts.removed > 30);
  CHECK(counts.forgotten > 100);
  CHECK(counts.conflicts > 100);
}

}  // namespace
}  // namespace tfdude
