// Owners that hand a frame over, as state machines: what they claim, store and answer, whatever
// reaches them, and in which order.

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "partition/frame_claims.hpp"
#include "partition/member.hpp"
#include "support/catch.hpp"
#include "support/forest_support.hpp"
#include "support/memory_store.hpp"
#include "support/replica.hpp"

namespace tfdude {
namespace {

using testing::along_x;
using testing::MemoryStore;
using testing::Replica;
using testing::x_of;
using Step = HandOverRequest::Step;

// After a partition is gone for certain.
constexpr std::chrono::seconds kLong{10};

// An owner whose disk and messages wait until they are told.
struct Arm : Replica {
  /// @param before  heard before it serves; null: nobody
  Arm(const std::string& name, MemoryStore& store, std::int64_t start,
      const std::vector<FrameSpec>& frames, const Arm* before = nullptr)
      : Replica(name), member(forest, directory, name), store_(store), now_(start) {
    member.claim("here", 42, now(), 5);
    if (before != nullptr) hear(*before);
    (void)member.introduce();
    const StoredState left = store.load().value_or(StoredState());
    REQUIRE(member.serve(&left, frames, now()));
    save();
  }

  [[nodiscard]] Time now() { return time_of(now_ += 1'000); }

  // What it wants to tell, if the disk has it.
  void save() {
    Ready ready = member.take_ready();
    member.partition()->add_values(ready.rows);
    REQUIRE(store_.save(ready.rows));
    written(ready);
  }
  void written(const Ready& ready) {
    if (const auto said = member.stored(ready)) presence_ = *said;
    for (const Page& page : ready.pages) pages_[page.number] = page;
    (void)member.take_outcome();
  }

  void hear(const Arm& other) {
    for (const auto& [number, page] : other.pages_) member.on_page(page);
    member.on_presence(other.presence_, now());
    (void)member.take_outcome();
  }
  void lose(const Arm& other, std::chrono::seconds time = kLong) {
    member.on_lost(other.presence_.partition, other.presence_.incarnation, now());
    pass(time);
  }
  void pass(std::chrono::seconds time) {
    // Longer gaps do not count.
    constexpr std::chrono::milliseconds kStep{100};
    for (const auto end = steady_ + time; steady_ <= end; steady_ += kStep) {
      member.on_time(steady_);
      (void)member.take_outcome();
    }
  }
  // As if the others had been asked for their current state.
  void yield() {
    // A yield may follow from another one.
    for (int round = 0; round < 3; ++round) {
      member.yield(member.pending_yields(), true, now());
      (void)member.take_outcome();
    }
  }

  [[nodiscard]] std::string ask(decltype(Request::body) body, PeerId from = {7}) {
    const Reply reply = member.partition()->answer(
        from, Request{++sequence_, "gripper", std::move(body), sequence_}, now());
    (void)member.take_outcome();
    if (const auto* part = std::get_if<HandedPart>(&reply.body)) read = *part;
    const auto* error = std::get_if<Error>(&reply.body);
    return error != nullptr ? std::string(to_string(error->code)) : "ok";
  }
  [[nodiscard]] std::string update(double x) {
    return ask(UpdateRequest{{{"gripper", along_x(x)}}, {}});
  }
  [[nodiscard]] std::uint64_t claim() { return forest.info("gripper")->lamport_time; }
  [[nodiscard]] std::string owner() {
    const auto there = forest.info("gripper");
    return there ? directory.name(there->owner) : "none";
  }

  Member member;
  HandedPart read;

 private:
  MemoryStore& store_;
  std::int64_t now_;
  Member::Steady steady_{};
  Presence presence_;
  std::map<std::uint32_t, Page> pages_;
  std::uint32_t sequence_ = 0;
};

// "arm1" has the gripper, of which "arm2" gets everything.
struct Arms {
  Arms() {
    restart_first();
    restart_second(nullptr);
    meet();
  }
  void restart_first() {
    arm1 = std::make_unique<Arm>(
        "arm1", store1, starts_ += 1'000'000,
        std::vector<FrameSpec>{
            {"base", "", {}}, {"flange", "base", along_x(1)}, {"gripper", "base", along_x(1)}});
  }
  void restart_second(const Arm* before) {
    arm2 = std::make_unique<Arm>("arm2", store2, 1'000'000 + (starts_ += 1'000'000),
                                 std::vector<FrameSpec>{{"other", "", {}}}, before);
  }
  void meet() {
    for (int i = 0; i < 3; ++i) {
      arm1->hear(*arm2);
      arm2->hear(*arm1);
      arm1->save();
      arm2->save();
    }
  }
  // Until the new owner has it, and has told nobody.
  void adopt() {
    REQUIRE(arm1->ask(HandOverRequest{Step::kBegin, "arm2"}) == "ok");
    arm1->save();
    arm2->hear(*arm1);
    REQUIRE(arm1->ask(HandOverRequest{Step::kRead, "arm2"}) == "ok");
    REQUIRE(arm2->ask(AdoptRequest{"arm1", {}, {}, arm1->read, 0}) == "ok");
    arm2->save();
  }
  void cut(std::chrono::seconds time = kLong) {
    arm1->lose(*arm2, time);
    arm2->lose(*arm1, time);
    arm1->save();
    arm2->save();
  }
  // Both have heard of each other, and know who has to yield.
  void agree() {
    meet();
    arm1->yield();
    arm2->yield();
    meet();
  }

  MemoryStore store1;
  MemoryStore store2;
  std::unique_ptr<Arm> arm1;
  std::unique_ptr<Arm> arm2;

 private:
  std::int64_t starts_ = 0;
};

void check_only(Arms& arms, const std::string& owner, double x) {
  CHECK(arms.arm1->owner() == owner);
  CHECK(arms.arm2->owner() == owner);
  Arm& one = owner == "arm1" ? *arms.arm1 : *arms.arm2;
  CHECK(x_of(one.forest.value("gripper")) == x);
  CHECK(one.update(9) == "ok");
  CHECK((owner == "arm1" ? *arms.arm2 : *arms.arm1).update(9) == "not_owner");
}

}  // namespace

TEST_CASE("handover: the former owner answers until its disk has that it lets go") {
  Arms arms;
  arms.adopt();
  arms.arm1->hear(*arms.arm2);
  const std::uint64_t offered = arms.arm1->claim();
  CHECK(arms.arm1->ask(HandOverRequest{Step::kEnd, "arm2"}) == "ok");  // sent when it is stored
  Ready ready = arms.arm1->member.take_ready();
  arms.arm1->member.partition()->add_values(ready.rows);
  REQUIRE(arms.arm1->owner() == "arm1");
  CHECK(x_of(arms.arm1->forest.value("gripper")) == 1);
  CHECK(arms.arm1->update(5) == "not_owner");
  CHECK(ready.rows.frames.empty());
  CHECK(ready.rows.values.empty());
  CHECK(ready.rows.erased == std::vector<std::string>{"gripper"});
  SECTION("which fails") {
    (void)arms.arm1->member.not_stored(ready);
    arms.arm1->pass(kLong);  // it is decided all the same
    CHECK(arms.arm1->owner() == "arm1");
    CHECK(arms.arm1->update(5) == "not_owner");
    arms.arm1->save();
  }
  SECTION("which succeeds") { arms.arm1->written(ready); }
  CHECK(arms.arm1->owner() == "arm2");
  CHECK(arms.arm2->update(5) == "not_owner");
  arms.arm1->save();
  arms.meet();
  CHECK(arms.arm2->claim() == offered + kAdopted);
  check_only(arms, "arm2", 1);
}

TEST_CASE("handover: a kept frame that is moved stays the older claim, through cuts and restarts") {
  Arms arms;
  arms.adopt();
  arms.cut();
  CHECK(arms.arm2->update(3) == "ok");  // which it took for its own after that time
  REQUIRE(arms.arm1->update(4) == "ok");
  const std::uint64_t kept = arms.arm1->claim();
  REQUIRE(arms.arm1->ask(MoveRequest{"flange", along_x(2)}) == "ok");
  arms.arm1->save();
  SECTION("without a restart") {}
  SECTION("with one") {
    const std::string parent = arms.arm1->forest.info("gripper")->parent;
    arms.restart_first();
    CHECK(arms.arm1->forest.info("gripper")->parent == parent);
  }
  CHECK(arms.arm1->claim() == kept);
  arms.agree();
  CHECK(arms.arm2->forest.info("gripper")->parent == "flange");
  check_only(arms, "arm1", 2);
}

TEST_CASE("handover: a kept frame that is moved is not yielded to who has adopted it unheard") {
  Arms arms;
  arms.adopt();
  REQUIRE(arms.arm1->ask(HandOverRequest{Step::kCancel, "arm2"}) == "ok");
  REQUIRE(arms.arm1->ask(MoveRequest{"flange", along_x(2)}) == "ok");
  arms.arm1->save();
  SECTION("of which it hears first") {
    arms.arm1->hear(*arms.arm2);
    arms.arm1->yield();
    arms.arm1->save();
  }
  SECTION("which hears of it first") {
    arms.arm2->hear(*arms.arm1);
    arms.arm2->yield();
    arms.arm2->save();
  }
  arms.agree();
  check_only(arms, "arm1", 2);
}

TEST_CASE("handover: after a cut that is shorter than the lease the new owner has the frame") {
  Arms arms;
  arms.adopt();
  arms.cut(std::chrono::seconds(4));
  REQUIRE(arms.arm2->update(3) == "ok");
  REQUIRE(arms.arm1->update(4) == "not_owner");
  arms.arm2->save();
  Arm& first = GENERATE(true, false) ? *arms.arm2 : *arms.arm1;
  Arm& last = &first == arms.arm1.get() ? *arms.arm2 : *arms.arm1;
  first.hear(last);
  first.yield();
  last.hear(first);
  last.yield();
  first.save();
  last.save();
  arms.agree();
  check_only(arms, "arm2", 3);
}

TEST_CASE("handover: the former owner keeps the frame if the new one is gone before it lets go") {
  Arms arms;
  arms.adopt();
  arms.arm1->hear(*arms.arm2);
  Ready ready = arms.arm1->member.take_ready();
  MemoryStore empty;
  arms.arm2 =
      std::make_unique<Arm>("arm2", empty, 9'000'000, std::vector<FrameSpec>{{"other", "", {}}});
  arms.arm1->hear(*arms.arm2);
  arms.arm1->written(ready);
  arms.arm1->save();
  arms.agree();
  check_only(arms, "arm1", 1);
}

TEST_CASE("handover: what a process has offered is kept by the next one") {
  Arms arms;
  arms.adopt();
  const std::uint64_t offered = arms.arm1->claim();
  arms.restart_first();
  CHECK(arms.arm1->claim() == offered - kKept);
  CHECK(arms.arm1->update(4) == "ok");
  arms.arm1->save();
  arms.agree();
  check_only(arms, "arm1", 4);
}

TEST_CASE("handover: an owner that was missed is not taken over from before both have agreed") {
  Arms arms;
  arms.adopt();
  arms.arm2->lose(*arms.arm1);  // only one of them has missed the other
  arms.arm2->save();
  CHECK(arms.arm1->ask(HandOverRequest{Step::kCancel, "arm2"}) == "ok");
  arms.arm1->hear(*arms.arm2);
  arms.arm1->save();
  arms.agree();
  check_only(arms, "arm2", 1);
}

// The former owner dies, and has told the next process of the new one only that it lets go.
TEST_CASE("handover: a new owner that was away before keeps the frame through its restart") {
  Arms arms;
  arms.arm1->lose(*arms.arm2);
  arms.arm1->save();
  arms.restart_second(nullptr);
  arms.agree();
  arms.adopt();
  arms.arm1->hear(*arms.arm2);
  REQUIRE(arms.arm1->ask(HandOverRequest{Step::kEnd, "arm2"}) == "ok");
  arms.arm1->save();
  arms.meet();
  REQUIRE(arms.arm2->ask(MoveRequest{"other", along_x(2)}) == "ok");
  arms.arm2->save();
  arms.restart_second(&*arms.arm1);
  arms.arm2->yield();
  CHECK(arms.arm2->owner() == "arm2");
  CHECK(x_of(arms.arm2->forest.value("gripper")) == 2);
  CHECK(arms.arm2->update(3) == "ok");
}

TEST_CASE("handover: only the partition to which a frame is offered can adopt it") {
  Arms arms;
  MemoryStore store3;
  Arm third("arm3", store3, 3'000'000, {});
  third.hear(*arms.arm1);
  REQUIRE(arms.arm1->ask(HandOverRequest{Step::kBegin, "arm2"}) == "ok");
  arms.arm1->save();
  REQUIRE(arms.arm1->ask(HandOverRequest{Step::kRead, "arm2"}) == "ok");
  HandedPart forged = arms.arm1->read;
  forged.edges.front().X_PC = along_x(77);
  third.hear(*arms.arm1);
  CHECK(third.ask(AdoptRequest{"arm1", {}, {}, forged, 0}) == "not_owner");
  CHECK(third.owner() == "arm1");
  arms.arm2->hear(*arms.arm1);
  CHECK(arms.arm2->ask(AdoptRequest{"arm1", {}, {}, arms.arm1->read, 0}) == "ok");
  arms.arm2->save();
  arms.meet();
  check_only(arms, "arm2", 1);
}

TEST_CASE("handover: what its owner does not offer any more cannot be adopted, even if it stops") {
  Arms arms;
  const std::uint64_t before = arms.arm1->claim();
  REQUIRE(arms.arm1->ask(HandOverRequest{Step::kBegin, "arm2"}) == "ok");
  REQUIRE(arms.arm1->ask(HandOverRequest{Step::kRead, "arm2"}) == "ok");
  HandedPart forged = arms.arm1->read;
  HandedEdge& top = forged.edges.front();
  const std::uint64_t offered = top.lamport_time;
  top.X_PC = along_x(77);
  const auto check_rejected = [&] {
    for (const std::uint64_t time : {before, offered - kKept, offered, offered + kPassedOn}) {
      INFO(time << " instead of " << arms.arm1->claim());
      top.lamport_time = time;
      CHECK(arms.arm2->ask(AdoptRequest{"arm1", {}, {}, forged, 0}) != "ok");
      CHECK(arms.arm2->owner() == "arm1");
    }
  };
  REQUIRE(arms.arm1->ask(HandOverRequest{Step::kCancel, "arm2"}) == "ok");
  arms.arm1->save();
  arms.meet();
  check_rejected();
  arms.arm2->lose(*arms.arm1, std::chrono::seconds(1));
  check_rejected();
  arms.restart_first();
  arms.agree();
  check_rejected();
  arms.arm2->lose(*arms.arm1);
  check_rejected();
  arms.agree();
  check_only(arms, "arm1", 1);
}

TEST_CASE("handover: who cancels too late hears that the other one has it") {
  Arms arms;
  arms.adopt();
  arms.meet();
  CHECK(arms.arm1->ask(HandOverRequest{Step::kCancel, "arm2"}) == "already_exists");
  CHECK(arms.arm1->ask(HandOverRequest{Step::kEnd, "arm2"}) == "ok");
  check_only(arms, "arm2", 1);
}

TEST_CASE("handover: a second call with another parent does not pass for the first one") {
  Arms arms;
  arms.adopt();
  CHECK(arms.arm2->ask(AdoptRequest{"arm1", {}, {}, arms.arm1->read, 0}) == "ok");
  CHECK(arms.arm2->ask(AdoptRequest{"arm1", "other", {}, arms.arm1->read, 0}) != "ok");
  arms.meet();
  check_only(arms, "arm2", 1);
}

TEST_CASE("handover: a new owner does not keep what the former one has kept and given away") {
  Arms arms;
  arms.adopt();
  REQUIRE(arms.arm1->ask(HandOverRequest{Step::kCancel, "arm2"}) == "ok");
  SECTION("released") {
    REQUIRE(arms.arm1->member.release({"gripper"}, arms.arm1->now()));
    arms.arm1->save();
    arms.meet();
    CHECK(arms.arm1->owner() == "none");
    CHECK(arms.arm2->owner() == "none");
  }
  SECTION("nothing of that") {
    arms.arm1->save();
    arms.meet();
    check_only(arms, "arm1", 1);
  }
}

TEST_CASE("handover: times of changes are on a grid, and those of handovers between") {
  Replica replica("arm1");
  std::uint64_t before = 0;
  for (const std::int64_t now : {0, 1, 17, 1000, 1001, 900}) {
    const std::uint64_t time = replica.directory.next_lamport_time(time_of(now));
    CHECK(time % kLamportGrid == 0);
    CHECK(time > before);
    before = time;
    replica.directory.saw_lamport_time(before += 3);
  }
  const std::uint64_t offer = time_of_offer(before, "arm2");
  CHECK(offer >= before / kLamportGrid * kLamportGrid);
  CHECK(is_offered_to(offer, "arm2"));
  CHECK_FALSE(is_offered_to(offer, "arm3"));
  CHECK_FALSE(is_offered_to(offer + 1, "arm2"));
  CHECK(is_adopted(offer, offer + kAdopted));
  CHECK(is_passed_on(offer + kAdopted, offer + kPassedOn));
  CHECK(is_kept(offer - kKept, offer + kAdopted));
  // By accident, of a partition that does not know the grid.
  CHECK_FALSE(is_adopted(offer + 1, offer + 2));
  CHECK_FALSE(is_passed_on(offer + 2, offer + 5));
}

}  // namespace tfdude
