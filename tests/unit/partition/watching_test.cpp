#include "tfdude/partition/watching.hpp"

#include <chrono>
#include <set>
#include <string>

#include "support/catch.hpp"
#include "support/forest_support.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::along_x;
using testing::outcome;

Time ms(std::int64_t milliseconds) { return Time(Milliseconds(milliseconds)); }

struct Arm {
  Arm() {
    REQUIRE(forest.add("base", "world", along_x(1), Forest::MissingParent::kAllow));
    REQUIRE(forest.add("arm", "base", along_x(10)));
    REQUIRE(forest.add("hand", "arm", along_x(100)));
    REQUIRE(forest.put_remote("far", "", 1));
  }
  Forest forest;
};

// "index@stamp=x", in the order of the entries.
std::string listed(const State& state) {
  std::string text;
  for (const News& entry : state.entries) {
    text += std::to_string(entry.index) + "@" +
            (entry.stamp ? std::to_string(nanoseconds(*entry.stamp) / 1'000'000) : "-") + "=" +
            std::to_string(std::lround(entry.X.pose.translation().x())) + " ";
  }
  return text;
}

}  // namespace

TEST_CASE("a group is told all, then what changes, once") {
  Arm arm;
  WatchedGroup group(7, {{"arm", "hand"}});
  CHECK(group.snapshot(arm.forest)->group == 7);
  CHECK(listed(*group.snapshot(arm.forest)) == "0@-=10 1@-=100 ");
  CHECK(listed(group.news(arm.forest)) == "0@-=10 1@-=100 ");
  CHECK(listed(group.news(arm.forest)).empty());
  REQUIRE(arm.forest.update({{"arm", along_x(11)}, {"hand", along_x(101)}}, ms(1)));
  REQUIRE(arm.forest.update({{"arm", along_x(12)}, {"hand", along_x(102)}}, ms(2)));
  REQUIRE(arm.forest.update("base", along_x(5)));  // nobody watches that
  CHECK(listed(group.news(arm.forest)) == "0@2=12 1@2=102 ");
  REQUIRE(arm.forest.update({{"arm", along_x(13)}, {"hand", along_x(103)}}, ms(3)));
  REQUIRE(arm.forest.update({{"arm", along_x(14)}, {"hand", along_x(104)}}, ms(4)));
  CHECK(listed(group.news(arm.forest)) == "0@3=13 1@3=103 0@4=14 1@4=104 ");
  CHECK(group.news(arm.forest).entries.empty());
  CHECK(listed(*group.snapshot(arm.forest)) == "0@4=14 1@4=104 ");
}

TEST_CASE("at a lower rate only the newest is told") {
  Arm arm;
  WatchedGroup group(7, {{"arm"}, {}, 10ms});
  REQUIRE(group.snapshot(arm.forest));
  for (int t = 1; t < 10; ++t) {
    REQUIRE(arm.forest.update("arm", along_x(t), ms(2 * t)));
    REQUIRE(arm.forest.update("arm", along_x(t), ms(2 * t + 1)));
    CHECK(listed(group.news(arm.forest)) ==
          "0@" + std::to_string(2 * t + 1) + "=" + std::to_string(t) + " ");
  }
}

TEST_CASE("a segment may be told as one transform") {
  Arm arm;
  WatchedGroup group(7, {{}, {{"world", "hand"}, {"base", "base"}}});
  CHECK(listed(*group.snapshot(arm.forest)) == "0@-=111 1@-=0 ");
  CHECK(listed(group.news(arm.forest)) == "0@-=111 1@-=0 ");
  CHECK(listed(group.news(arm.forest)).empty());
  REQUIRE(arm.forest.update("base", along_x(2)));
  CHECK(listed(group.news(arm.forest)) == "0@-=112 ");
  REQUIRE(arm.forest.update("arm", along_x(20), ms(5)));
  CHECK(listed(group.news(arm.forest)).find("0@5=122") == 0);
  CHECK(listed(group.news(arm.forest)).empty());
}

TEST_CASE("who watches what is not owned here is told so, and what goes is left out") {
  Arm arm;
  for (const char* id : {"far", "nobody", "world"}) {
    WatchedGroup group(7, {{"arm", id}});
    const auto snapshot = group.snapshot(arm.forest);
    CHECK(outcome(snapshot) == "not_owner");
    CHECK(snapshot.error().message.find("'" + std::string(id) + "'") != std::string::npos);
  }
  WatchedGroup segments(7, {{}, {{"far", "hand"}}});
  CHECK_FALSE(segments.snapshot(arm.forest));
  CHECK(segments.news(arm.forest).entries.empty());
  WatchedGroup group(7, {{"arm", "hand"}});
  REQUIRE(group.snapshot(arm.forest));
  (void)group.news(arm.forest);
  REQUIRE(arm.forest.remove("hand"));
  REQUIRE(arm.forest.update("arm", along_x(3)));
  CHECK(listed(group.news(arm.forest)) == "0@-=3 ");
  // One that comes back under its name is told again after the next renewal.
  REQUIRE(arm.forest.add("hand", "arm", along_x(4)));
  CHECK(listed(*group.snapshot(arm.forest)) == "0@-=3 1@-=4 ");
  CHECK(listed(group.news(arm.forest)) == "0@-=3 1@-=4 ");
}

TEST_CASE("only who asks for the same of the same owner is in one group") {
  const WatchRequest edges{{"arm", "hand"}};
  std::set<std::uint64_t> groups{
      watch_group("arms", edges),
      watch_group("legs", edges),
      watch_group("arms", {{"hand", "arm"}}),
      watch_group("arms", {{"armhand"}}),
      watch_group("arms", {{"arm", "hand"}, {}, 1ms}),
      watch_group("arms", {{}, {{"arm", "hand"}}}),
      watch_group("arms", {{}, {{"hand", "arm"}}}),
      watch_group("arms", {}),
  };
  CHECK(groups.size() == 8);
  CHECK(watch_group("arms", {{"arm", "hand"}}) == watch_group("arms", edges));
}

}  // namespace tfdude
