#include "partition/observing.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include "calls/observe_task.hpp"
#include "math/observe_beside.hpp"
#include "partition/partition.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"
#include "support/random.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using namespace std::chrono_literals;
using testing::ContainsSubstring;
using testing::presence_of;
using testing::Random;
using testing::Replica;
using Way = ObservedEdge::Way;

constexpr Time kNow{std::chrono::milliseconds(1500)};

// world(robot) +- arm(arms) - hand(arms) - tool(tools), and leg(robot) beside. The process serves
// arms.
struct Known : Replica {
  explicit Known(Random& random) : Replica("arms"), partition("arms", 1, forest, directory) {
    directory.apply(presence_of("robot", 1, 1), kNow);
    directory.apply(Page{"robot", 0, 1, 1, {{"world", ""}, {"leg", "world"}}});
    directory.apply(presence_of("tools", 1, 1), kNow);
    directory.apply(Page{"tools", 0, 1, 1, {{"tool", "hand"}}});
    X_arm = random.transform();
    X_hand = random.transform();
    REQUIRE(partition.load({{"arm", "world", X_arm}, {"hand", "arm", X_hand}}, kNow));
  }
  Partition partition;
  Transform X_arm;
  Transform X_hand;
};

std::vector<std::string> edges_of(const ObservePlan& plan) {
  std::vector<std::string> texts;
  for (const auto& edge : plan.edges) {
    const char* way = edge.way == Way::kDown ? " down" : edge.way == Way::kUp ? " up" : " beside";
    texts.push_back(edge.info.id + way);
  }
  return texts;
}

// Answers with one value an edge.
std::vector<SegmentValues> answers_to(const ObservePlan& plan, Random& random) {
  std::vector<SegmentValues> answers;
  for (const Part& part : plan.parts) {
    const auto& asked = std::get<LookupRequest>(part.request.body).segments;
    SegmentValues answer;
    for (std::size_t i = 0; i < asked.size(); ++i) answer.values.push_back(random.transform());
    answer.correlations.resize(asked.size());
    answer.commit = 7 + answers.size();
    answer.incarnation = 77;
    answers.push_back(std::move(answer));
  }
  return answers;
}

TEST_CASE("an observation asks each owner for the edges of the path and correlated ones") {
  Random random(0x0b51);
  const Known known(random);
  const auto down = route_observe(known.forest, known.directory, "world", "tool", {}, kNow);
  REQUIRE(down);
  CHECK(edges_of(*down) == std::vector<std::string>{"arm down", "hand down", "tool down"});
  REQUIRE(down->parts.size() == 2);
  CHECK(down->parts[0].owner == kHeldHere);
  CHECK(down->parts[1].partition == "tools");
  const auto& asked = std::get<LookupRequest>(down->parts[1].request.body);
  CHECK(asked.edges);
  CHECK(asked.query.at == kNow);
  REQUIRE(asked.segments.size() == 1);
  CHECK(asked.segments[0].from == "hand");
  CHECK(asked.segments[0].to == "tool");
  const auto over = route_observe(known.forest, known.directory, "hand", "leg",
                                  {"tool", "arm", "gone"}, std::nullopt);
  REQUIRE(over);
  CHECK(edges_of(*over) ==
        std::vector<std::string>{"hand up", "arm up", "leg down", "tool beside"});
}

TEST_CASE("an observation of one frame or over an unreachable owner is rejected") {
  Random random(0x0b52);
  Known known(random);
  const auto refused = [&](const std::string& a, const std::string& b) {
    const auto plan = route_observe(known.forest, known.directory, a, b, {}, {});
    REQUIRE_FALSE(plan);
    return plan.error().code;
  };
  CHECK(refused("hand", "hand") == Errc::kInvalidInput);
  CHECK(refused("nobody", "hand") == Errc::kUnknownStart);
  CHECK(refused("hand", "nobody") == Errc::kUnknownEnd);
  REQUIRE(known.directory.lost("tools", 1, kNow));
  CHECK(refused("world", "tool") == Errc::kUnreachable);
}

TEST_CASE("answers are assembled in the order of the edges and missing edges are named") {
  Random random(0x0b53);
  const Known known(random);
  const auto plan = route_observe(known.forest, known.directory, "tool", "world", {}, {});
  REQUIRE(plan);
  auto answers = answers_to(*plan, random);
  answers[0].correlations[0].observed_with = {"tool", "leg", "hand"};
  const auto path = observed_path(*plan, answers);
  REQUIRE(path);
  REQUIRE(path->edges.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) CHECK(path->edges[k].way == Way::kUp);
  CHECK(testing::pose_diff(path->edges[0].X_PC.pose, answers[0].values[0].pose, 0) == "");
  CHECK(testing::pose_diff(path->edges[1].X_PC.pose, answers[1].values[0].pose, 0) == "");
  CHECK(testing::pose_diff(path->edges[2].X_PC.pose, answers[1].values[1].pose, 0) == "");
  CHECK(path->missing == std::vector<std::string>{"leg"});
  REQUIRE(path->seen.size() == 2);
  CHECK(path->seen[0].commit == 7);
  CHECK(path->seen[1].commit == 8);
  CHECK(path->seen[1].incarnation == 77);
  CHECK(path->lacking.empty());
  // An observation that only one of its owners has applied.
  const CommonError common_error{"observed:other", true, Loading::Ones(6, 1)};
  answers[0].correlations[0].common_errors = {common_error};
  CHECK(observed_path(*plan, answers)->lacking == std::vector<std::string>{"hand"});
  CHECK(observed_path(*plan, answers)->lacking_sources ==
        std::vector<std::string>{"observed:other"});
  // One that has been waited for before.
  answers[0].correlations[0].observed_with = {"tool", "leg", "hand", "hand"};
  CHECK(observed_path(*plan, answers)->lacking.empty());
  answers[0].correlations[0].observed_with = {"tool", "leg", "hand"};
  answers[1].correlations[0].common_errors = {common_error};
  CHECK(observed_path(*plan, answers)->lacking.empty());
  answers[1].values.pop_back();
  const auto short_of_one = observed_path(*plan, answers);
  REQUIRE_FALSE(short_of_one);
  CHECK(short_of_one.error().code == Errc::kNotOwner);
}

// An edge that was written since it was observed lacks the source for good.
TEST_CASE("an observation waits only for others that may not have reached all owners yet") {
  Random random(0x0b58);
  const Known known(random);
  const TimeLimit::Clock::time_point start{std::chrono::hours(1)};
  // Another observation began at 1.000 s, as its name says; this one later by so much.
  const auto pause_after = [&](std::chrono::milliseconds later, const std::string& other,
                               const EarlierObservations& earlier) {
    const std::string own = "observed:" + std::to_string(nanoseconds(Time(1s) + later)) + ".7.1";
    ObserveTask task(known.forest, {"tool", "world", random.transform(), {}, {}}, "", own, earlier,
                     false, TimeLimit(1s, start));
    REQUIRE(task.plan(known.directory, start));
    const auto plan = route_observe(known.forest, known.directory, "tool", "world", {}, {});
    auto answers = answers_to(*plan, random);
    answers[0].correlations[0] = {{}, {{other, true, Loading::Ones(6, 1)}}, {"tool", "hand"}};
    std::vector<Reply> replies(answers.size());
    for (std::size_t i = 0; i < answers.size(); ++i) replies[i].body = std::move(answers[i]);
    const auto next = task.take(std::move(replies), start);
    REQUIRE(next);
    const bool waits = task.pause() > Milliseconds(0);
    CHECK((*next == Task::Next::kPlan) == waits);
    return waits;
  };
  const std::string other = "observed:1000000000.3.5.0";
  CHECK(pause_after(10ms, other, {}));
  CHECK(pause_after(-10s, other, {}));  // the clocks differ
  CHECK(pause_after(10ms, "observed:other", {}));
  CHECK_FALSE(pause_after(410ms, other, {}));
  CHECK_FALSE(pause_after(10ms, other, {{"observed:x", other}, {}}));
}

// The first of them is at one owner, and nothing more comes.
TEST_CASE("an observation waits for one under way, and less for edges that others write often") {
  Random random(0x0b59);
  const Known known(random);
  const TimeLimit::Clock::time_point start{std::chrono::hours(1)};
  const auto plan = route_observe(known.forest, known.directory, "tool", "world", {}, {});
  REQUIRE(plan);
  const CommonError other{"observed:1000000000.3.5.0", true, Loading::Ones(6, 1)};
  const auto waits_for = [&](const std::vector<std::string>& rewritten) {
    ObserveTask task(known.forest, {"tool", "world", random.transform(), {}, {}}, "",
                     "observed:1002000000.7.1", {{}, rewritten}, false, TimeLimit(1s, start));
    auto now = start;
    while (task.plan(known.directory, now)) {
      auto answers = answers_to(*plan, random);
      answers[0].correlations[0] = {{}, {other}, {"tool", "hand"}};
      std::vector<Reply> replies(answers.size());
      for (std::size_t i = 0; i < answers.size(); ++i) replies[i].body = std::move(answers[i]);
      const auto next = task.take(std::move(replies), now);
      REQUIRE(next);
      if (*next != Task::Next::kPlan) break;
      REQUIRE(task.pause() > Milliseconds(0));
      now += task.pause();
    }
    CHECK(task.rewritten() == std::vector<std::string>{"hand"});
    // The name says when this one was computed, so that others know how long to wait for it.
    const auto computed = 1002000000 + nanoseconds(Time((now - start)));
    CHECK(task.source() == "observed:" + std::to_string(computed) + ".7.1.0");
    return std::chrono::duration_cast<Milliseconds>(now - start);
  };
  const auto first = waits_for({});
  CHECK(first > 390ms);
  CHECK(first < 440ms);
  const auto again = waits_for({"hand"});
  CHECK(again > 20ms);
  CHECK(again < 40ms);
}

TEST_CASE("an observation beside one in progress stays tied to the edges that lack it") {
  Random random(0x0b57);
  const Known known(random);
  const auto plan = route_observe(known.forest, known.directory, "hand", "tool", {"hand"}, {});
  REQUIRE(plan);
  auto answers = answers_to(*plan, random);
  const Loading little = 1e-3 * Loading::Ones(6, 1);
  answers[0].correlations[0] = {{}, {{"observed:other", true, little}}, {"hand", "tool"}};
  const auto path = observed_path(*plan, answers);
  REQUIRE(path);
  REQUIRE(path->lacking == std::vector<std::string>{"hand"});
  const auto found = observe_beside_others(
      path->edges, {path->edges[0].X_PC.pose, random.covariance()}, "observed:this", {1, true});
  REQUIRE(found);
  const auto parts = revisions(*plan, *path, *found, {});
  REQUIRE(parts.size() == 1);
  const auto& edges = std::get<ReviseRequest>(parts[0].request.body).edges;
  REQUIRE(edges.size() == 1);
  CHECK(edges[0].id == "tool");
  CHECK(edges[0].revision->correlation.observed_with ==
        std::vector<std::string>{"tool", "hand", "hand"});
}

TEST_CASE("only owners whose edges change get a part of an observation") {
  Random random(0x0b54);
  const Known known(random);
  const auto plan = route_observe(known.forest, known.directory, "world", "tool", {}, {});
  REQUIRE(plan);
  auto answers = answers_to(*plan, random);
  answers[1].values[0].covariance = StatedCovariance::exact();
  const auto path = observed_path(*plan, answers);
  REQUIRE(path);
  Pose X_AB;
  for (const ObservedEdge& edge : path->edges) X_AB = X_AB * edge.X_PC.pose;
  const auto observed =
      observe(path->edges, {X_AB, random.covariance()}, "observed:test", ObserveOptions());
  REQUIRE(observed);
  const auto parts = revisions(*plan, *path, *observed, {});
  REQUIRE(parts.size() == 1);
  CHECK(parts[0].request.id == "arm");
  const auto& revise = std::get<ReviseRequest>(parts[0].request.body);
  CHECK(revise.seen == 7);
  CHECK(revise.incarnation == 77);
  REQUIRE(revise.edges.size() == 2);
  CHECK(revise.edges[1].revision->correlation.observed_with ==
        std::vector<std::string>{"arm", "hand"});
}

TEST_CASE("an owner applies its part once and counts it until the frame is moved") {
  Random random(0x0b55);
  Known known(random);
  const auto seen = known.forest.lookup_segments({{"world", "arm"}}, {}, {}, true);
  REQUIRE(seen);
  const Transform X = random.transform();
  const PeerId peer{};
  Request request{
      1, "arm",
      ReviseRequest{{{"arm", {3, 2, 1}, false, Revision{"arm", X, {}}}}, {}, seen->commit, 1}};
  const auto is_done = [](const Reply& reply) { return std::holds_alternative<Done>(reply.body); };
  CHECK(is_done(known.partition.answer(peer, request, kNow)));
  CHECK(is_done(known.partition.answer(peer, request, kNow)));
  CHECK(testing::transform_diff(*known.forest.lookup_segments({{"world", "arm"}})->values.begin(),
                                X, 1e-15) == "");
  // The same revision as another request is late.
  request.sequence = 2;
  const Reply late = known.partition.answer(peer, request, kNow);
  REQUIRE(std::holds_alternative<Error>(late.body));
  CHECK(std::get<Error>(late.body).code == Errc::kChangedMeanwhile);
  const auto counted = [&] {
    const Reply reply = known.partition.answer({3, "arms", ConsistencyRequest{true}}, kNow);
    return std::get<std::vector<EdgeConsistency>>(reply.body);
  };
  REQUIRE(counted().size() == 1);
  CHECK(counted()[0].observations == 1);
  CHECK(counted()[0].sum.squares == 3);
  const Reply foreign = known.partition.answer(
      {4, "tool", ReviseRequest{{{"tool", {1, 1, 1}, false, {}}}, {}, 0}}, kNow);
  REQUIRE(std::holds_alternative<Error>(foreign.body));
  CHECK(std::get<Error>(foreign.body).code == Errc::kNotOwner);
  CHECK(is_done(known.partition.answer({5, "arm", MoveRequest{"leg", {}}}, kNow)));
  CHECK(counted().empty());
}

TEST_CASE("an owner rejects a revision that is based on its predecessor") {
  Random random(0x0b56);
  Known known(random);
  const LookupRequest ask{{{"world", "arm"}}, {}, {}, true};
  const Reply reply = known.partition.answer_lookup(1, ask);
  const auto& seen = std::get<SegmentValues>(reply.body);
  CHECK(seen.incarnation == 1);
  const auto revise = [&](std::uint32_t sequence, std::uint64_t incarnation, std::uint64_t commit) {
    const Revision revision{"arm", random.transform(), {}};
    const ReviseRequest body{{{"arm", {3, 2, 1}, false, revision}}, {}, commit, incarnation};
    return known.partition.answer(PeerId{}, {sequence, "arm", body}, kNow);
  };
  for (const std::uint32_t sequence : {1U, 2U}) {
    const Reply late = revise(sequence, 0, seen.commit + 1000 * sequence);
    REQUIRE(std::holds_alternative<Error>(late.body));
    CHECK(std::get<Error>(late.body).code == Errc::kChangedMeanwhile);
    CHECK_THAT(std::get<Error>(late.body).message, testing::ContainsSubstring("'arms'"));
  }
  CHECK(std::holds_alternative<Done>(revise(3, 1, seen.commit).body));
}

}  // namespace
}  // namespace tfdude
