#include "tree/sample_history.hpp"

#include <memory>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "tree/sample_store.hpp"

namespace tfdude {
namespace {

using testing::along_x;

const EdgeTiming kTiming;

// Sample n has the stamp 10 n.
struct Filled {
  explicit Filled(std::uint64_t count) : history(SampleHistory::create(arena, kTiming)) {
    while (history->next() < count) append();
  }
  void append() {
    if (history->full()) history = history->grown();
    const auto n = static_cast<std::int64_t>(history->next());
    history->append(10 * n, 1, {along_x(static_cast<double>(n))}, store);
  }

  Arena arena;
  SampleStore store{arena};
  SampleHistory::Pointer history;
};

}  // namespace

TEST_CASE("a sample whose place was taken by a later one is not found") {
  Filled of(16);
  for (std::uint64_t n = 0; n < 16; ++n)
    REQUIRE(of.history->sample(n)->stamp == 10 * static_cast<std::int64_t>(n));
  // As many as fit, so the ring buffer does not grow.
  for (int i = 0; i < 200; ++i) {
    while (of.history->count() > 8) of.history->drop_oldest(of.store);
    of.append();
  }
  CHECK(of.history->sample(0) == nullptr);
  CHECK(of.history->sample(8) == nullptr);
  CHECK(of.history->stamp(0) == kAlways);
  CHECK(of.history->sample(of.history->oldest())->stamp == of.history->first_stamp());
  CHECK(of.history->sample(215)->stamp == 2150);
}

TEST_CASE("the samples around an instant are found however many there are and wherever it is") {
  for (const std::uint64_t count : {2U, 7U, 8U, 9U, 17U, 1000U}) {
    Filled of(count);
    for (std::uint64_t dropped = 0; dropped + 2 < count && dropped < 12; ++dropped) {
      std::uint64_t back = 0;
      for (std::uint64_t n = of.history->oldest(); n + 1 < count; ++n) {
        for (const std::int64_t more : {0, 3, 9}) {
          const auto t = 10 * static_cast<std::int64_t>(n) + more;
          const auto found = of.history->around(t, count - 1, back);
          REQUIRE(found.before == of.history->sample(n));
          REQUIRE(found.after == of.history->sample(n + 1));
        }
      }
      CHECK(of.history->around(of.history->first_stamp() - 1, count - 1, back).before == nullptr);
      of.history->drop_oldest(of.store);
    }
  }
}

TEST_CASE("late samples share the chunks before them, and all memory is given back") {
  Filled of(100);
  const std::size_t bytes = of.store.bytes();
  Sample late;
  late.stamp = 805;
  late.shared = of.store.share({along_x(80.5)}, of.history->sample(80)->shared);
  const auto with = of.history->with(late, 81, of.store);
  CHECK(with->next() == 101);
  CHECK(with->sample(79) == of.history->sample(79));
  CHECK(with->sample(81)->stamp == 805);
  CHECK(with->sample(82)->stamp == 810);
  CHECK(with->sample(100)->stamp == 990);
  // What readers of earlier commits see stays.
  CHECK(of.history->sample(81)->stamp == 810);
  CHECK(of.store.bytes() == bytes);
  with->drop_all(of.store);
  CHECK(of.store.bytes() == 0);
}

}  // namespace tfdude
