// What each participant sends and receives grows with the changes, not with the pairs of
// participants. Four times as many participants have sixteen times as many pairs.
#include <string>
#include <utility>

#include "simulation/calm.hpp"
#include "support/catch.hpp"

namespace tfdude::simulation {
namespace {

constexpr std::size_t kFew = 10;
constexpr std::size_t kMany = 40;
constexpr std::size_t kFramesEach = 7;  // they fit into one page, with one more
constexpr double kTimes = static_cast<double>(kMany) / kFew;
// Ids are longer by a digit, and two messages may become one.
constexpr double kAbout = 1.1;

struct Pair {
  CalmRun few;
  CalmRun many;
};

const Pair& both() {
  static const Pair runs = [] {
    const auto run = [](std::size_t partitions) {
      auto done = run_calm({partitions, kFramesEach * partitions});
      INFO((done ? std::string() : done.error().message));
      REQUIRE(done);
      return *std::move(done);
    };
    return Pair{run(kFew), run(kMany)};
  }();
  return runs;
}

void check_at_most(const Count& many, const Count& few, double times) {
  CHECK(many.messages <= few.messages * times * kAbout);
  CHECK(many.bytes <= few.bytes * times * kAbout);
}

TEST_CASE("scale: at the start, a participant writes as much whoever hears it") {
  const auto& [few, many] = both();
  CHECK(few.start.mean.written.messages >= 3);  // its claim, its presence, its page
  check_at_most(many.start.most.written, few.start.most.written, 1);
  check_at_most(many.start.most.received, few.start.most.received, kTimes);
  check_at_most(many.start.most.sent, few.start.most.sent, kTimes);
}

TEST_CASE("scale: an idle participant sends nothing, and hears each other one") {
  const auto& [few, many] = both();
  for (const CalmRun* run : {&few, &many}) {
    CHECK(run->idle.all.written.messages == 0);
    CHECK(run->idle.all.sent.messages == 0);
    CHECK(run->idle.all.received.messages == 0);
    CHECK(run->idle.all.probes == 0);
  }
  CHECK(few.idle.mean.heard >= kFew - 1);
  CHECK(many.idle.most.heard <= few.idle.most.heard * kTimes * kAbout);
}

TEST_CASE("scale: an added frame costs each participant one page, however many there are") {
  const auto& [few, many] = both();
  CHECK(few.add.all.written.messages >= 3);  // the request, the reply, the page
  check_at_most(many.add.all.written, few.add.all.written, 1);
  // The page, and a share of the request and of the reply.
  CHECK(few.add.mean.received.messages >= 1 - 1.0 / kFew);
  check_at_most(many.add.mean.received, few.add.mean.received, 1);
  check_at_most(many.add.mean.sent, few.add.mean.sent, 1);
  check_at_most(many.add.most.sent, few.add.most.sent, kTimes);
}

TEST_CASE("scale: an update and a lookup concern two participants") {
  const auto& [few, many] = both();
  for (const auto& [most, least] :
       {std::pair(&many.update, &few.update), std::pair(&many.lookup, &few.lookup)}) {
    CHECK(least->all.sent.messages >= 2);
    check_at_most(most->all.sent, least->all.sent, 1);
    check_at_most(most->all.received, least->all.received, 1);
    CHECK(most->all.probes <= least->all.probes * kAbout);
  }
}

TEST_CASE("scale: one more owner costs each participant in proportion to the others") {
  const auto& [few, many] = both();
  check_at_most(many.join.mean.written, few.join.mean.written, 1);
  check_at_most(many.join.mean.received, few.join.mean.received, kTimes);
  check_at_most(many.join.most.sent, few.join.most.sent, kTimes);
}

TEST_CASE("scale: a run needs two partitions, and a frame for each") {
  CHECK(run_calm({1, 10}).error().code == Errc::kInvalidInput);
  CHECK(run_calm({10, 9}).error().code == Errc::kInvalidInput);
}

}  // namespace
}  // namespace tfdude::simulation
