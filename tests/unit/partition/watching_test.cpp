#include "partition/watching.hpp"

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

const PathEnds kArm{"base", "arm"};
const PathEnds kHand{"arm", "hand"};

// "index@stamp=x", in the order of the entries.
std::string listed(const PushedValues& pushed) {
  std::string text;
  for (const PushedValue& entry : pushed.entries) {
    text += std::to_string(entry.index) + "@" +
            (entry.stamp ? std::to_string(nanoseconds(*entry.stamp) / 1'000'000) : "-") + "=" +
            std::to_string(std::lround(entry.X.pose.translation().x())) + " ";
  }
  return text;
}

}  // namespace

TEST_CASE("a group is pushed all values and then each change once") {
  Arm arm;
  WatchedGroup group(7, {{kArm, kHand}});
  CHECK(group.snapshot(arm.forest, {})->group == 7);
  CHECK(listed(*group.snapshot(arm.forest, {})) == "0@-=10 1@-=100 ");
  CHECK(listed(group.next_push(arm.forest)) == "0@-=10 1@-=100 ");
  CHECK(listed(group.next_push(arm.forest)).empty());
  REQUIRE(arm.forest.update({{"arm", along_x(11)}, {"hand", along_x(101)}}, ms(1)));
  REQUIRE(arm.forest.update({{"arm", along_x(12)}, {"hand", along_x(102)}}, ms(2)));
  REQUIRE(arm.forest.update("base", along_x(5)));  // nobody watches that
  CHECK(listed(group.next_push(arm.forest)) == "0@1=11 1@1=101 0@2=12 1@2=102 ");
  REQUIRE(arm.forest.update({{"arm", along_x(13)}, {"hand", along_x(103)}}, ms(3)));
  REQUIRE(arm.forest.update({{"arm", along_x(14)}, {"hand", along_x(104)}}, ms(4)));
  CHECK(listed(group.next_push(arm.forest)) == "0@3=13 1@3=103 0@4=14 1@4=104 ");
  CHECK(group.next_push(arm.forest).entries.empty());
  CHECK(listed(*group.snapshot(arm.forest, {})) == "0@4=14 1@4=104 ");
  CHECK(listed(*group.snapshot(arm.forest, ms(3))) == "0@3=13 1@3=103 0@4=14 1@4=104 ");
  // Late samples are pushed, too.
  REQUIRE(arm.forest.update({{"arm", along_x(9)}, {"hand", along_x(99)}}, Time(2500us)));
  CHECK(listed(group.next_push(arm.forest)) == "0@2=9 1@2=99 ");
}

TEST_CASE("the first push has all edges and what was written since the first reply") {
  Arm arm;
  REQUIRE(arm.forest.update("arm", along_x(11), ms(1)));
  REQUIRE(arm.forest.update("arm", along_x(13), ms(3)));
  WatchedGroup group(7, {{kArm, kHand}});
  WatchedGroup slow(8, {{kArm, kHand}, false, false, 10ms});
  WatchedGroup composed(9, {{{"base", "hand"}}, true});
  for (WatchedGroup* one : {&group, &slow, &composed}) {
    one->begin(*one->snapshot(arm.forest, {}));
  }
  SECTION("nothing") {
    CHECK(listed(group.next_push(arm.forest)) == "1@-=100 0@3=13 ");
    CHECK(listed(slow.next_push(arm.forest)) == "1@-=100 0@3=13 ");
    CHECK(listed(composed.next_push(arm.forest)) == "0@3=113 ");
  }
  SECTION("samples, of which one is late") {
    REQUIRE(arm.forest.update("arm", along_x(12), ms(2)));
    REQUIRE(arm.forest.update("arm", along_x(14), ms(4)));
    REQUIRE(arm.forest.update("arm", along_x(15), ms(5)));
    CHECK(listed(group.next_push(arm.forest)) == "1@-=100 0@2=12 0@4=14 0@5=15 ");
    CHECK(listed(slow.next_push(arm.forest)) == "1@-=100 0@5=15 ");
    // Between its neighbours, a late sample has changed the segment.
    CHECK(listed(composed.next_push(arm.forest)) == "0@1=111 0@2=112 0@3=113 0@4=114 0@5=115 ");
  }
  for (WatchedGroup* one : {&group, &slow, &composed}) {
    CHECK(listed(one->next_push(arm.forest)).empty());
  }
}

TEST_CASE("a covariance that stays the same is pushed once") {
  const auto with_stddev = [](double x, double stddev) {
    Transform X = along_x(x);
    X.covariance = *Covariance::from_stddev({stddev, stddev, stddev, stddev, stddev, stddev});
    return X;
  };
  // "number" with the covariance, "(number)" without, in the order of the entries.
  const auto numbers = [](const PushedValues& pushed) {
    std::string text;
    for (const PushedValue& entry : pushed.entries) {
      const std::string number = std::to_string(entry.covariance_number);
      text += entry.covariance_known ? "(" + number + ") " : number + " ";
    }
    return text;
  };
  Arm arm;
  WatchedGroup group(7, {{kArm, kHand}});
  CHECK(numbers(*group.snapshot(arm.forest, {})) == "0 0 ");  // nothing was pushed yet
  CHECK(numbers(group.next_push(arm.forest)) == "1 1 ");
  REQUIRE(arm.forest.update("arm", along_x(11)));
  CHECK(numbers(group.next_push(arm.forest)) == "(1) ");
  REQUIRE(arm.forest.update("hand", with_stddev(101, 0.1), ms(1)));
  REQUIRE(arm.forest.update("hand", with_stddev(102, 0.1), ms(2)));
  REQUIRE(arm.forest.update("hand", with_stddev(103, 0.2), ms(3)));
  CHECK(numbers(*group.snapshot(arm.forest, {})) == "1 0 ");  // its newest was not pushed yet
  CHECK(numbers(group.next_push(arm.forest)) == "2 (2) 3 ");
  // A snapshot has the covariances that the next push refers to.
  CHECK(numbers(*group.snapshot(arm.forest, {})) == "1 3 ");
  KnownCovariances known(2);
  auto all = *group.snapshot(arm.forest, {});
  REQUIRE(known.fill_in(all.entries));
  REQUIRE(arm.forest.update("hand", with_stddev(104, 0.2), ms(4)));
  auto next = group.next_push(arm.forest);
  CHECK(numbers(next) == "(3) ");
  for (PushedValue& entry : next.entries) entry.X.covariance = Covariance();  // as it travels
  REQUIRE(known.fill_in(next.entries));
  CHECK(next.entries.front().X.covariance.of_specified().stddev()[0] == testing::Approx(0.2));
  KnownCovariances stranger(2);
  next.entries.front().covariance_known = true;
  CHECK_FALSE(stranger.fill_in(next.entries));
  CHECK(next.entries.empty());
}

TEST_CASE("each push names the commit of the previous one and the first names none") {
  Arm arm;
  WatchedGroup group(7, {{kArm, kHand}});
  const PushedValues first = group.next_push(arm.forest);
  CHECK(first.after == 0);
  REQUIRE(arm.forest.update("base", along_x(7)));  // nobody watches that
  REQUIRE(arm.forest.update("arm", along_x(11)));
  const PushedValues second = group.next_push(arm.forest);
  CHECK(second.after == first.commit);
  CHECK(second.commit == first.commit + 2);
  CHECK(group.snapshot(arm.forest, {})->after == 0);
  CHECK(group.snapshot(arm.forest, {})->commit == second.commit);
  REQUIRE(arm.forest.update("arm", along_x(12)));
  CHECK(group.next_push(arm.forest).after == second.commit);
}

TEST_CASE("a push in several messages is reassembled when all have arrived") {
  PushedValues pushed{7, {}, 3, 5};
  for (std::uint32_t i = 0; i < 2 * kMaxItems + 1; ++i) {
    pushed.entries.push_back({i, ms(i + 1), along_x(i), {}, 1, {}});
  }
  const auto pieces = pieces_of(PushedValues(pushed));
  REQUIRE(pieces.size() == 3);
  PushedPieces together;
  CHECK_FALSE(together.add(pieces[0]));
  CHECK_FALSE(together.add(pieces[2]));  // one is missing
  CHECK_FALSE(together.add(pieces[0]));
  CHECK_FALSE(together.add(pieces[1]));
  CHECK(together.add({7, {}, 0, 4}));  // a push in one message
  const auto whole = together.add(pieces[2]);
  REQUIRE(whole);
  CHECK(listed(*whole) == listed(pushed));
  CHECK(whole->after == 3);
  CHECK(whole->commit == 5);
  CHECK_FALSE(together.add(pieces[2]));
  PushedValues correlated{7, {}, 0, 5};
  for (std::uint32_t i = 0; i <= kMaxCorrelated; ++i) {
    correlated.entries.push_back({i, {}, along_x(i), {true, {}, {}}, 1, {}});
  }
  CHECK(pieces_of(std::move(correlated)).size() == 2);
  CHECK(pieces_of({7, {}, 0, 5}).size() == 1);
}

TEST_CASE("what is kept of a push in several messages is limited, with its common errors") {
  const bool correlated = GENERATE(false, true);
  PushedValues piece{7, {}, 3, 5, 0, UINT32_MAX};
  const std::size_t each = correlated ? kMaxCorrelated : kMaxItems;
  PushedValue value{0, ms(1), along_x(1), {}, 1, {}};
  if (correlated) value.correlation.common_errors.resize(kMaxCommonErrors);
  piece.entries.assign(each, value);
  const std::size_t most = PushedPieces::kMost / each / (correlated ? kMaxCommonErrors + 1 : 1);
  const auto ends = [&](std::size_t count) {
    PushedPieces together;
    PushedValues one = piece;
    one.pieces = static_cast<std::uint32_t>(count);
    for (one.piece = 0; one.piece + 1 < count; ++one.piece) CHECK_FALSE(together.add(one));
    return together.add(one).has_value();
  };
  CHECK(ends(most));
  CHECK_FALSE(ends(most + 1));
}

TEST_CASE("a watch without edges or with a period beyond the maximum is rejected") {
  CHECK(check_watch({{kArm}, false, false, kMaxWatchPeriod}));
  CHECK(check_watch({{kArm}}));
  CHECK(outcome(check_watch({{kArm}, false, false, kMaxWatchPeriod + 1ns})) == "invalid_input");
  CHECK(outcome(check_watch({{kArm}, false, false, std::chrono::nanoseconds::max()})) ==
        "invalid_input");
  CHECK(outcome(check_watch({{kArm}, false, false, -1ns})) == "invalid_input");
  CHECK(outcome(check_watch({})) == "invalid_input");
}

TEST_CASE("at a lower rate only the newest sample is pushed") {
  Arm arm;
  WatchedGroup group(7, {{kArm}, false, false, 10ms});
  REQUIRE(group.snapshot(arm.forest, {}));
  for (int t = 1; t < 10; ++t) {
    REQUIRE(arm.forest.update("arm", along_x(t), ms(2 * t)));
    REQUIRE(arm.forest.update("arm", along_x(t), ms(2 * t + 1)));
    CHECK(listed(group.next_push(arm.forest)) ==
          "0@" + std::to_string(2 * t + 1) + "=" + std::to_string(t) + " ");
  }
}

TEST_CASE("a segment may be pushed as one transform") {
  Arm arm;
  WatchedGroup group(7, {{{"world", "hand"}, {"base", "base"}}, true});
  CHECK(listed(*group.snapshot(arm.forest, {})) == "0@-=111 1@-=0 ");
  CHECK(listed(group.next_push(arm.forest)) == "0@-=111 1@-=0 ");
  CHECK(listed(group.next_push(arm.forest)).empty());
  REQUIRE(arm.forest.update("base", along_x(2)));
  CHECK(listed(group.next_push(arm.forest)) == "0@-=112 ");
  REQUIRE(arm.forest.update("arm", along_x(20), ms(5)));
  CHECK(listed(group.next_push(arm.forest)).find("0@5=122") == 0);
  CHECK(listed(group.next_push(arm.forest)).empty());
  REQUIRE(arm.forest.update("arm", along_x(30), ms(7)));
  CHECK(listed(*group.snapshot(arm.forest, ms(6))) == "0@6=127 1@6=0 0@7=132 1@7=0 ");
  // The path between the ends has changed.
  const std::uint64_t before = group.next_push(arm.forest).entries.at(0).history;
  REQUIRE(arm.forest.move("hand", "base", along_x(1)));
  const PushedValues after = group.next_push(arm.forest);
  CHECK(listed(after) == "0@-=3 1@-=0 ");
  CHECK(after.entries.at(0).history > before);
  CHECK(after.entries.at(0).process_noise);
}

TEST_CASE("a composed segment is sent again where late samples and static edges change it") {
  Arm arm;
  WatchedGroup group(7, {{{"base", "hand"}}, true});
  for (const int t : {10, 20, 30}) {
    REQUIRE(arm.forest.update("arm", along_x(t), ms(t)));
    const std::string stamp = std::to_string(t);
    CHECK(listed(group.next_push(arm.forest)) == "0@" + stamp + "=1" + stamp + " ");
  }
  REQUIRE(arm.forest.update("arm", along_x(26), ms(25)));
  CHECK(listed(group.next_push(arm.forest)) == "0@20=120 0@25=126 ");
  REQUIRE(arm.forest.update("arm", along_x(40), ms(40)));
  CHECK(listed(group.next_push(arm.forest)) == "0@40=140 ");
  REQUIRE(arm.forest.update("arm", along_x(5), ms(5)));
  CHECK(listed(group.next_push(arm.forest)) == "0@5=105 0@10=110 ");
  REQUIRE(arm.forest.update("hand", along_x(200)));
  CHECK(listed(group.next_push(arm.forest)) ==
        "0@5=205 0@10=210 0@20=220 0@25=226 0@30=230 0@40=240 ");
  CHECK(listed(group.next_push(arm.forest)).empty());
  CHECK(listed(*group.snapshot(arm.forest, ms(12))) ==
        "0@12=212 0@20=220 0@25=226 0@30=230 0@40=240 ");
  CHECK(listed(*group.snapshot(arm.forest, ms(0))) ==
        "0@5=205 0@10=210 0@20=220 0@25=226 0@30=230 0@40=240 ");
}

TEST_CASE("a late sample changes composed values also at the stamps of other edges") {
  Arm arm;
  WatchedGroup group(7, {{{"base", "hand"}}, true});
  REQUIRE(arm.forest.update({{"arm", along_x(10)}, {"hand", along_x(100)}}, ms(10)));
  REQUIRE(arm.forest.update("arm", along_x(20), ms(20)));
  REQUIRE(arm.forest.update("arm", along_x(30), ms(30)));
  REQUIRE(arm.forest.update("hand", along_x(300), ms(30)));
  CHECK(listed(group.next_push(arm.forest)) == "0@30=330 ");
  REQUIRE(arm.forest.update("hand", along_x(250), ms(15)));
  CHECK(listed(group.next_push(arm.forest)) == "0@10=110 0@15=265 0@20=287 ");
  // Of what is later than the last common instant, nothing was sent.
  REQUIRE(arm.forest.update("arm", along_x(50), ms(50)));
  REQUIRE(arm.forest.update("arm", along_x(45), ms(45)));
  CHECK(listed(group.next_push(arm.forest)).empty());
  REQUIRE(arm.forest.update("hand", along_x(460), ms(46)));
  CHECK(listed(group.next_push(arm.forest)) == "0@45=495 0@46=506 ");
  // Of several samples between two pushes each is sent, unless the watchers want a lower rate.
  WatchedGroup slow(8, {{{"base", "hand"}}, true, false, 10ms});
  REQUIRE(listed(slow.next_push(arm.forest)) == "0@46=506 ");
  for (const int t : {60, 70}) {
    REQUIRE(arm.forest.update({{"arm", along_x(t)}, {"hand", along_x(t)}}, ms(t)));
  }
  // At 50 the hand is on its way from 460 to 60.
  CHECK(listed(group.next_push(arm.forest)) == "0@50=396 0@60=120 0@70=140 ");
  CHECK(listed(slow.next_push(arm.forest)) == "0@70=140 ");
}

TEST_CASE("a segment with process noise is not sent as one transform") {
  EdgeTiming noisy;
  noisy.process_noise = *Covariance::from_stddev({0.1, 0.1, 0.1, 0.1, 0.1, 0.1});
  Forest forest;
  REQUIRE(forest.add("arm", "base", along_x(1), Forest::MissingParent::kAllow));
  REQUIRE(forest.set_timing("arm", noisy));
  REQUIRE(forest.update("arm", along_x(1), ms(1)));
  const auto refused = WatchedGroup(7, {{{"base", "arm"}}, true}).snapshot(forest, {});
  REQUIRE(outcome(refused) == "invalid_input");
  CHECK(refused.error().message.find("'base' to 'arm'") != std::string::npos);
  CHECK(WatchedGroup(7, {{{"base", "arm"}}}).snapshot(forest, {}));
}

TEST_CASE("a watch of an edge that is not owned is rejected and half a path is never pushed") {
  Arm arm;
  for (const char* id : {"far", "nobody", "world"}) {
    WatchedGroup group(7, {{kArm, {"", id}}});
    const auto snapshot = group.snapshot(arm.forest, {});
    CHECK(outcome(snapshot) == "not_owner");
    CHECK(snapshot.error().message.find("'" + std::string(id) + "'") != std::string::npos);
  }
  WatchedGroup elsewhere(7, {{{"base", "hand"}}});
  CHECK(outcome(elsewhere.snapshot(arm.forest, {})) == "not_owner");
  CHECK(elsewhere.next_push(arm.forest).entries.empty());
  WatchedGroup segments(7, {{{"far", "hand"}}, true});
  CHECK_FALSE(segments.snapshot(arm.forest, {}));
  CHECK(segments.next_push(arm.forest).entries.empty());
  WatchedGroup group(7, {{kArm, kHand}});
  REQUIRE(group.snapshot(arm.forest, {}));
  (void)group.next_push(arm.forest);
  REQUIRE(arm.forest.remove("hand"));
  REQUIRE(arm.forest.update("arm", along_x(3)));
  // Nothing, because these watchers would not get the hand's new edge: that is half of the changes.
  CHECK(listed(group.next_push(arm.forest)).empty());
  REQUIRE(arm.forest.add("hand", "base", along_x(4)));
  CHECK(listed(group.next_push(arm.forest)).empty());
  REQUIRE(arm.forest.move("hand", "arm", along_x(5)));
  CHECK(listed(group.next_push(arm.forest)) == "0@-=3 1@-=5 ");
}

TEST_CASE("a group is shared only by equal requests to the same owner") {
  const WatchRequest edges{{kArm, kHand}};
  std::set<std::uint64_t> groups{
      watch_group("arms", 1, edges),
      watch_group("arms", 2, edges),
      watch_group("legs", 1, edges),
      watch_group("arms", 1, {{kHand, kArm}}),
      watch_group("arms", 1, {{{"base", "hand"}}}),
      watch_group("arms", 1, {{{"baseh", "and"}}}),
      watch_group("arms", 1, {{kArm, kHand}, false, false, 1ms}),
      watch_group("arms", 1, {{kArm, kHand}, true}),
      watch_group("arms", 1, {}),
  };
  CHECK(groups.size() == 9);
  CHECK(watch_group("arms", 1, {{kArm, kHand}, false, false, 0ms, ms(5)}) ==
        *groups.find(watch_group("arms", 1, edges)));
}

}  // namespace tfdude
