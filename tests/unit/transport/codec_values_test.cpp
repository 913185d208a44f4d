// Numbers that are missing: covariances that are unspecified, and what is not supported yet.

#include <string>

#include "partition/counters.hpp"
#include "support/catch.hpp"
#include "support/samples.hpp"

namespace tfdude::fastdds {
namespace {

template <class Type, class Sample>
Sample travelled(const Sample& sample) {
  Sample arrived;
  REQUIRE(testing::deserialized<Type>(testing::serialized<Type>(sample), arrived));
  return arrived;
}

TEST_CASE("a number that others count on from has a range, and what is beyond is named") {
  const auto move = [](std::uint64_t time) {
    const auto read = from_wire(
        travelled<RequestType>(to_wire(Request{7, "hand", MoveRequest{"arm", {}, time}}, "arms")));
    return read ? "ok" : read.error().message;
  };
  CHECK(move(kLastCounter) == "ok");
  CHECK(move(kLastCounter + 1) ==
        "a Lamport time of 9223372036854775809 is beyond 9223372036854775808");
  CHECK(move(~0ULL) != "ok");
  const auto page = [](std::uint64_t incarnation, std::uint64_t epoch, std::uint64_t entry,
                       std::uint64_t tombstone) {
    const Page one{"arms",
                   0,
                   incarnation,
                   epoch,
                   {{"hand", "arm", entry}},
                   {{"lamp", tombstone, Tombstone::Kind::kRemoved, ""}}};
    return from_wire(travelled<PageType>(to_wire(one))).has_value();
  };
  CHECK(page(kLastIncarnation, kLastCounter, kLastCounter, kLastCounter));
  CHECK_FALSE(page(kLastIncarnation + 1, 1, 1, 1));
  CHECK_FALSE(page(1, kLastCounter + 1, 1, 1));
  CHECK_FALSE(page(1, 1, kLastCounter + 1, 1));
  CHECK_FALSE(page(1, 1, 1, kLastCounter + 1));
  const auto presence = [](std::uint64_t incarnation, std::uint64_t absent) {
    Presence one{"arms", incarnation, "host", 1, 0, true};
    one.absent = {{"legs", 0, Absent::Kind::kLost, absent}};
    return from_wire(travelled<PresenceType>(to_wire(one))).has_value();
  };
  CHECK(presence(kLastIncarnation, kLastIncarnation));
  CHECK_FALSE(presence(kLastIncarnation + 1, 1));
  CHECK_FALSE(presence(1, kLastIncarnation + 1));
  Reply reply;
  reply.lamport_time = kLastCounter + 1;
  CHECK_FALSE(from_wire(travelled<ReplyType>(to_wire(reply))));
}

TEST_CASE("an unspecified covariance and an unspecified variance take no bytes") {
  const Transform nothing{Pose(), StatedCovariance::unspecified()};
  const wire::Update whole = to_wire(Update{{{"hand", Transform{Pose(), Covariance()}}}});
  const wire::Update update = to_wire(Update{{{"hand", nothing}}});
  CHECK(testing::serialized<UpdateType>(update).size() ==
        testing::serialized<UpdateType>(whole).size() - 21 * sizeof(double));
  const auto read = from_wire(travelled<UpdateType>(update), [](std::string_view) { return true; });
  REQUIRE(read);
  CHECK(read->edges[0].X_PC.covariance == StatedCovariance::unspecified());

  const wire::Joints both = to_wire(JointUpdate{{{"elbow", 0.5, 1e-4}}});
  const wire::Joints joints = to_wire(JointUpdate{{{"elbow", 0.5}}});
  CHECK(testing::serialized<JointsType>(joints).size() ==
        testing::serialized<JointsType>(both).size() - sizeof(double));
  const auto position =
      from_wire(travelled<JointsType>(joints), [](std::string_view) { return true; });
  REQUIRE(position);
  CHECK(position->joints[0].position == 0.5);
  CHECK_FALSE(position->joints[0].variance);
}

TEST_CASE("a pushed value without covariance has the one before or none") {
  const Transform X{Pose(), StatedCovariance::unspecified()};
  PushedValue numbered{0, {}, X, {}, 1};
  numbered.covariance_number = 3;
  numbered.covariance_known = true;
  const PushedValues pushed{1, {{0, {}, X, {}, 1}, numbered}};
  const auto arrived = from_wire(travelled<StateType>(to_wire(pushed)));
  REQUIRE(arrived);
  CHECK_FALSE(arrived->entries[0].covariance_known);
  CHECK_FALSE(arrived->entries[0].X.covariance.complete());
  CHECK(arrived->entries[1].covariance_known);
}

TEST_CASE("a pushed value of an edge that had no sample yet says so") {
  PushedValue begins{0, {}, Transform(), {}, 1};
  begins.process_noise = Covariance();
  begins.unsampled = true;
  PushedValue goes_on = begins;
  goes_on.process_noise.reset();
  PushedValue fixed = begins;
  fixed.unsampled = false;
  const auto arrived =
      from_wire(travelled<StateType>(to_wire(PushedValues{1, {begins, goes_on, fixed}})));
  REQUIRE(arrived);
  CHECK(arrived->entries[0].unsampled);
  CHECK(arrived->entries[0].process_noise);
  CHECK(arrived->entries[1].unsampled);
  CHECK_FALSE(arrived->entries[2].unsampled);
  CHECK(arrived->entries[2].process_noise);
  // If there are too many to say it of all, some have no value.
  PushedValues many{1, std::vector<PushedValue>(kMaxItems - 1, begins)};
  const auto all = from_wire(travelled<StateType>(to_wire(many)));
  REQUIRE(all);
  CHECK(all->entries[0].unsampled);
  CHECK(all->entries[1].cleared);
}

TEST_CASE("a pushed value that begins the history of an edge that drifts says so") {
  PushedValue unsampled{0, {}, Transform(), {}, 1};
  unsampled.process_noise = *Covariance::from_stddev({1, 1, 1, 1, 1, 1});
  unsampled.unsampled = true;
  unsampled.drifts = true;
  PushedValue sampled = unsampled;
  sampled.unsampled = false;
  sampled.stamp = Time(std::chrono::seconds(1));
  PushedValue stays = sampled;
  stays.drifts = false;
  PushedValue cleared = unsampled;
  cleared.unsampled = false;
  cleared.cleared = true;
  const auto arrived = from_wire(
      travelled<StateType>(to_wire(PushedValues{1, {unsampled, sampled, stays, cleared}})));
  REQUIRE(arrived);
  const auto& entries = arrived->entries;
  CHECK(entries[0].unsampled);
  for (const std::size_t i : {1U, 2U, 3U}) CHECK_FALSE(entries[i].unsampled);
  for (const std::size_t i : {0U, 1U, 3U}) CHECK(entries[i].drifts);
  CHECK_FALSE(entries[2].drifts);
  for (const PushedValue& one : entries) {
    CHECK(one.process_noise->upper() == unsampled.process_noise->upper());
  }
}

TEST_CASE("a reply whose unspecified edges belong to no value is rejected") {
  SegmentValues found;
  found.values = {{Pose(), StatedCovariance::unspecified()}};
  found.unspecified = {{0, "hand"}};
  wire::Reply reply = to_wire(Reply{1, 2, found});
  REQUIRE(from_wire(reply));
  reply.body().incomplete().unspecified()[0].value(1);
  const auto read = from_wire(reply);
  REQUIRE_FALSE(read);
  CHECK(read.error().message == "a reply: an unspecified edge of value 1, of 1");
}

TEST_CASE("a reply of too many unspecified edges still says which values are not complete") {
  SegmentValues found;
  found.values.assign(2, {Pose(), StatedCovariance::unspecified()});
  for (std::size_t i = 0; i < kMaxItems; ++i) found.unspecified.push_back({0, std::to_string(i)});
  found.unspecified.push_back({1, "hand"});
  const auto read = from_wire(travelled<ReplyType>(to_wire(Reply{1, 2, found})));
  REQUIRE(read);
  const auto& values = std::get<SegmentValues>(read->body);
  CHECK_FALSE(values.values[0].covariance.complete());
  CHECK_FALSE(values.values[1].covariance.complete());
  CHECK(values.unspecified.size() == 2);
}

TEST_CASE("a transform has 7 or 28 numbers and a position 1 or 2") {
  for (const std::size_t count : {0U, 6U, 8U, 27U}) {
    wire::Update update = to_wire(Update{{{"hand", {}}}});
    update.edges()[0].x_pc().resize(count);
    const auto read = from_wire(update, [](std::string_view) { return true; });
    REQUIRE_FALSE(read);
    CHECK(read.error().message ==
          "frame 'hand': a transform of " + std::to_string(count) + " numbers");
  }
  wire::Joints joints = to_wire(JointUpdate{{{"elbow", 0.5, 1e-4}}});
  joints.positions()[0].numbers().clear();
  const auto read = from_wire(joints, [](std::string_view) { return true; });
  REQUIRE_FALSE(read);
  CHECK(read.error().message == "joint 'elbow' without a position");
}

TEST_CASE("no stamp differs from a stamp of zero") {
  const auto stamp_of = [](std::int64_t stamp) {
    wire::Update update = to_wire(Update{{{"hand", {}}}});
    update.stamp(stamp);
    return from_wire(travelled<UpdateType>(update), [](std::string_view) { return true; });
  };
  CHECK(stamp_of(-1)->stamp == std::nullopt);
  CHECK(stamp_of(0)->stamp == time_of(0));
  CHECK(stamp_of(INT64_MAX)->stamp == time_of(INT64_MAX));
  for (const std::int64_t bad : {std::int64_t{-2}, INT64_MIN}) {
    const auto read = stamp_of(bad);
    REQUIRE_FALSE(read);
    CHECK(read.error().message ==
          "the stamp of an update of " + std::to_string(bad) + " ns is negative");
  }
}

}  // namespace
}  // namespace tfdude::fastdds
