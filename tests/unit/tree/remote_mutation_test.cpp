// Compiled with lookups that do not ask for the horizon: remote_race_test.cpp must fail with them.

#include "support/catch.hpp"
#include "unit/tree/remote_race.hpp"

namespace tfdude {

TEST_CASE("without the horizon, what was overwritten meanwhile is taken for values") {
  testing::Seen seen;
  for (int runs = 0; runs < 50 && seen.torn == 0; ++runs) {
    seen = testing::race_for_batches(testing::Repeater::In::kProcess, 1'000'000);
  }
  CHECK(seen.torn > 0);
}

}  // namespace tfdude
