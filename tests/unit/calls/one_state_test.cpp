// Several reads of one owner's edges, of which some are read in its memory.

#include <chrono>
#include <cstdint>
#include <utility>
#include <vector>

#include "calls/one_state_task.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using Next = Task::Next;
using testing::along_x;

constexpr std::uint64_t kProcess = 7;
constexpr std::uint64_t kInMemory = 0;

Query at(std::chrono::seconds instant) {
  Query query;
  query.at = Time(instant);
  return query;
}

Reply answer(double x, std::uint64_t commit, std::uint64_t incarnation) {
  SegmentValues values;
  values.values.push_back(along_x(x));
  values.correlations.resize(1);
  values.correlations[0].observed_with = {"arm", "arm"};
  values.stamp = Time(1s);
  values.commit = commit;
  values.incarnation = incarnation;
  Reply reply;
  reply.body = std::move(values);
  return reply;
}

// Of one path at two instants; the owner commits so often that no two reads are of one commit.
struct Reads {
  Reads() {
    replica.directory.apply(testing::presence_of("arms", kProcess, 1), Time(1s));
    replica.directory.apply(Page{"arms", 0, kProcess, 1, {{"base", ""}, {"arm", "base"}}});
    REQUIRE(task.plan(replica.directory, {}));
    REQUIRE(task.parts().size() == 2);
    for (int i = 1; i < OneStateTask::kTriesForOneCommit; ++i) both(1, 2);
  }
  Next both(std::uint64_t first, std::uint64_t last) {
    const auto next = task.take({answer(1, first, kProcess), answer(1, last, kInMemory)}, {});
    REQUIRE(next);
    return *next;
  }
  Next again(double x, std::uint64_t commit, std::uint64_t incarnation) {
    const auto next = task.take({answer(x, commit, incarnation)}, {});
    REQUIRE(next);
    return *next;
  }
  bool compares() { return task.parts().size() == 1; }

  testing::Replica replica;
  OneStateTask task{replica.forest, {{"base", "arm", at(1s)}, {"base", "arm", at(2s)}}, false};
};

}  // namespace

TEST_CASE("one state: reads over both ways are in the order of their commits") {
  Reads reads;
  // The last read is of the commit 5; the others are of after a change that 6 has made.
  CHECK(reads.both(7, 5) == Next::kAsk);
  CHECK(reads.again(1, 9, kProcess) == Next::kAsk);
  REQUIRE_FALSE(reads.compares());
  // What is read again is to be of after the last read.
  CHECK(reads.both(10, 12) == Next::kAsk);
  CHECK(reads.again(1, 11, kProcess) == Next::kAsk);
  REQUIRE_FALSE(reads.compares());
  CHECK(reads.both(13, 14) == Next::kAsk);
  CHECK(reads.again(2, 15, kProcess) == Next::kAsk);
  REQUIRE_FALSE(reads.compares());
  CHECK(reads.both(16, 17) == Next::kAsk);
  CHECK(reads.again(1, 18, kInMemory) == Next::kDone);
}

}  // namespace tfdude
