#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "partition/counters.hpp"
#include "support/cdr.hpp"
#include "support/random.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/topics.hpp"

// DDS samples as bytes.
namespace tfdude::testing {

/// The bytes that a writer of this type sends.
template <class Type, class Sample>
[[nodiscard]] Bytes serialized(Sample sample) {
  thread_local Type type;  // computes its greatest size when it is created, which takes longer
#if TFDUDE_FASTDDS_MAJOR == 2
  fastdds::ertps::SerializedPayload_t payload(type.getSerializedSizeProvider(&sample)());
  if (!type.serialize(&sample, &payload)) return {};
#else
  constexpr auto kFormat = fastdds::edds::DataRepresentationId::XCDR_DATA_REPRESENTATION;
  fastdds::ertps::SerializedPayload_t payload(type.calculate_serialized_size(&sample, kFormat));
  if (!type.serialize(&sample, payload, kFormat)) return {};
#endif
  return {payload.data, payload.data + payload.length};
}

/// A payload with bytes that it does not own.
struct BorrowedPayload : fastdds::ertps::SerializedPayload_t {
  BorrowedPayload(std::uint8_t* bytes, std::size_t size) {
    data = bytes;
    length = static_cast<std::uint32_t>(size);
    max_size = length;
  }
  BorrowedPayload(const BorrowedPayload&) = delete;
  BorrowedPayload& operator=(const BorrowedPayload&) = delete;
  ~BorrowedPayload() { data = nullptr; }  // not the payload's to free
};

/// Deserializes the bytes as a reader of this type does; false if it rejects them. They are copied
/// into a buffer of exactly their size, so that AddressSanitizer sees every access beyond it.
template <class Type, class Sample>
[[nodiscard]] bool deserialized(const Bytes& bytes, Sample& sample) {
  const auto exact = std::make_unique<std::uint8_t[]>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), exact.get());
  BorrowedPayload payload(exact.get(), bytes.size());
  thread_local Type type;  // as above
#if TFDUDE_FASTDDS_MAJOR == 2
  return type.deserialize(&payload, &sample);
#else
  return type.deserialize(payload, &sample);
#endif
}

/// One message of each kind, and the functions of its topic.
struct WireKind {
  std::string name;
  Bytes valid;
  bool (*well_formed)(const std::uint8_t* data, std::size_t size);
  bool (*take)(
      const Bytes& bytes);  ///< reads as a participant does, up to the message; false: rejected
};

template <class Type, class Sample>
bool take(const Bytes& bytes) {
  Sample sample;
  if (!deserialized<Type>(bytes, sample)) return false;
  if constexpr (std::is_same_v<Sample, wire::Update> || std::is_same_v<Sample, wire::Joints>) {
    (void)fastdds::from_wire(sample, [](std::string_view) { return true; });
  } else {
    (void)fastdds::from_wire(sample);
  }
  return true;
}

[[nodiscard]] inline Correlation correlation(Random& random) {
  const auto loading = [&](Eigen::Index columns) -> Loading {
    return Loading::NullaryExpr(6, columns, [&](auto, auto) { return random.normal(); });
  };
  return {
      true,
      {{"calibration", false, loading(1)}, {"observed:1.2.3", true, loading(kMaxLoadingColumns)}},
      {"hand", std::string(255, 'o')}};
}

[[nodiscard]] inline PartialUpdateRequest partial_updates(Random& random) {
  const Transform X = random.transform();
  return {{{"hand", {X.pose.translation()}},
           {"arm", {{}, X.pose.rotation()}},
           {"x", {{}, {}, X.covariance}},
           {std::string(255, 'i'), {X.pose.translation(), X.pose.rotation(), X.covariance}}},
          time_of(INT64_MAX)};
}

[[nodiscard]] inline Transform unspecified(Random& random) {
  return {random.pose(), StatedCovariance::unspecified()};
}

// The second sample has the covariance of the first.
[[nodiscard]] inline RewriteRequest rewritten(Random& random) {
  RewriteRequest part{18446744073709551615ULL, {time_of(1), time_of(INT64_MAX)}, 60'000, 256, {}};
  for (const std::int64_t stamp : {2, 3, 4, 5}) {
    part.samples.push_back({time_of(stamp), random.transform()});
  }
  part.samples[1].X_PC.covariance = part.samples[0].X_PC.covariance;
  part.samples[3].X_PC = unspecified(random);
  return part;
}

// A static edge without anything, and a dynamic one with samples of each kind.
[[nodiscard]] inline HandedPart handed_part(Random& random) {
  HandedPart part{kLastIncarnation, 4095, true, true, {}};
  HandedEdge fixed;
  fixed.id = "tool";
  fixed.parent = "hand";
  fixed.lamport_time = 7;
  fixed.X_PC = unspecified(random);
  part.edges.push_back(fixed);
  HandedEdge edge;
  edge.id = std::string(255, 'i');
  edge.lamport_time = kLastCounter;
  edge.state = HandedState::kSampled;
  edge.left_behind = true;
  edge.timing = EdgeTiming{std::chrono::nanoseconds(1),
                           2,
                           random.covariance(),
                           true,
                           true,
                           std::chrono::nanoseconds::max(),
                           18446744073709551615ULL};
  edge.X_PC = random.transform();
  edge.said = correlation(random);
  edge.now = correlation(random);
  edge.continues = true;
  for (const std::int64_t stamp : {2, 3, 4, 5}) {
    edge.samples.push_back({time_of(stamp), random.transform()});
  }
  edge.samples[1].X_PC.covariance = edge.samples[0].X_PC.covariance;
  edge.samples[2].X_PC = unspecified(random);
  edge.samples[2].made_up = true;
  edge.samples[3].is_row = true;
  edge.samples[3].revision =
      SampleRevision{random.transform(), correlation(random), {true, true, 255, Told::kNot, 3, 2}};
  part.edges.push_back(edge);
  fixed.id = "cleared";
  fixed.state = HandedState::kCleared;
  fixed.timing.emplace();
  fixed.now.emplace();
  part.edges.push_back(fixed);
  return part;
}

[[nodiscard]] inline std::vector<Request> requests(Random& random) {
  const auto edge = [&](const std::string& id) { return EdgeUpdate{id, random.transform()}; };
  Query believed;
  believed.at = time_of(7);
  believed.believed_at = time_of(1'700'000'000'000'000'000);
  return {
      {1, "hand", AddRequest{"arm", random.transform(), 4102444800000000001U}},
      {2, "hand", AddRequest{"", random.transform()}},
      {3, "hand", RemoveRequest{{"hand", "arm_1", "\xc3\xa4rmel"}, 1U << 20U}},
      {4, "hand", UpdateRequest{{edge("hand")}}},
      {5, "hand", UpdateRequest{{edge("hand"), edge("arm"), edge("x")}}},
      {6, "hand", MoveRequest{"arm", {}, 7}},
      {23, "hand", MoveRequest{"arm", {std::nullopt, random.transform().pose.rotation(), {}}, 8}},
      {7, "hand", MoveRequest{"", random.transform(), kLastCounter}},
      {8, "hand", LookupRequest{{{"hand", "arm"}, {"camera", "world"}}}},
      {9, "hand", UpdateRequest{{edge("hand"), edge("arm")}, time_of(1)}},
      {10, "hand",
       LookupRequest{{{"hand", "arm"}},
                     {time_of(1'700'000'000'000'000'000), std::chrono::nanoseconds(7), time_of(9)},
                     time_of(8)}},
      {11, "hand", LookupRequest{{}, {}, time_of(INT64_MAX)}},
      {12, "hand", WatchRequest{{{"arm", "hand"}, {"base", "arm"}}, false, false, kMaxWatchPeriod}},
      {13, "hand",
       WatchRequest{{{"hand", "arm"}}, true, false, std::chrono::nanoseconds(1), time_of(5)}},
      {14, "hand", HistoryRequest{}},
      {15, "hand", LookupRequest{{{"arm", "hand"}}, {{}, {}, {}, Order::kFourth}, {}, true}},
      {16, "hand",
       ReviseRequest{{{"hand", {1.5, 2.5, 3.5}, true, {}},
                      {"arm",
                       {4.5, 5.5, 6.5},
                       false,
                       Revision{"arm", random.transform(), correlation(random)}}},
                     time_of(17),
                     18446744073709551615ULL,
                     kLastIncarnation}},
      {44, "hand",
       ReviseRequest{
           {{"base", {1.5, 2.5, 3.5}, false, Revision{"base", random.transform(), {}, {}}},
            {"base",
             {},
             false,
             Revision{"base", random.transform(), correlation(random), time_of(9)}}},
           time_of(17),
           1,
           2}},
      {45, "hand", LookupRequest{{{"arm", "hand"}}, {}, {}, true, Rows::kOfPath}},
      {46, "hand", LookupRequest{{{"arm", "hand"}}, {}, {}, true, Rows::kAll}},
      {60, "hand", LookupRequest{{{"arm", "hand"}}, believed, time_of(8)}},
      {17, "hand", ConsistencyRequest{true}},
      {18, "arm", JointUpdate{{{"elbow", 0.5, 1e-4}, {"wrist", -2.0, 0}}, time_of(18)}},
      {19, "arm", JointsRequest{}},
      {20, "arm", JointsRequest{"elbow"}},
      {21, "arm", partial_updates(random)},
      {22, "arm", CorrelateRequest{correlation(random)}},
      {30, "base", ForgetRequest{"arm", kLastIncarnation}},
      {31, "base", FramesRequest{{"hand", std::string(255, 'i')}}},
      {32, "base", FramesRequest{{}, {"arm", "left_*"}, {{"arms", kLastCounter}, {"legs", 1}}}},
      {33, "arm", DescriptionRequest{18446744073709551615ULL}},
      {34, "arm", MemoryRequest{}},
      {35, "arm", TimeRequest{time_of(5)}},
      {40, "hand", AddRequest{"arm", unspecified(random), 1}},
      {41, "hand",
       UpdateRequest{{{"hand", unspecified(random)}, {"arm", unspecified(random)}}, time_of(1)}},
      {42, "hand", MoveRequest{"arm", unspecified(random), 1}},
      {43, "hand",
       PartialUpdateRequest{{{"hand", {{}, {}, StatedCovariance::unspecified()}}}, time_of(1)}},
      {36, "odom", rewritten(random)},
      {47, "hand", HandOverRequest{HandOverRequest::Step::kBegin, "arms"}},
      {48, "hand",
       HandOverRequest{HandOverRequest::Step::kRead, std::string(255, 'p'), 4294967295U,
                       time_of(INT64_MAX)}},
      {49, "hand", HandOverRequest{HandOverRequest::Step::kCancel, "arms"}},
      {50, "hand", AdoptRequest{"arms", {}, {}, handed_part(random), kLastCounter}},
      {51, "hand", AdoptRequest{"arms", "", unspecified(random), {}, 1}},
      {52, "hand", AdoptRequest{"arms", std::string(255, 'p'), random.transform(), {}, 1}},
      {4294967295U, std::string(255, 'h'), MoveRequest{std::string(255, 'p'), {}},
       18446744073709551610ULL}};
}

[[nodiscard]] inline SegmentValues correlated_values(Random& random) {
  SegmentValues found;
  found.values = {random.transform(), random.transform()};
  found.stamp = time_of(5);
  found.period = std::chrono::nanoseconds(6);
  found.at_hint.values = {random.transform(), random.transform()};
  const Correlation some = correlation(random);
  found.correlations = {{}, {random.covariance(), some.common_errors, some.observed_with}};
  found.at_hint.correlations = {{random.covariance(), {}, {}}, {}};
  found.commit = 77;
  found.incarnation = 78;
  return found;
}

[[nodiscard]] inline SegmentValues incomplete_values(Random& random, bool correlated) {
  SegmentValues found;
  if (correlated) {
    found = correlated_values(random);
  } else {
    found.values = {random.transform(), random.transform()};
    found.at_hint.values = {random.transform(), random.transform()};
  }
  found.unspecified = {{1, "hand"}, {1, std::string(255, 'u')}};
  found.values[1].covariance.set_complete(false);
  found.at_hint.unspecified = {{0, "arm"}, {1, "hand"}};
  for (Transform& X : found.at_hint.values) X.covariance.set_complete(false);
  return found;
}

[[nodiscard]] inline SegmentValues values_with_rows(Random& random) {
  SegmentValues found = correlated_values(random);
  const Correlation some = correlation(random);
  found.rows = {{1, time_of(4), random.transform(), {{}, some.common_errors, {"hand"}}},
                {1, time_of(3), random.transform(), {}}};
  return found;
}

[[nodiscard]] inline HistoryInfo history_info(const std::string& id) {
  HistoryInfo history;
  history.id = id;
  history.samples = 2048;
  history.bytes = 700'000;
  history.span_limit = std::chrono::seconds(10);
  history.count_limit = 4096;
  history.oldest = time_of(1);
  history.newest = time_of(1'700'000'000'000'000'000);
  history.mean_gap = std::chrono::nanoseconds(3);
  history.max_gap = std::chrono::nanoseconds(4);
  history.jitter = std::chrono::nanoseconds(5);
  history.refused_old = 6;
  history.refused_equal = 7;
  history.refused_ahead = 8;
  return history;
}

[[nodiscard]] inline std::vector<JointInfo> joint_infos() {
  JointInfo elbow{"elbow", "forearm", JointType::kPrismatic, JointLimits{-0.25, 1.5},
                  Mimic{"knee", -2.0, 0.125}};
  elbow.position = 0.75;
  elbow.variance = 1e-4;
  elbow.measured = true;
  elbow.outside = 7;
  elbow.refused = 18446744073709551615ULL;
  JointInfo wheel{"wheel", "wheel_link", JointType::kContinuous, {}, {}};
  return {elbow, wheel};
}

[[nodiscard]] inline std::vector<JointUpdate> joint_updates() {
  return {{},
          {{{"elbow", 0.5, 1e-4}}},
          {{{"a", 0.0, 0.0}, {"ab", -1.0, 2.0}, {std::string(255, 'j'), 3.0, 4.0}},
           time_of(1'700'000'000'000'000'000)}};
}

[[nodiscard]] inline std::vector<Reply> replies(Random& random) {
  return {
      {1, 10, Done{}, 1ULL << 62U},
      {2, kLastCounter, Error{Errc::kCycle, "no, \xc3\xa4 \x07 \xff"}},
      {3, 0, Error{Errc::kTransport, ""}},
      {4, 31, values_with_rows(random)},
      {4, 30, SegmentValues{}},
      {5, 40,
       SegmentValues{{{random.transform(), Transform::exact({}), random.transform()}}, {}, {}, {}}},
      {6, 40,
       SegmentValues{{{random.transform()}},
                     time_of(1'700'000'000'000'000'001),
                     std::chrono::nanoseconds(5),
                     {{random.transform()}}}},
      {7, 1, PushedValues{1, {}}},
      {8, 1,
       PushedValues{
           18446744073709551615ULL,
           {{0, std::nullopt, random.transform()}, {7, time_of(5), Transform::exact({})}}}},
      {9, 1, std::vector<HistoryInfo>{}},
      {11, 1, correlated_values(random)},
      {12, 1, std::vector<EdgeConsistency>{{"hand", 7, 3, {1.5, 2.5, 3.5}}, {}}},
      {13, 1, joint_infos()},
      {14, 1,
       std::vector<KnownFrame>{{"world", "", "base"}, {"hand", "world", std::string(255, 'p')}}},
      {10, 1, std::vector<HistoryInfo>{history_info("hand"), HistoryInfo{}}},
      {15, 1, incomplete_values(random, false)},
      {16, 1, incomplete_values(random, true)},
      {17, 1, DescriptionPart{18446744073709551615ULL, 1, std::string(kMaxDescriptionPart, '<')}},
      {18, 1, DescriptionPart{7, 8, "<robot/>"}},
      {19, 1, MemoryOffer{"kernel", "socket", {18446744073709551615ULL, 2}, 3, 4, ""}},
      {20, 1, MemoryOffer{"", "", {}, 0, 0, "there is no memfd"}},
      {21, 1, handed_part(random)},
      {22, 1, HandedPart{}}};
}

[[nodiscard]] inline std::vector<PushedValues> pushed_values(Random& random) {
  return {
      {},
      {1, {{4294967295U, time_of(INT64_MAX), random.transform()}}},
      {3, {{1, {}, random.transform(), correlation(random)}, {2, {}, random.transform()}}},
      {2, {{0, std::nullopt, Transform::exact({})}, {1, time_of(1), random.transform()}}},
      {4,
       {{0, {}, random.transform(), {}, 18446744073709551615ULL, Covariance()},
        {1, time_of(7), Transform::exact({}), {}, 3, random.transform().covariance.of_specified()},
        {1, time_of(8), Transform::exact({}), {}, 3, {}, false, 4294967295U},
        {1, time_of(9), Transform{}, {}, 3, {}, false, 4294967295U, true}},
       5,
       18446744073709551615ULL,
       1,
       4294967295U},
      {5, {{0, time_of(7), unspecified(random)}, {1, {}, unspecified(random)}}},
      {6, {{0, {}, random.transform(), {}, 9, Covariance(), false, 0, false, true}}}};
}

[[nodiscard]] inline std::vector<Update> updates(Random& random) {
  return {{},
          {{{"hand", random.transform()}}},
          {{{"a", random.transform()}, {"ab", Transform::exact({})}, {"abc", random.transform()}}},
          {{{"hand", random.transform()}}, time_of(1'700'000'000'000'000'000)}};
}

[[nodiscard]] inline std::vector<Page> pages() {
  return {{"robot", 0, 1, 2, {}},
          {"robot", 7, kLastIncarnation, 3, {{"world", ""}, {"base", "world"}}},
          {std::string(255, 'r'), 4294967295U, 1, 0, {{std::string(255, 'i'), "p"}}},
          {"robot",
           1,
           1,
           9,
           {{"base", "", kLastCounter}},
           {{"hand", 5, Tombstone::Kind::kRemoved, ""},
            {"base", 6, Tombstone::Kind::kUnhung, "arms"},
            {"eye", 7, Tombstone::Kind::kDropped, ""}},
           {{0, 8}, {4294967295U, kLastCounter}},
           {{"turn", ""}, {std::string(255, 'j'), "turn"}}}};
}

[[nodiscard]] inline std::vector<Presence> presences() {
  return {{"robot", 1, "tower", 4711, 3, true},
          {"r",
           kLastIncarnation,
           std::string(255, 'h'),
           4294967295U,
           4294967295U,
           false,
           {{"arms", -9223372036854775807, Absent::Kind::kForgotten, kLastIncarnation},
            {std::string(255, 'a'), 7, Absent::Kind::kSilent, 1}},
           true,
           true,
           18446744073709551614ULL,
           {65535, 65534},
           "1.2.3-rc",
           time_of(0)}};
}

[[nodiscard]] inline std::vector<WireKind> wire_kinds(Random& random) {
  using namespace fastdds;  // NOLINT(google-build-using-namespace): all of it is used, here only
  std::vector<WireKind> kinds;
  for (const Request& one : requests(random)) {
    kinds.push_back({"request " + std::to_string(one.sequence),
                     serialized<RequestType>(to_wire(one, "robot")), well_formed_request,
                     take<RequestType, wire::Request>});
  }
  for (const Reply& one : replies(random)) {
    kinds.push_back({"reply " + std::to_string(one.sequence), serialized<ReplyType>(to_wire(one)),
                     well_formed_reply, take<ReplyType, wire::Reply>});
  }
  for (const Update& one : updates(random)) {
    kinds.push_back({"update of " + std::to_string(one.edges.size()),
                     serialized<UpdateType>(to_wire(one)), well_formed_update,
                     take<UpdateType, wire::Update>});
  }
  for (const JointUpdate& one : joint_updates()) {
    kinds.push_back({"joint update of " + std::to_string(one.joints.size()),
                     serialized<JointsType>(to_wire(one)), well_formed_joints,
                     take<JointsType, wire::Joints>});
  }
  for (const PushedValues& one : pushed_values(random)) {
    kinds.push_back({"state of " + std::to_string(one.entries.size()),
                     serialized<StateType>(to_wire(one)), well_formed_state,
                     take<StateType, wire::State>});
  }
  kinds.push_back({"clock", serialized<ClockType>(to_wire(time_of(INT64_MAX))), well_formed_clock,
                   take<ClockType, wire::Clock>});
  for (const Page& one : pages()) {
    kinds.push_back({"page " + std::to_string(one.number), serialized<PageType>(to_wire(one)),
                     well_formed_page, take<PageType, wire::Page>});
  }
  for (const Presence& one : presences()) {
    kinds.push_back({"presence " + std::to_string(one.pid), serialized<PresenceType>(to_wire(one)),
                     well_formed_presence, take<PresenceType, wire::Presence>});
  }
  return kinds;
}

}  // namespace tfdude::testing
