#include "unit/tree/remote_race.hpp"

#include "support/catch.hpp"
#include "support/sanitizers.hpp"

// The owners in these races are never destroyed, and hide their pointers to the heap from others.
extern "C" const char* __lsan_default_suppressions() {  // NOLINT(bugprone-reserved-identifier)
  return "leak:tfdude::testing::race_for_\n";
}

namespace tfdude {
namespace {

using testing::Repeater;
using testing::Seen;

void check(const Seen& seen) {
  CAPTURE(seen.right, seen.given_up, seen.states);
  CHECK(seen.torn == 0);
  CHECK(seen.back == 0);
  CHECK(seen.right > 1000);
  CHECK(seen.states > testing::kStates);
}

}  // namespace

TEST_CASE("a reader of another process sees commits whole and in order") {
  check(testing::race_for_batches(Repeater::In::kProcess, 500'000));
}

TEST_CASE("a reader of another process sees correlations as they were in one commit") {
  check(testing::race_for_correlations(Repeater::In::kProcess, 20'000));
}

TEST_CASE("a reader of another process sees histories as they were in one commit") {
  check(testing::race_for_histories(Repeater::In::kProcess, 100'000));
}

TEST_CASE("a reader of another process never takes one frame for another") {
  check(testing::race_for_slots(Repeater::In::kProcess, 500'000));
}

// ThreadSanitizer reports that a value is read while it is overwritten, which the horizon tells.
#ifndef TFDUDE_THREAD_SANITIZER
TEST_CASE("a reader in another thread sees commits whole and in order") {
  check(testing::race_for_batches(Repeater::In::kThread, 300'000));
  check(testing::race_for_histories(Repeater::In::kThread, 50'000));
  check(testing::race_for_slots(Repeater::In::kThread, 300'000));
}
#endif

}  // namespace tfdude
