#include "transport/fastdds/codec.hpp"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tfdude/base/id.hpp"

#include "support/catch.hpp"
#include "support/same_messages.hpp"
#include "support/samples.hpp"
#include "transport/fastdds/field_values.hpp"

namespace tfdude::fastdds {
namespace {

using testing::check_same;
using testing::listed;
using testing::Random;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// ---- round trips

template <class Type, class Sample>
Sample travelled(const Sample& sample) {
  Sample arrived;
  REQUIRE(testing::deserialized<Type>(testing::serialized<Type>(sample), arrived));
  return arrived;
}

TEST_CASE("pushed values are decoded as they were encoded") {
  Random random(0xc0de7);
  INFO("seed " << random.seed());
  for (const PushedValues& one : testing::pushed_values(random)) {
    const auto arrived = from_wire(travelled<StateType>(to_wire(one)));
    REQUIRE(arrived);
    check_same(*arrived, one);
  }
}

TEST_CASE("the time is decoded as it was encoded, and a negative time is rejected") {
  for (const Time now : {time_of(0), time_of(1), time_of(INT64_MAX)}) {
    CHECK(*from_wire(travelled<ClockType>(to_wire(now))) == now);
  }
  const auto negative = from_wire(travelled<ClockType>(to_wire(time_of(-1))));
  REQUIRE_FALSE(negative);
  CHECK(negative.error().code == Errc::kInvalidInput);
}

TEST_CASE("requests are decoded as they were encoded") {
  Random random(0xc0de1);
  INFO("seed " << random.seed());
  for (const Request& one : testing::requests(random)) {
    INFO("request " << one.sequence);
    const auto arrived = from_wire(travelled<RequestType>(to_wire(one, "robot")));
    REQUIRE(arrived);
    check_same(*arrived, one);
  }
}

TEST_CASE("replies are decoded as they were encoded") {
  Random random(0xc0de2);
  INFO("seed " << random.seed());
  for (const Reply& one : testing::replies(random)) {
    INFO("reply " << one.sequence);
    const auto arrived = from_wire(travelled<ReplyType>(to_wire(one)));
    REQUIRE(arrived);
    CHECK(arrived->sequence == one.sequence);
    CHECK(arrived->epoch == one.epoch);
    CHECK(arrived->lamport_time == one.lamport_time);
    REQUIRE(arrived->body.index() == one.body.index());
    if (const auto* error = std::get_if<Error>(&one.body)) {
      CHECK(std::get<Error>(arrived->body).code == error->code);
      CHECK(std::get<Error>(arrived->body).message == printable(error->message));
    } else if (const auto* values = std::get_if<SegmentValues>(&one.body)) {
      const auto& came = std::get<SegmentValues>(arrived->body);
      CHECK(came.stamp == values->stamp);
      CHECK(came.period == values->period);
      check_same(came.values, values->values);
      check_same(came.at_hint.values, values->at_hint.values);
      check_same(came.correlations, values->correlations);
      check_same(came.at_hint.correlations, values->at_hint.correlations);
      check_same(came.unspecified, values->unspecified);
      check_same(came.at_hint.unspecified, values->at_hint.unspecified);
      CHECK(came.commit == values->commit);
      REQUIRE(came.rows.size() == values->rows.size());
      for (std::size_t i = 0; i < came.rows.size(); ++i) {
        CHECK(came.rows[i].segment == values->rows[i].segment);
        CHECK(came.rows[i].stamp == values->rows[i].stamp);
        check_same(came.rows[i].X_PC, values->rows[i].X_PC);
        check_same(std::vector{came.rows[i].correlation}, std::vector{values->rows[i].correlation});
      }
    } else if (const auto* pushed = std::get_if<PushedValues>(&one.body)) {
      check_same(std::get<PushedValues>(arrived->body), *pushed);
    } else if (const auto* all = std::get_if<std::vector<EdgeConsistency>>(&one.body)) {
      const auto& came = std::get<std::vector<EdgeConsistency>>(arrived->body);
      REQUIRE(came.size() == all->size());
      for (std::size_t i = 0; i < came.size(); ++i) {
        CHECK(came[i].id == (*all)[i].id);
        CHECK(came[i].observations == (*all)[i].observations);
        CHECK(came[i].refused == (*all)[i].refused);
        check_same(came[i].sum, (*all)[i].sum);
      }
    } else if (const auto* histories = std::get_if<std::vector<HistoryInfo>>(&one.body)) {
      const auto& came = std::get<std::vector<HistoryInfo>>(arrived->body);
      REQUIRE(came.size() == histories->size());
      for (std::size_t i = 0; i < came.size(); ++i)
        CHECK(listed(came[i]) == listed((*histories)[i]));
    } else if (const auto* joints = std::get_if<std::vector<JointInfo>>(&one.body)) {
      const auto& came = std::get<std::vector<JointInfo>>(arrived->body);
      REQUIRE(came.size() == joints->size());
      for (std::size_t i = 0; i < came.size(); ++i) CHECK(listed(came[i]) == listed((*joints)[i]));
    } else if (const auto* frames = std::get_if<std::vector<KnownFrame>>(&one.body)) {
      CHECK(listed(std::get<std::vector<KnownFrame>>(arrived->body)) == listed(*frames));
    } else if (const auto* part = std::get_if<DescriptionPart>(&one.body)) {
      const auto& came = std::get<DescriptionPart>(arrived->body);
      CHECK(came.size == part->size);
      CHECK(came.hash == part->hash);
      CHECK(came.text == part->text);
    } else if (const auto* offer = std::get_if<MemoryOffer>(&one.body)) {
      const auto& came = std::get<MemoryOffer>(arrived->body);
      CHECK(came.kernel == offer->kernel);
      CHECK(came.socket == offer->socket);
      CHECK(came.token == offer->token);
      CHECK(came.layout == offer->layout);
      CHECK(came.incarnation == offer->incarnation);
      CHECK(came.why_not == offer->why_not);
    }
  }
}

TEST_CASE("control characters in a message are escaped") {
  const Reply reply{1, 2, Error{Errc::kCycle, "\x1b[2J \xc3\xa4\n\xff"}};
  const auto arrived = from_wire(travelled<ReplyType>(to_wire(reply)));
  REQUIRE(arrived);
  CHECK(std::get<Error>(arrived->body).message == "\\x1b[2J \xc3\xa4\\x0a\\xff");
}

TEST_CASE("a message that is too long is truncated") {
  const Reply reply{1, 2, Error{Errc::kCycle, std::string(10000, 'm')}};
  const auto arrived = from_wire(travelled<ReplyType>(to_wire(reply)));
  REQUIRE(arrived);
  CHECK(std::get<Error>(arrived->body).message == std::string(4096, 'm'));
}

TEST_CASE("updates are decoded with only the edges that are wanted") {
  Random random(0xc0de3);
  INFO("seed " << random.seed());
  for (const Update& one : testing::updates(random)) {
    const auto sample = travelled<UpdateType>(to_wire(one));
    const auto all = from_wire(sample, [](std::string_view) { return true; });
    REQUIRE(all);
    check_same(all->edges, one.edges);
    const auto some = from_wire(sample, [](std::string_view id) { return id == "ab"; });
    REQUIRE(some);
    CHECK(some->edges.size() == (one.edges.size() == 3 ? 1 : 0));
  }
}

TEST_CASE("joint updates are decoded with only the joints that are wanted") {
  for (const JointUpdate& one : testing::joint_updates()) {
    const auto sample = travelled<JointsType>(to_wire(one));
    const auto all = from_wire(sample, [](std::string_view) { return true; });
    REQUIRE(all);
    CHECK(listed(*all) == listed(one));
    const auto some = from_wire(sample, [](std::string_view name) { return name != "ab"; });
    REQUIRE(some);
    const bool has_it = std::any_of(one.joints.begin(), one.joints.end(),
                                    [](const JointValue& joint) { return joint.name == "ab"; });
    CHECK(some->joints.size() == one.joints.size() - (has_it ? 1 : 0));
  }
}

TEST_CASE("a joint takes few bytes and its edge takes many") {
  const auto bytes_of = [](const auto& kind, const auto& message) {
    return testing::serialized<std::decay_t<decltype(kind)>>(to_wire(message)).size();
  };
  const std::vector<JointValue> six(6, {"shoulder_1", 0.1, 1e-6});
  const std::vector<EdgeUpdate> edges(6, {"shoulder_1", Transform::exact({})});
  CHECK(bytes_of(JointsType(), JointUpdate{six, time_of(1)}) < 6 * 44);
  CHECK(bytes_of(UpdateType(), Update{edges, time_of(1)}) > 6 * 240);
}

TEST_CASE("a pushed value with a known covariance takes at most the bytes of tf2") {
  // tf2's TransformStamped has a stamp, two strings of ten characters, and seven doubles.
  constexpr std::size_t kTf2 = 8 + 2 * (4 + 12) + 7 * 8;
  const auto bytes_of = [](std::size_t count) {
    PushedValues pushed;
    for (std::uint32_t i = 0; i < count; ++i) {
      pushed.entries.push_back({i, time_of(1), Transform::exact({}), {}, 1, {}, false, 1, true});
    }
    return testing::serialized<StateType>(to_wire(pushed)).size();
  };
  CHECK(bytes_of(101) - bytes_of(1) <= 100 * kTf2);
}

TEST_CASE("a presence with an invalid name of an absent partition is rejected") {
  const auto wire = to_wire(Presence{"robot", 1, "tower", 1, 1, true, {{"a,b", 1}}});
  const auto read = from_wire(wire);
  REQUIRE_FALSE(read);
  CHECK(read.error().message.find("'a,b'") != std::string::npos);
}

TEST_CASE("a page or presence without an incarnation is rejected") {
  const auto page = from_wire(to_wire(Page{"robot", 0, 0, 1, {}}));
  REQUIRE_FALSE(page);
  CHECK(page.error().message == "incarnation 0 of partition 'robot'");
  const auto presence = from_wire(to_wire(Presence{"robot", 0, "tower", 1, 1, true}));
  REQUIRE_FALSE(presence);
  CHECK(presence.error().message == "incarnation 0 of partition 'robot'");
}

TEST_CASE("a page with an invalid tombstone is rejected") {
  const auto read = [](const Tombstone& tombstone) {
    const auto page = from_wire(to_wire(Page{"robot", 0, 1, 1, {}, {tombstone}}));
    return page ? "ok" : page.error().message;
  };
  CHECK(read({"hand", 1, Tombstone::Kind::kYielded, "arms"}) == "ok");
  CHECK(read({"hand", 1, static_cast<Tombstone::Kind>(0), ""}) == "unknown kind 0 of a tombstone");
  CHECK(read({"hand", 1, static_cast<Tombstone::Kind>(5), ""}) == "unknown kind 5 of a tombstone");
  CHECK(read({"hand", 1, Tombstone::Kind::kDropped, ""}) == "ok");
  CHECK(read({"", 1, Tombstone::Kind::kRemoved, ""}) != "ok");
  CHECK(read({"hand", 1, Tombstone::Kind::kYielded, "arms,head"}) != "ok");
}

TEST_CASE("pages and presences are decoded as they were encoded") {
  for (const Page& one : testing::pages()) {
    const auto arrived = from_wire(travelled<PageType>(to_wire(one)));
    REQUIRE(arrived);
    CHECK(arrived->partition == one.partition);
    CHECK(arrived->number == one.number);
    CHECK(arrived->incarnation == one.incarnation);
    CHECK(arrived->epoch == one.epoch);
    REQUIRE(arrived->entries.size() == one.entries.size());
    for (std::size_t i = 0; i < one.entries.size(); ++i) {
      CHECK(arrived->entries[i].id == one.entries[i].id);
      CHECK(arrived->entries[i].parent == one.entries[i].parent);
      CHECK(arrived->entries[i].lamport_time == one.entries[i].lamport_time);
    }
    CHECK(arrived->tombstones == one.tombstones);
    CHECK(arrived->joints == one.joints);
    REQUIRE(arrived->others.size() == one.others.size());
    for (std::size_t i = 0; i < one.others.size(); ++i) {
      CHECK(arrived->others[i].number == one.others[i].number);
      CHECK(arrived->others[i].epoch == one.others[i].epoch);
    }
  }
  for (const Presence& one : testing::presences()) {
    const auto arrived = from_wire(travelled<PresenceType>(to_wire(one)));
    REQUIRE(arrived);
    CHECK(arrived->partition == one.partition);
    CHECK(arrived->incarnation == one.incarnation);
    CHECK(arrived->host == one.host);
    CHECK(arrived->pid == one.pid);
    CHECK(arrived->pages == one.pages);
    CHECK(arrived->serving == one.serving);
    CHECK(arrived->absent == one.absent);
    CHECK(arrived->protocol == one.protocol);
    CHECK(arrived->program == one.program);
    CHECK(arrived->clock == one.clock);
  }
}

// ---- values that are rejected

struct BadValue {
  std::size_t index;  // among the numbers of a transform
  double value;
  const char* field;
};

const std::vector<BadValue> kBadValues{
    {0, kNan, "rotation.x"},
    {3, kInfinity, "rotation.w"},
    {3, 2.0, "rotation has the norm"},
    {3, 0.0, "rotation has the norm"},
    {4, kNan, "translation.x"},
    {5, -kInfinity, "translation.y"},
    {6, 1.1e9, "translation.z is beyond"},
    {7, kNan, "covariance[0][0]"},
    {8, kInfinity, "covariance[0][1]"},
    {7, -1.0, "covariance[0][0] is a negative variance"},
    {27, 1.1e18, "covariance[5][5] is 1.1e+18, which is beyond 1e18"},
    {8, 1.0, "covariance[0][1] is larger than its variances allow"},
};

Numbers bad_transform(const BadValue& bad) {
  Numbers x_pc(28);
  x_pc[3] = 1;
  x_pc[bad.index] = bad.value;
  return x_pc;
}

// A request whose frames are called hand, but for the one with the bad value, which is called
// culprit.
std::vector<wire::Request> requests_with(const Numbers& bad) {
  const std::vector<EdgeUpdate> edges{{"hand", {}}, {"culprit", {}}};
  const auto of = [](const std::string& id, auto body) {
    return to_wire(Request{1, id, std::move(body)}, "robot");
  };
  std::vector<wire::Request> all{of("culprit", AddRequest{"hand", {}}),
                                 of("culprit", MoveRequest{"hand", Transform::exact({})}),
                                 of("culprit", UpdateRequest{{{"culprit", {}}}}),
                                 of("hand", UpdateRequest{edges})};
  all[0].body().add().x_pc(bad);
  all[1].body().move_and_update().x_pc(bad);
  all[2].body().update().x_pc(bad);
  all[3].body().update().more()[0].x_pc(bad);
  return all;
}

template <class T>
void check_refused(const Result<T>& result, const std::string& place, const std::string& field) {
  REQUIRE_FALSE(result);
  CHECK(result.error().code == Errc::kInvalidInput);
  CAPTURE(result.error().message);
  CHECK(result.error().message.find(place) != std::string::npos);
  CHECK(result.error().message.find(field) != std::string::npos);
}

TEST_CASE("invalid values of a transform are rejected by frame and field") {
  for (const BadValue& bad : kBadValues) {
    INFO("x_pc[" << bad.index << "] = " << bad.value);
    const Numbers x_pc = bad_transform(bad);
    for (const wire::Request& sample : requests_with(x_pc)) {
      check_refused(from_wire(sample), "frame 'culprit'", bad.field);
    }
    wire::Update update = to_wire(Update{{{"hand", {}}, {"culprit", {}}}});
    update.edges()[1].x_pc(x_pc);
    check_refused(from_wire(update, [](std::string_view) { return true; }), "frame 'culprit'",
                  bad.field);
    CHECK(from_wire(update, [](std::string_view id) { return id == "hand"; }));
    wire::Reply reply =
        to_wire(Reply{1, 2, SegmentValues{{std::vector<Transform>(2)}, std::nullopt, {}, {}}});
    reply.body().transforms()[1] = x_pc;
    // What another has computed may be of any size, and semi-definite to its rounding only.
    const bool only_for_users = std::isfinite(bad.value) && bad.index > 3;
    if (only_for_users) {
      CHECK(from_wire(reply));
    } else {
      check_refused(from_wire(reply), "a reply", bad.field);
    }
  }
}

TEST_CASE("a covariance that is not positive semi-definite as a whole is rejected") {
  // Each pair of the three axes is possible, all together are not.
  Numbers x_pc(28);
  x_pc[3] = 1;
  for (const std::size_t i : {0U, 1U, 2U}) x_pc[7 + upper_index(i, i)] = 1;
  x_pc[7 + upper_index(0, 1)] = 0.9;
  x_pc[7 + upper_index(1, 2)] = 0.9;
  x_pc[7 + upper_index(0, 2)] = -0.9;
  for (const wire::Request& sample : requests_with(x_pc)) {
    check_refused(from_wire(sample), "frame 'culprit'", "not positive semi-definite");
  }
}

// ---- names that are rejected

TEST_CASE("a request with an invalid frame id is rejected") {
  for (const char* id : {"", "a\nb", "\xff"}) {
    check_refused(from_wire(to_wire(Request{1, id, RemoveRequest{}}, "robot")), "id", "");
  }
  check_refused(from_wire(to_wire(Request{1, "a", UpdateRequest{{{"a", {}}, {"\x01", {}}}}}, "r")),
                "id '\\x01'", "control character");
}

TEST_CASE("a page with an invalid name is rejected") {
  const auto read = [](const std::string& partition, const PageEntry& entry) {
    return from_wire(to_wire(Page{partition, 0, 1, 1, {{"world", ""}, entry}}));
  };
  CHECK(read("robot", {"base", "world"}));
  check_refused(read("ro*bot", {"base", "world"}), "partition 'ro*bot'", "'*'");
  check_refused(read("", {"base", "world"}), "partition", "empty");
  check_refused(read("robot", {"", "world"}), "id", "empty");
  check_refused(read("robot", {"b\ta", "world"}), "id 'b\\x09a'", "control character");
  check_refused(read("robot", {"base", "\xc3"}), "parent '\\xc3'", "UTF-8");
}

TEST_CASE("a presence with an invalid name is rejected") {
  check_refused(from_wire(to_wire(Presence{"a,b", 1, "tower", 1, 1, true})), "partition 'a,b'",
                "','");
  check_refused(from_wire(to_wire(Presence{"robot", 1, "", 1, 1, true})), "host", "empty");
  check_refused(from_wire(to_wire(Presence{"robot", 1, "a\033[2J", 1, 1, true})), "host",
                "control character");
}

}  // namespace
}  // namespace tfdude::fastdds
