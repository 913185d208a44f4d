// Held frames go from one forest to another, with all that is known of them.

#include <limits>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "tree/forest.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::ContainsSubstring;
using testing::outcome;
using testing::Random;

constexpr Owner kFirst = 1;
constexpr Owner kSecond = 2;

EdgeTiming timing() {
  EdgeTiming timing;
  timing.span = std::chrono::hours(1);
  timing.max_ahead = std::chrono::nanoseconds::max();
  return timing;
}

// Two owners, of which the first holds frames below `base`, and the second knows of them.
struct Two {
  Two() {
    REQUIRE(first.add("base", "", {}));
    REQUIRE(second.put_remote("base", "", kFirst));
  }
  void add(const std::string& id, const std::string& parent, const Transform& X_PC = {}) {
    REQUIRE(first.add(id, parent, X_PC, Forest::MissingParent::kRefuse, 9));
    REQUIRE(second.put_remote(id, parent, kFirst, 9));
  }
  // All samples of the edge, read by so many.
  [[nodiscard]] HandedEdge whole(const std::string& id, std::size_t most) const {
    HandedEdge all = first.handed(id, {}, most).value();
    while (all.continues) {
      auto more = first.handed(id, all.samples.back().stamp, most).value();
      all.samples.insert(all.samples.end(), more.samples.begin(), more.samples.end());
      all.continues = more.continues;
    }
    return all;
  }
  void hand_over(const std::vector<std::string>& ids, std::size_t most = 256) {
    first.freeze(ids);
    std::vector<HandedEdge> edges;
    std::vector<HandedFrame> frames;
    for (const std::string& id : ids) {
      edges.push_back(whole(id, most));
      frames.push_back({id, edges.back().parent, 8});
    }
    REQUIRE(second.adopt(edges));
    first.hand_to(kSecond, frames);
  }

  Forest first;
  Forest second;
};

Result<StampedTransform> at(const Forest& forest, const std::string& a, const std::string& b,
                            std::int64_t t) {
  Query query;
  query.at = time_of(t);
  return forest.lookup(a, b, query);
}

}  // namespace

TEST_CASE("a static edge is handed over with its value and its correlation") {
  Two two;
  Random random(1);
  const Correlation said{
      true, {{"heat", true, Loading::NullaryExpr(6, 2, [&] { return random.normal(); })}}, {}};
  two.add("arm", "base", random.transform());
  REQUIRE(two.first.correlate("arm", said));
  two.add("bare", "arm", {random.pose(), StatedCovariance::unspecified()});
  const auto arm = two.first.kept("arm").value();
  const auto bare = two.first.value("bare").value();
  two.hand_over({"arm", "bare"});
  CHECK(two.second.kept("arm").value().correlation == arm.correlation);
  CHECK(testing::transform_diff(two.second.kept("arm").value().X_PC, arm.X_PC, 0) == "");
  CHECK_FALSE(two.second.value("bare").value().covariance.complete());
  CHECK(testing::pose_diff(two.second.value("bare").value().pose, bare.pose, 0) == "");
  CHECK(two.first.info("arm")->owner == kSecond);
  CHECK(two.first.info("bare")->parent == "arm");
  CHECK(two.second.info("arm")->lamport_time == 9);
  CHECK(two.first.info("arm")->lamport_time == 8);
}

TEST_CASE("a history is handed over, in parts of any size") {
  const std::size_t most = GENERATE(as<std::size_t>{}, 1, 7, 300);
  Two two;
  Random random(2);
  two.add("arm", "base");
  REQUIRE(two.first.set_timing("arm", timing()));
  Covariance covariance;
  for (std::int64_t t = 0; t < 100; ++t) {
    if (t % 10 == 0) covariance = random.covariance();
    REQUIRE(two.first.update("arm", {random.pose(), covariance}, time_of(t * 1000)));
  }
  std::vector<Transform> before;
  for (std::int64_t t = 0; t < 99'000; t += 777) {
    before.push_back(at(two.first, "base", "arm", t).value());
  }
  const auto handle = two.second.find("arm").value();
  two.hand_over({"arm"}, most);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto X = two.second.lookup_segments(
        {{"base", "arm"}}, {time_of(static_cast<std::int64_t>(i) * 777), {}, {}});
    REQUIRE(X);
    CHECK(testing::transform_diff(X->values[0], before[i], 1e-15) == "");
  }
  const auto history = two.second.histories("arm").at(0);
  CHECK(history.samples == 100);
  CHECK(history.span_limit == timing().span);
  CHECK(two.second.info(handle).has_value());  // it is the same frame
  CHECK(two.first.histories("arm").empty());
  two.second.thaw(std::vector<std::string>{"arm"});
  REQUIRE(two.second.update("arm", along_x(1), time_of(98'500)));  // between two others
  REQUIRE(two.second.update("arm", along_x(2), time_of(100'000)));
  CHECK(two.second.histories("arm").at(0).samples == 102);
}

TEST_CASE("an edge without samples is handed over as what it is") {
  Two two;
  for (const char* id : {"unsampled", "cleared", "static"}) two.add(id, "base", along_x(3));
  EdgeTiming moving = timing();
  moving.moving = true;
  REQUIRE(two.first.set_timing("unsampled", moving));
  REQUIRE(two.first.update("cleared", along_x(4), time_of(5)));
  REQUIRE(two.first.clear_history("cleared"));
  two.hand_over({"unsampled", "cleared", "static"});
  two.second.thaw(std::vector<std::string>{"unsampled", "cleared", "static"});
  const auto found = [&](const std::string& id, std::optional<Time> t) {
    return outcome(two.second.lookup_segments({{"base", id}}, {t, {}, {}}));
  };
  CHECK(found("static", time_of(1)) == "ok");
  CHECK(found("unsampled", {}) == "ok");
  CHECK(found("unsampled", time_of(1)) == "not_yet");
  CHECK(found("cleared", {}) == "not_yet");
  for (const char* id : {"unsampled", "cleared"}) {
    REQUIRE(two.second.update(id, along_x(5), time_of(7)));
    CHECK(found(id, time_of(7)) == "ok");
  }
}

TEST_CASE("frames that are handed over do not change meanwhile, and others do") {
  Two two;
  for (const char* id : {"arm", "leg"}) two.add(id, "base");
  two.add("hand", "arm");
  two.first.freeze({"arm", "hand"});
  Forest& forest = two.first;
  const auto handle = forest.find("hand").value();
  const auto refused = [](const auto& done) {
    return !done && done.error().code == Errc::kNotOwner &&
           done.error().message.find("is being handed over") != std::string::npos;
  };
  CHECK(refused(forest.update("hand", along_x(1))));
  CHECK(refused(forest.update(handle, along_x(1), time_of(1))));
  CHECK(refused(forest.update(std::vector<EdgeUpdate>{{"leg", along_x(1)}, {"hand", {}}})));
  CHECK(refused(forest.update_partial({{"hand", along_x(1)}})));
  CHECK(refused(forest.correlate("hand", {true, {}, {}})));
  CHECK(refused(forest.set_timing("hand", timing())));
  CHECK(refused(forest.clear_history("hand")));
  CHECK(refused(forest.revise({{"hand", along_x(1), {}, {}}}, {}, forest.newest_commit())));
  CHECK(refused(forest.rewrite("hand", {time_of(1), time_of(2)}, {{time_of(1), {}}})));
  CHECK(refused(forest.move("hand", "base")));
  CHECK(refused(forest.remove("hand")));
  CHECK(refused(forest.remove("base")));  // with all below it
  CHECK(testing::x_of(forest.lookup("base", "leg")) == 0);
  CHECK(testing::x_of(forest.lookup("base", "hand")) == 0);
  REQUIRE(forest.update("leg", along_x(2)));
  REQUIRE(forest.add("more", "hand", {}));  // a frame below it is another edge
  forest.thaw(std::vector<std::string>{"arm", "hand"});
  CHECK_FALSE(forest.is_frozen("hand"));
  REQUIRE(forest.update("hand", along_x(1)));
  REQUIRE(forest.remove("base"));
}

TEST_CASE("a jump back of the clock clears a history when its handover is over") {
  Time now = time_of(9000);
  Forest forest([&] { return std::optional(now); });
  REQUIRE(forest.add("base", "", {}));
  for (const char* id : {"early", "late", "other", "other_late"})
    REQUIRE(forest.add(id, "base", {}));
  REQUIRE(forest.update("early", along_x(1), time_of(1000)));
  for (const char* id : {"late", "other", "other_late"})
    REQUIRE(forest.update(id, along_x(1), time_of(8000)));
  forest.freeze({"early", "late", "other"});
  now = time_of(3000);
  CHECK(forest.clear_histories(now, time_of(9000)) == 3);
  CHECK(outcome(forest.lookup("base", "other_late")) == "not_yet");
  for (const char* id : {"early", "late", "other"})
    CHECK(testing::x_of(forest.lookup("base", id)) == 1);
  CHECK(forest.handed("late", {}, 10).value().samples.size() == 1);
  now = time_of(5000);
  CHECK(forest.clear_histories(now, time_of(9000)) == 2);
  forest.freeze({"late"});  // it is already
  SECTION("its owner keeps it") {
    forest.thaw(std::vector<std::string>{"early", "late"});
    forest.thaw(std::vector<HandedFrame>{{"other", "base", 5}});
    CHECK(testing::x_of(forest.lookup("base", "early")) == 1);
    for (const char* id : {"late", "other"}) {
      CHECK(outcome(forest.lookup("base", id)) == "not_yet");
      REQUIRE(forest.update(id, along_x(2), time_of(3001)));
      forest.freeze({id});
      forest.thaw(std::vector<std::string>{id});
      CHECK(testing::x_of(forest.lookup("base", id)) == 2);
    }
  }
  SECTION("it goes, and comes back") {
    HandedEdge late = forest.handed("late", {}, 10).value();
    forest.hand_to(kSecond, {{"late", "base", 8}});
    late.samples.back().stamp = time_of(4000);
    REQUIRE(forest.adopt({late}));
    forest.thaw(std::vector<std::string>{"late"});
    CHECK(testing::x_of(forest.lookup("base", "late")) == 1);
  }
}

TEST_CASE("samples of before a jump back of the new owner's clock are cleared there") {
  Two two;
  two.add("arm", "base");
  REQUIRE(two.first.set_timing("arm", timing()));
  for (const std::int64_t t : {2000, 8900})
    REQUIRE(two.first.update("arm", along_x(1), time_of(t)));
  Time now = time_of(9000);
  Forest second([&] { return std::optional(now); });
  REQUIRE(second.put_remote("base", "", kFirst));
  REQUIRE(second.put_remote("arm", "base", kFirst, 9));
  const bool jumped = GENERATE(true, false);
  if (jumped) {
    now = time_of(3000);
    CHECK(second.clear_histories(now, time_of(9000)) == 0);
  }
  two.first.freeze({"arm"});
  REQUIRE(second.adopt({two.whole("arm", 10)}));
  CHECK(second.histories("arm").at(0).samples == 2);
  second.thaw(std::vector<std::string>{"arm"});
  CHECK(second.histories("arm").at(0).samples == (jumped ? 0 : 2));
  REQUIRE(second.update("arm", along_x(1), time_of(jumped ? 3100 : 9100)));
}

TEST_CASE("an edge that makes no sense is not taken, and nothing changes") {
  Two two;
  two.add("arm", "base");
  two.add("hand", "arm");
  REQUIRE(two.first.update("arm", along_x(1), time_of(1)));
  REQUIRE(two.first.update("arm", along_x(2), time_of(2)));
  const HandedEdge good = two.whole("arm", 10);
  const auto why = [&](const HandedEdge& edge) {
    const auto done = two.second.adopt({two.whole("hand", 1), edge});
    CHECK((two.second.info("hand")->owner == kFirst) == !done);
    return done ? "done" : outcome(done) + ": " + done.error().message;
  };
  HandedEdge bad = good;
  bad.X_PC = along_x(std::numeric_limits<double>::quiet_NaN());
  CHECK_THAT(why(bad), ContainsSubstring("'arm'") && ContainsSubstring("not finite"));
  bad = good;
  std::swap(bad.samples[0], bad.samples[1]);
  CHECK_THAT(why(bad), ContainsSubstring("do not increase"));
  bad = good;
  bad.timing->count = 1;
  CHECK_THAT(why(bad), ContainsSubstring("count"));
  bad = good;
  bad.timing.reset();
  CHECK_THAT(why(bad), ContainsSubstring("do not fit"));
  bad = good;
  bad.state = HandedState::kStatic;
  CHECK_THAT(why(bad), ContainsSubstring("do not fit"));
  bad = good;
  bad.samples.clear();
  CHECK_THAT(why(bad), ContainsSubstring("do not fit"));
  bad = good;
  bad.said.common_errors = {{"heat", false, Loading::Constant(6, 1, 1.0 / 0.0)}};
  CHECK_THAT(why(bad), ContainsSubstring("heat"));
  bad = good;
  bad.parent = "hand";
  CHECK_THAT(why(bad), ContainsSubstring("cycle"));
  REQUIRE(two.second.add("own", "base", {}));
  bad = good;
  bad.id = "own";
  CHECK_THAT(why(bad), ContainsSubstring("already_exists"));
  CHECK(why(good) == "done");
}

}  // namespace tfdude
