#include "partition/name_claim.hpp"

#include <algorithm>
#include <array>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "partition/incarnation.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::Random;
using Turn = NameClaim::Turn;

Time at(std::int64_t nanoseconds) { return Time(std::chrono::nanoseconds(nanoseconds)); }

TEST_CASE("an incarnation is above every known one whatever the clock") {
  IncarnationSource source;
  const std::uint64_t first = source.next(at(1'000'000'000'000'000), 7);
  source.saw(first);
  for (const std::int64_t clock : {std::int64_t{-5}, std::int64_t{0}, std::int64_t{999},
                                   std::int64_t{2'000'000'000'000'000}}) {
    for (const std::uint64_t random : {std::uint64_t{0}, ~std::uint64_t{0}}) {
      INFO("clock " << clock << ", random " << random);
      CHECK(source.next(at(clock), random) > first);
    }
  }
  // With equal knowledge, the later clock gives the greater incarnation.
  CHECK(source.next(at(3'000'000'000'000'000), 0) > source.next(at(2'000'000'000'000'000), ~0ULL));
}

TEST_CASE("an incarnation that no clock could give is ignored") {
  IncarnationSource source;
  source.saw(~std::uint64_t{0});
  source.saw(IncarnationSource::kEnd);
  CHECK(source.next(at(0), 0) < 1ULL << 21U);
}

TEST_CASE("an incarnation stays within the range of those that are accepted") {
  IncarnationSource source;
  source.saw(kLastIncarnation);
  for (const std::uint64_t random : {std::uint64_t{0}, ~std::uint64_t{0}}) {
    CHECK(source.next(at(0), random) < IncarnationSource::kEnd);
    CHECK(source.next(at(0), random) > kLastIncarnation - (2ULL << IncarnationSource::kRandomBits));
  }
}

TEST_CASE("processes that start at the same instant get different incarnations") {
  Random random(0x1ca2);
  INFO("seed " << random.seed());
  std::set<std::uint64_t> all;
  const IncarnationSource source;
  for (int i = 0; i < 500; ++i) all.insert(source.next(at(42), random.engine()()));
  // 500 random numbers out of 2^20: only a few may occur twice.
  CHECK(all.size() >= 498);
}

Presence claim_of(std::uint64_t ticket) {
  Presence claim{"arms", ticket, "tower", 1, 0, false};
  claim.ticket = ticket;
  return claim;
}

TEST_CASE("a single claimant gets the name") {
  const NameClaim claim(claim_of(5));
  CHECK(claim.to_take() == Turn::kMine);
  CHECK(claim.to_serve() == Turn::kMine);
  CHECK_FALSE(claim.rival());
}

TEST_CASE("a process that serves keeps the name until it is lost") {
  NameClaim claim(claim_of(5));
  Presence server = claim_of(9);
  server.serving = true;
  server.incarnation = 77;
  claim.hear(server);
  CHECK(claim.to_take() == Turn::kOthers);
  CHECK(claim.served());
  CHECK(claim.rival()->ticket == 9);
  claim.lost(9);
  CHECK(claim.served());
  SECTION("lost") { claim.lost(77); }
  SECTION("stopped") {
    server.stopped = true;
    claim.hear(server);
  }
  CHECK(claim.to_take() == Turn::kMine);
}

TEST_CASE("of two concurrent claims the one with the smaller ticket wins") {
  NameClaim lesser(claim_of(5));
  NameClaim greater(claim_of(6));
  lesser.hear(claim_of(6));
  greater.hear(claim_of(5));
  CHECK(lesser.to_take() == Turn::kMine);
  CHECK(greater.to_take() == Turn::kOthers);
}

TEST_CASE("equal tickets are ordered by host and process") {
  Presence other = claim_of(5);
  other.pid = 2;
  NameClaim one(claim_of(5));
  NameClaim two(other);
  one.hear(other);
  two.hear(claim_of(5));
  CHECK(one.to_take() == Turn::kMine);
  CHECK(two.to_take() == Turn::kOthers);
}

TEST_CASE("a process that has taken the name waits for an earlier claim") {
  NameClaim claim(claim_of(5));
  Presence earlier = claim_of(4);
  claim.hear(earlier);
  CHECK(claim.to_serve() == Turn::kWait);
  SECTION("which takes the name") {
    earlier.taken = true;
    claim.hear(earlier);
    CHECK(claim.to_serve() == Turn::kOthers);
  }
  SECTION("which gives up") {
    earlier.stopped = true;
    claim.hear(earlier);
    CHECK(claim.to_serve() == Turn::kMine);
  }
}

// Processes that claim one name. The messages of each reach every other in order, after a random
// delay.
class Contest {
 public:
  Contest(Random& random, std::size_t many) : random_(random) {
    for (std::size_t i = 0; i < many; ++i) {
      Presence own = claim_of(random.index(3) == 0 ? 1 + random.index(2) : random.engine()());
      own.pid = static_cast<std::uint32_t>(i);
      claimants_.push_back({own, NameClaim(own), Stage::kNew, 0, 0});
    }
  }

  /// @param delay  how long a message takes at most; @return how many serve in the end
  std::size_t run(std::size_t delay) {
    for (clock_ = 0; clock_ < 400; ++clock_) {
      deliver(delay);
      for (std::size_t i = 0; i < claimants_.size(); ++i) step(i, delay);
    }
    return static_cast<std::size_t>(
        std::count_if(claimants_.begin(), claimants_.end(),
                      [](const Claimant& one) { return one.stage == Stage::kServing; }));
  }

 private:
  enum class Stage { kNew, kClaiming, kTaken, kServing, kOut };
  struct Claimant {
    Presence said;
    NameClaim claim;
    Stage stage;
    std::size_t since;
    std::size_t pause;
  };
  struct Message {
    std::size_t sent;
    Presence presence;
  };

  void say(std::size_t who) {
    for (std::size_t to = 0; to < claimants_.size(); ++to) {
      if (to != who) ways_[{who, to}].push_back({clock_, claimants_[who].said});
    }
    claimants_[who].since = clock_;
  }

  void deliver(std::size_t delay) {
    for (auto& [way, messages] : ways_) {
      while (!messages.empty()) {
        const bool due = clock_ - messages.front().sent >= delay;
        if (!due && random_.index(3) != 0) break;
        claimants_[way.second].claim.hear(messages.front().presence);
        messages.pop_front();
      }
    }
  }

  void step(std::size_t i, std::size_t delay) {
    Claimant& one = claimants_[i];
    switch (one.stage) {
      case Stage::kNew:
        if (random_.index(8) != 0) return;
        one.stage = Stage::kClaiming;
        say(i);
        return;
      case Stage::kClaiming:
        if (clock_ - one.since < 2 * delay + 1) return;
        if (one.claim.to_take() == Turn::kMine) {
          one.said.taken = true;
          one.stage = Stage::kTaken;
        } else {
          one.said.stopped = true;
          one.stage = Stage::kOut;
        }
        say(i);
        one.pause = random_.index(60);  // it opens its file, and reads it
        return;
      case Stage::kTaken:
        decide(i, one);
        return;
      default:
        return;
    }
  }

  void decide(std::size_t i, Claimant& one) {
    const Turn turn = one.claim.to_serve();
    if (turn == Turn::kWait) return;
    one.said.serving = turn == Turn::kMine;
    one.said.stopped = turn == Turn::kOthers;
    if (turn == Turn::kMine && one.pause > 0) {
      // The process has decided to serve, and announces it later.
      --one.pause;
      return;
    }
    one.stage = turn == Turn::kMine ? Stage::kServing : Stage::kOut;
    say(i);
  }

  Random& random_;
  std::size_t clock_ = 0;
  std::vector<Claimant> claimants_;
  std::map<std::pair<std::size_t, std::size_t>, std::deque<Message>> ways_;
};

TEST_CASE("exactly one of several claimants serves in any order of messages") {
  Random random(0xc1a1);
  INFO("seed " << random.seed());
  for (int round = 0; round < 3000; ++round) {
    const std::size_t many = 2 + random.index(3);
    const std::size_t delay = random.index(12);
    INFO("round " << round << ": " << many << " claimants, delay " << delay);
    REQUIRE(Contest(random, many).run(delay) == 1);
  }
}

}  // namespace
}  // namespace tfdude
