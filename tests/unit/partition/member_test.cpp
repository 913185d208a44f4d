// What a participant stores, publishes, replies and reports after messages and requests.

#include "partition/member.hpp"

#include <string>
#include <vector>

#include "partition/claiming.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_store.hpp"
#include "support/pose_diff.hpp"
#include "support/replica.hpp"
#include "tree/epoch.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::pose_diff;
using testing::presence_of;
using testing::Replica;

constexpr Time kNow{std::chrono::nanoseconds(1000)};
constexpr PeerId kPeer{7};

// A participant that serves "arms" with a frame "arm", and has announced that.
struct Serving : Replica {
  explicit Serving(bool stores = true) : Replica("arms"), member(forest, directory, "arms") {
    member.claim("here", 42, kNow, 5);
    (void)member.introduce();
    const StoredState nothing;
    REQUIRE(member.serve(stores ? &nothing : nullptr, {{"arm", "", along_x(1)}}, kNow));
    const Ready first = member.take_ready();
    CHECK(first.pages.size() == 1);
    CHECK(first.rows.frames.size() == (stores ? 1 : 0));
    const auto said = member.stored(first);
    REQUIRE(said);
    CHECK(said->serving);
    CHECK(said->pages == 1);
    (void)member.take_outcome();
  }

  std::optional<Reply> ask(std::uint32_t sequence, const std::string& id,
                           decltype(Request::body) body,
                           const std::optional<Error>& refusal = std::nullopt) {
    return member.on_request(kPeer, Request{sequence, id, std::move(body), 1}, refusal, kNow);
  }

  Member member;
};

const Error kFull{Errc::kState, "the disk is full"};

}  // namespace

TEST_CASE("member: while a disk hangs a bounded number of changes wait for it") {
  Serving arms;
  const auto update = [&](std::uint32_t number) {
    return arms.ask(number, "arm", UpdateRequest{{{"arm", along_x(number)}}});
  };
  std::uint32_t number = 0;
  bool all_wait = true;
  while (number < ReplyCache::kReplies) all_wait = !update(++number) && all_wait;
  CHECK(all_wait);
  CHECK_FALSE(update(number));
  const auto rejected = update(++number);
  REQUIRE(rejected);
  const auto* error = std::get_if<Error>(&rejected->body);
  REQUIRE(error != nullptr);
  CHECK(error->code == Errc::kTooMuch);
  CHECK_THAT(error->message, testing::ContainsSubstring("'arms' has 65536 changes that wait"));
  CHECK(testing::x_of(arms.forest.value("arm")) == ReplyCache::kReplies);
  CHECK(arms.member.take_ready().replies.size() == ReplyCache::kReplies);
  CHECK_FALSE(update(++number));
}

TEST_CASE("member: an owner that returns changes plans, whichever of its messages comes first") {
  const bool page_first = GENERATE(true, false);
  CAPTURE(page_first);
  Replica replica;
  Member member(replica.forest, replica.directory, "");
  const auto plans_again = [&] { return member.take_outcome().routes; };
  const auto come = [&](std::uint64_t incarnation) {
    const Page page{"head", 0, incarnation, 1, {{"neck", "", 1}}};
    if (page_first) member.on_page(page);
    const bool by_page = page_first && plans_again();
    member.on_presence(presence_of("head", incarnation, 1), kNow);
    const bool by_presence = plans_again();
    if (!page_first) member.on_page(page);
    return std::pair(by_page, by_presence);
  };
  (void)come(1);
  (void)plans_again();
  member.on_page(Page{"head", 0, 1, 1, {{"neck", "", 1}}});
  member.on_presence(presence_of("head", 1, 1), kNow);
  CHECK_FALSE(plans_again());
  member.on_lost("head", 1, kNow, {});
  CHECK(plans_again());
  // The same frames: only the way to them is there again.
  const auto [by_page, by_presence] = come(2);
  CHECK(by_page == page_first);
  // By now it is known which process it is, and by which clock.
  CHECK(by_presence);
}

TEST_CASE("member: joints that appear or vanish with a restart change plans") {
  const bool page_first = GENERATE(true, false);
  CAPTURE(page_first);
  Replica replica;
  Member member(replica.forest, replica.directory, "");
  const auto owners = [&](const char* joint) {
    const auto route = replica.directory.route_joint(joint);
    return route ? route->owners.size() : 0;
  };
  const auto input = [&](auto give) {
    const auto before = std::pair(owners("pan"), owners("tilt"));
    give();
    const bool same = before == std::pair(owners("pan"), owners("tilt"));
    const bool plans_again = member.take_outcome().routes;
    CHECK((same || plans_again));
  };
  const auto come = [&](std::uint64_t incarnation, const std::string& joint) {
    Page page{"head", 0, incarnation, 1, {{"neck", "", 1}}};
    page.joints = {{joint, ""}};
    if (page_first) input([&] { member.on_page(page); });
    input([&] { member.on_presence(presence_of("head", incarnation, 1), kNow); });
    if (!page_first) input([&] { member.on_page(page); });
  };
  come(1, "pan");
  REQUIRE(owners("pan") == 1);
  come(2, "tilt");
  CHECK(owners("pan") == 0);
  CHECK(owners("tilt") == 1);
}

TEST_CASE("member: a participant without frames receives messages and stores nothing") {
  Replica replica;
  Member member(replica.forest, replica.directory, "");
  member.on_presence(presence_of("head", 1, 1), kNow);
  member.on_page(Page{"head", 0, 1, 1, {{"neck", "", 1}}});
  const Outcome outcome = member.take_outcome();
  REQUIRE(outcome.appeared);
  CHECK(outcome.appeared->partition == "head");
  CHECK(outcome.routes);
  CHECK_FALSE(outcome.to_commit);
  const Ready ready = member.take_ready();
  CHECK(ready.rows.empty());
  CHECK(ready.pages.empty());
  CHECK_FALSE(ready.presence);
}

TEST_CASE("member: a change is ready once with its rows and pages and reply") {
  Serving arms;
  CHECK_FALSE(arms.ask(1, "hand", AddRequest{"arm", along_x(1)}));
  CHECK(arms.member.take_outcome().to_reply);
  // The same request once more, whose reply waits.
  CHECK_FALSE(arms.ask(1, "hand", AddRequest{"arm", along_x(1)}));
  const Ready ready = arms.member.take_ready();
  REQUIRE(ready.replies.size() == 1);
  CHECK(std::holds_alternative<Done>(ready.replies.front().reply.body));
  CHECK(ready.replies.front().to == kPeer);
  CHECK(ready.replies.front().what == "add frame 'hand' under 'arm'");
  REQUIRE(ready.rows.frames.size() == 1);
  CHECK(ready.rows.frames.front().id == "hand");
  CHECK(ready.pages.size() == 1);
  CHECK(arms.member.take_ready().replies.empty());
}

TEST_CASE("member: an update of values is answered at once if nothing is stored") {
  Serving kept;
  CHECK_FALSE(kept.ask(1, "arm", UpdateRequest{{{"arm", along_x(2)}}}));
  Serving volatile_one(false);
  CHECK(volatile_one.ask(1, "arm", UpdateRequest{{{"arm", along_x(2)}}}));
}

TEST_CASE("member: changes that could not be stored are ready again without their replies") {
  Serving arms;
  const auto epoch = arms.ask(1, "arms", RemoveRequest{})->epoch;
  CHECK_FALSE(arms.ask(2, "hand", AddRequest{"arm", along_x(1)}));
  const Ready ready = arms.member.take_ready();
  CHECK_FALSE(arms.member.not_stored(ready));
  // Meanwhile changes are rejected, and changes that are not stored are not announced.
  CHECK_FALSE(arms.ask(3, "foot", AddRequest{"", along_x(1)}, kFull));
  CHECK(arms.ask(4, "arms", RemoveRequest{}, kFull)->epoch == epoch);
  const Ready again = arms.member.take_ready();
  REQUIRE(again.replies.size() == 1);
  CHECK(std::get<Error>(again.replies.front().reply.body).code == Errc::kState);
  REQUIRE(again.rows.frames.size() == 1);
  CHECK(again.rows.frames.front().id == "hand");
  CHECK(again.pages.size() == 1);
}

TEST_CASE("member: it announces no loss that it could not store before it serves") {
  Replica replica("arms");
  Member member(replica.forest, replica.directory, "arms");
  member.claim("here", 42, kNow, 5);
  (void)member.introduce();
  member.on_presence(presence_of("head", 1, 1), kNow);
  const StoredState nothing;
  REQUIRE(member.serve(&nothing, {{"arm", "", {}}}, kNow));
  REQUIRE(replica.directory.lost("head", 1, kNow));
  CHECK_FALSE(member.not_stored(member.take_ready()));
}

TEST_CASE("member: it serves under a later incarnation than its claim whatever the clock") {
  Replica replica("arms");
  Member member(replica.forest, replica.directory, "arms");
  member.claim("here", 42, kNow + std::chrono::hours(2), 5);
  const std::uint64_t claimed = member.introduce().incarnation;
  REQUIRE(member.serve(nullptr, {}, kNow));
  CHECK(member.introduce().incarnation > claimed);
}

TEST_CASE("member: all values are stored together with any row") {
  Serving arms;
  testing::MemoryStore store;
  const auto save = [&](const Ready& taken) {
    Ready ready = taken;
    arms.member.partition()->add_values(ready.rows);
    REQUIRE(store.save(ready.rows));
    (void)arms.member.stored(ready);
  };
  CHECK_FALSE(arms.ask(1, "hand", AddRequest{"arm", along_x(1)}));
  CHECK_FALSE(arms.ask(2, "foot", AddRequest{"", along_x(1)}));
  save(arms.member.take_ready());
  // Nothing waits for these two values, which one commit writes.
  REQUIRE(arms.forest.update({{"hand", along_x(2)}, {"foot", along_x(2)}}));
  CHECK(arms.member.take_ready().rows.empty());
  SECTION("a frame moves") { CHECK_FALSE(arms.ask(3, "hand", MoveRequest{"foot", {}})); }
  SECTION("a request writes another value") {
    CHECK_FALSE(arms.ask(3, "arm", UpdateRequest{{{"arm", along_x(2)}}}));
  }
  SECTION("a change could not be stored before") {
    CHECK_FALSE(arms.ask(3, "leg", AddRequest{"", along_x(1)}));
    (void)arms.member.not_stored(arms.member.take_ready());
  }
  const epoch::Guard guard;
  const Ready ready = arms.member.take_ready();
  // Later ones are stored later.
  REQUIRE(arms.forest.update({{"hand", along_x(3)}, {"foot", along_x(3)}}));
  save(ready);
  const auto check_stored = [&](double x) {
    const auto state = store.load();
    for (const StoredFrame& frame : state->frames) {
      if (frame.id != "hand" && frame.id != "foot") continue;
      INFO(frame.id);
      CHECK(pose_diff(frame.X_PC.pose, along_x(x).pose, 1e-15) == "");
    }
  };
  check_stored(2);
  save(arms.member.take_ready(true));
  check_stored(3);
}

TEST_CASE("member: an incarnation that could not be stored is not announced") {
  Serving arms;
  const std::uint64_t own = arms.member.presence().incarnation;
  arms.member.on_presence(presence_of("base", 1, 0), kNow);
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"arms", 1, Absent::Kind::kForgotten, own}};
  arms.member.on_presence(head, kNow);
  CHECK(arms.member.take_outcome().overtook);
  arms.member.on_lost("base", 1, kNow);
  // But whom it misses is.
  const auto said = arms.member.not_stored(arms.member.take_ready());
  REQUIRE(said);
  CHECK(said->absent.size() == 1);
  CHECK(said->incarnation == own);
  const Ready again = arms.member.take_ready();
  const auto later = arms.member.stored(again);
  REQUIRE(later);
  CHECK(later->incarnation > own);
}

TEST_CASE("member: an incarnation is not announced before it is stored and synced") {
  Serving arms;
  const std::uint64_t own = arms.member.presence().incarnation;
  arms.member.on_presence(presence_of("base", 1, 0), kNow);
  arms.member.on_lost("base", 1, kNow);
  const Ready ready = arms.member.take_ready();
  REQUIRE(ready.presence);
  CHECK_FALSE(ready.rows.synced);
  // While the disk writes.
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"arms", 1, Absent::Kind::kForgotten, own}};
  arms.member.on_presence(head, kNow);
  CHECK(arms.member.take_outcome().overtook);
  const auto said = arms.member.stored(ready);
  REQUIRE(said);
  CHECK(said->incarnation == own);
  CHECK(said->absent.size() == 1);
  const Ready next = arms.member.take_ready();
  CHECK(next.rows.synced);
  (void)arms.member.not_stored(next);
  const Ready again = arms.member.take_ready();
  CHECK(again.rows.synced);
  const auto later = arms.member.stored(again);
  REQUIRE(later);
  CHECK(later->incarnation > own);
  CHECK_FALSE(arms.member.take_ready().rows.synced);
}

TEST_CASE("member: it gives up its partition when a later process of it appears") {
  Serving arms;
  CHECK_FALSE(arms.ask(1, "hand", AddRequest{"arm", along_x(1)}));
  Presence later = presence_of("arms", arms.member.presence().incarnation + 1, 1);
  arms.member.on_presence(later, kNow);
  const Outcome outcome = arms.member.take_outcome();
  CHECK(outcome.gave_up);
  REQUIRE(outcome.rival);
  CHECK(arms.structure().empty());
  const Ready ready = arms.member.take_ready();
  REQUIRE(ready.refused);
  CHECK(ready.rows.empty());
  CHECK(ready.pages.empty());
  CHECK(ready.replies.size() == 1);
  const auto last = arms.member.stored(ready);
  REQUIRE(last);
  CHECK(last->stopped);
  CHECK_FALSE(last->serving);
  CHECK(std::get<Error>(arms.ask(2, "arm", RemoveRequest{})->body).code == Errc::kNotOwner);
}

TEST_CASE("member: it overtakes a later incarnation that others report") {
  Serving arms;
  const std::uint64_t own = arms.member.presence().incarnation;
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"arms", 1, Absent::Kind::kLost, own + 50}};
  arms.member.on_presence(head, kNow);
  const Outcome outcome = arms.member.take_outcome();
  REQUIRE(outcome.overtook);
  CHECK(*outcome.overtook > own + 50);
  CHECK(outcome.to_commit);
  const Ready ready = arms.member.take_ready();
  REQUIRE(ready.presence);
  CHECK(ready.presence->incarnation == *outcome.overtook);
  CHECK(ready.pages.size() == 1);
}

TEST_CASE("member: it overtakes what others report as soon as no rival serves") {
  Serving arms;
  const std::uint64_t own = arms.member.presence().incarnation;
  Presence rival = presence_of("arms", own - 1, 1);
  arms.member.on_presence(rival, kNow);
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"arms", 1, Absent::Kind::kForgotten, own}};
  arms.member.on_presence(head, kNow);
  CHECK_FALSE(arms.member.take_outcome().overtook);
  SECTION("the rival is lost") { arms.member.on_lost("arms", rival.incarnation, kNow); }
  SECTION("the rival stops") {
    rival.serving = false;
    rival.stopped = true;
    arms.member.on_presence(rival, kNow);
  }
  const Outcome outcome = arms.member.take_outcome();
  REQUIRE(outcome.overtook);
  CHECK(*outcome.overtook > own);
}

// Its transport did not believe that process; others may have.
TEST_CASE("member: it overtakes a later process that was lost before it was heard") {
  Serving arms;
  const std::uint64_t own = arms.member.presence().incarnation;
  arms.member.on_lost("arms", own - 1, kNow);
  CHECK_FALSE(arms.member.take_outcome().overtook);
  arms.member.on_lost("arms", own + 50, kNow);
  const Outcome outcome = arms.member.take_outcome();
  REQUIRE(outcome.overtook);
  CHECK(*outcome.overtook > own + 50);
  CHECK(arms.member.given_up().empty());
}

TEST_CASE("member: at the end of the range of incarnations it keeps its own") {
  Serving arms;
  const std::uint64_t own = arms.member.presence().incarnation;
  Presence head = presence_of("head", 1, 0);
  head.absent = {{"arms", 1, Absent::Kind::kLost, kLastIncarnation}};
  for (int i = 0; i < 3; ++i) {
    arms.member.on_presence(head, kNow);
    CHECK(arms.member.take_outcome().overtook.has_value() == (i == 0));
  }
  CHECK(arms.member.presence().incarnation > own);
}

// ---- when a name is taken

TEST_CASE("claiming: a free name is taken after the discovery time and then served") {
  Presence own = presence_of("arms", 5, 0);
  own.ticket = 5;
  NameClaim claim(own);
  Claiming::Patience patience;
  patience.meeting = std::chrono::milliseconds(100);
  const Claiming::Clock::time_point begin{};
  const auto at = [&](int ms) { return begin + std::chrono::milliseconds(ms); };
  Claiming claiming(claim, patience, begin);
  using Step = Claiming::Step;
  CHECK(claiming.next(at(99), false) == Step::kWait);
  SECTION("at once") {
    CHECK(claiming.next(at(100), false) == Step::kTake);
    CHECK(claiming.next(at(101), false) == Step::kServe);
  }
  SECTION("later if a participant has not announced yet what it serves") {
    CHECK(claiming.next(at(100), true) == Step::kWait);
    CHECK(claiming.next(at(3101), true) == Step::kTake);
  }
  SECTION("not while another process serves") {
    Presence other = presence_of("arms", 3, 1);
    other.ticket = 3;
    claim.hear(other);
    CHECK(claiming.next(at(100), false) == Step::kWait);
    SECTION("which is then lost") {
      claim.lost(3);
      CHECK(claiming.next(at(500), false) == Step::kTake);
    }
    SECTION("which stays") { CHECK(claiming.next(at(1601), false) == Step::kLeave); }
  }
  SECTION("not if an earlier claim takes it") {
    CHECK(claiming.next(at(100), false) == Step::kTake);
    Presence earlier = presence_of("arms", 3, 0);
    earlier.ticket = 3;
    earlier.serving = false;
    claim.hear(earlier);
    CHECK(claiming.next(at(101), false) == Step::kWait);
    earlier.taken = true;
    claim.hear(earlier);
    CHECK(claiming.next(at(102), false) == Step::kLeave);
  }
}

TEST_CASE("member: an absence ends with the last contested frame, without another message") {
  const Presence legs = presence_of("legs", 1, 1);
  Serving arms;
  arms.member.on_presence(legs, kNow);
  arms.member.on_page({"legs", 0, 1, 2, {{"foot", "", 10}}});
  arms.member.on_lost("legs", 1, kNow);
  for (auto after = Milliseconds(0); after <= Absences::kTakeover; after += Milliseconds(100)) {
    arms.member.on_time(Absences::Steady(after));
  }
  CHECK_FALSE(arms.ask(1, "toe", AddRequest{"arm", along_x(1)}));
  REQUIRE(arms.forest.holds("toe"));
  // Before its presence, which alone would end the absence.
  arms.member.on_page({"legs", 0, 1, 3, {{"foot", "", 10}, {"toe", "foot", 10}}});
  arms.member.on_presence(legs, kNow);
  (void)arms.member.take_outcome();
  REQUIRE(arms.directory.absent().size() == 1);
  CHECK(arms.directory.absent()[0].kind == Absent::Kind::kBack);
  (void)arms.member.stored(arms.member.take_ready());
  REQUIRE(arms.member.release({"toe"}, kNow));
  CHECK(arms.member.take_outcome().look_for_gone);
  const Absences::Steady start{Absences::kTakeover + Absences::kGrace};
  for (auto after = Milliseconds(0); after <= Absences::kGrace; after += Milliseconds(100)) {
    (void)arms.member.take_outcome();
    arms.member.on_time(start + after);
  }
  CHECK(arms.member.take_outcome().to_commit);
  const Ready ready = arms.member.take_ready();
  REQUIRE(ready.presence);
  CHECK(ready.presence->absent.empty());
}

TEST_CASE("a partition that returns with a page first is told to whoever waits or streams") {
  constexpr Time kThen{std::chrono::seconds(100)};
  Replica replica;
  Member client(replica.forest, replica.directory, "");
  client.on_presence(presence_of("arm", 1, 1), kThen);
  client.on_page({"arm", 0, 1, 2, {{"hand", "", 10}}});
  client.on_lost("arm", 1, kThen);
  CHECK(client.take_outcome().routes);
  client.on_page({"arm", 0, 2, 3, {{"hand", "", 10}, {"tool", "hand", 10}}});
  CHECK(client.take_outcome().routes);
  client.on_presence(presence_of("arm", 2, 1), kThen);
  REQUIRE(replica.forest.exists("tool"));
  CHECK(client.take_outcome().routes);
}

}  // namespace tfdude
