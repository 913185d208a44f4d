#include "partition/asked_frames.hpp"

#include <chrono>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::outcome;
using testing::presence_of;
using testing::Replica;
using Lines = std::vector<std::string>;

constexpr Time kNow{std::chrono::milliseconds(1500)};
constexpr AskedFrames::Steady kOnce{std::chrono::seconds(1)};
constexpr AskedFrames::Steady kLater{std::chrono::seconds(2)};

// An owner that knows world(robot) - base(robot) - arm(arms) - hand(arms) and island(arms).
struct Knower : Replica {
  Knower() : Replica("robot") {
    REQUIRE(forest.add("world", "", along_x(0)));
    REQUIRE(forest.add("base", "world", along_x(1)));
    directory.apply(presence_of("arms", 1, 1), kNow);
    directory.apply(Page{"arms", 0, 1, 7, {{"hand", "arm"}, {"arm", "base"}, {"island", "lost"}}});
  }
  [[nodiscard]] Lines answer(const FramesRequest& request) const {
    Lines lines;
    const auto known = known_frames(forest, directory, request);
    REQUIRE(known);
    for (const KnownFrame& frame : *known) {
      lines.push_back(frame.id + " < " + frame.parent + " @ " + frame.partition);
    }
    return lines;
  }
};

// A client that has no pages.
struct Asker : Replica {
  Asker() { directory.do_without_pages(); }
  void take(const std::vector<std::string>& ids, const std::vector<KnownFrame>& answer,
            AskedFrames::Steady at = kOnce) {
    asked.take(FramesRequest{ids}, answer, at);
  }
  AskedFrames asked{forest, directory};
};

}  // namespace

// Once, 4096 overlapping trees took 12 s.
TEST_CASE("asked frames: the work does not grow with the number of overlapping trees") {
  Replica owner("robot");
  constexpr std::size_t kDeep = 3000;
  REQUIRE(owner.forest.add("f0", "", along_x(0)));
  for (std::size_t i = 1; i < kDeep; ++i) {
    REQUIRE(owner.forest.add("f" + std::to_string(i), "f" + std::to_string(i - 1), along_x(0)));
  }
  FramesRequest request;
  for (std::size_t i = 0; i < kMaxItems; ++i) {
    request.trees.push_back("f" + std::to_string(i % kDeep));
  }
  const auto start = std::chrono::steady_clock::now();
  const auto known = known_frames(owner.forest, owner.directory, request);
  CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(1));
  REQUIRE(known);
  CHECK(known->size() == kDeep);
  // Patterns cost a comparison with each frame.
  request.trees.assign(64, "f*");
  CHECK(known_frames(owner.forest, owner.directory, request)->size() == kDeep);
  request.trees.assign(65, "f*");
  const auto refused = known_frames(owner.forest, owner.directory, request);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::kTooMuch);
  CHECK(refused.error().message == "65 patterns of names, of at most 64");
}

TEST_CASE("asked frames: an owner answers with all above them, parents first and each once") {
  const Knower owner;
  CHECK(owner.answer({{"hand", "base"}}) == Lines{"world <  @ robot", "base < world @ robot",
                                                  "arm < base @ arms", "hand < arm @ arms"});
  CHECK(owner.answer({{"island"}}) == Lines{"island < lost @ arms"});
  CHECK(owner.answer({{"nothing"}}).empty());
}

TEST_CASE("asked frames: an owner answers with trees and with all frames that begin so") {
  const Knower owner;
  CHECK(owner.answer({{}, {"arm"}}) == Lines{"world <  @ robot", "base < world @ robot",
                                             "arm < base @ arms", "hand < arm @ arms"});
  CHECK(owner.answer({{}, {"isl*"}}) == Lines{"island < lost @ arms"});
  CHECK(owner.answer({{}, {"*"}}).size() == 5);
  CHECK(owner.answer({{}, {"nothing", "nothing*"}}).empty());
}

TEST_CASE("asked frames: an owner does not answer before it knows what the requester has seen") {
  Knower owner;
  const auto ask = [&](const std::string& partition, std::uint64_t epoch) {
    return outcome(
        known_frames(owner.forest, owner.directory, {{"hand"}, {}, {{partition, epoch}}}));
  };
  CHECK(ask("arms", 7) == "ok");
  CHECK(ask("arms", 8) == "not_yet");
  CHECK(ask("legs", 1) == "not_yet");
  CHECK(ask("robot", 99) == "ok");  // its own changes
  // What a lost partition has acknowledged may never come.
  REQUIRE(owner.directory.lost("arms", 1, kNow));
  CHECK(ask("arms", 8) == "ok");
}

TEST_CASE("asked frames: an answer has a limit") {
  Knower owner;
  for (std::size_t i = 0; i < kMaxItems; ++i) {
    REQUIRE(owner.forest.add("many_" + std::to_string(i), "world", along_x(1)));
  }
  const auto many = known_frames(owner.forest, owner.directory, {{}, {"many_*"}});
  CHECK(outcome(many) == "too_much");
}

TEST_CASE("asked frames: what was answered is known until a later answer is needed") {
  Asker asker;
  CHECK(asker.asked.lacking({"hand", "arm", "hand", ""}, kOnce) == Lines{"hand", "arm"});
  asker.take({"hand"}, {{"arm", "", "arms"}, {"hand", "arm", "arms"}});
  CHECK(asker.structure() == Lines{"arm <  @ arms", "hand < arm @ arms, attached"});
  CHECK(asker.asked.lacking({"hand", "arm"}, kOnce).empty());
  CHECK(asker.asked.lacking({"hand", "arm"}, kLater) == Lines{"hand", "arm"});
  asker.asked.outdate();
  CHECK(asker.asked.lacking({"hand"}, kOnce) == Lines{"hand"});
  CHECK(asker.forest.exists("hand"));
}

TEST_CASE("asked frames: a later answer replaces owners and parents, and drops what is gone") {
  Asker asker;
  asker.take({"hand"}, {{"arm", "", "arms"}, {"hand", "arm", "arms"}});
  const auto handle = asker.forest.find("hand");
  asker.take({"hand"}, {{"leg", "", "legs"}, {"hand", "leg", "legs"}}, kLater);
  CHECK(asker.structure() ==
        Lines{"arm <  @ arms", "hand < leg @ legs, attached", "leg <  @ legs"});
  CHECK(asker.forest.info(handle.value())->parent == "leg");
  // Its parent no longer exists.
  asker.take({"hand"}, {{"hand", "leg", "legs"}}, kLater);
  CHECK(asker.structure() == Lines{"arm <  @ arms", "hand < leg @ legs"});
  asker.take({"hand", "arm"}, {}, kLater);
  CHECK(asker.structure().empty());
}

TEST_CASE("asked frames: an answer to an earlier question undoes nothing") {
  Asker asker;
  asker.take({"hand"}, {{"leg", "", "legs"}, {"hand", "leg", "legs"}}, kLater);
  asker.take({"hand"}, {{"arm", "", "arms"}, {"hand", "arm", "arms"}}, kOnce);
  const Lines newest{"arm <  @ arms", "hand < leg @ legs, attached", "leg <  @ legs"};
  CHECK(asker.structure() == newest);
  asker.take({"hand", "leg"}, {}, kOnce);
  CHECK(asker.structure() == newest);
}

TEST_CASE("asked frames: frames that changed places make no cycle") {
  Asker asker;
  asker.take({"c"}, {{"a", "", "arms"}, {"b", "a", "arms"}, {"c", "b", "arms"}});
  asker.take({"a"}, {{"c", "", "arms"}, {"b", "c", "arms"}, {"a", "b", "arms"}}, kLater);
  CHECK(asker.structure() ==
        Lines{"a < b @ arms, attached", "b < c @ arms, attached", "c <  @ arms"});
}

TEST_CASE("asked frames: a participant without pages lacks none, and tells what it has seen") {
  Asker asker;
  asker.directory.apply(presence_of("arms", 1, 3), kNow);
  CHECK(asker.directory.complete());
  const auto arms = asker.directory.owner("arms");
  REQUIRE(arms);
  CHECK(asker.directory.note_announced_epoch(*arms, 5));
  CHECK_FALSE(asker.directory.note_announced_epoch(*arms, 5));
  CHECK(asker.directory.behind() == nullptr);
  const auto seen = asker.asked.request({"hand"}, {}).seen;
  REQUIRE(seen.size() == 1);
  CHECK(seen[0].partition == "arms");
  CHECK(seen[0].epoch == 5);
}

}  // namespace tfdude
