// One law for all messages: what is sent passes the check of its bytes, nothing shorter does, and
// it arrives as it was. The bytes are those of the generated serializer, which shares no code with
// the descriptions from which writing, reading and the check follow.

#include <cmath>
#include <cstring>
#include <set>
#include <string>
#include <vector>

#include "support/catch.hpp"
#include "support/same_messages.hpp"
#include "support/samples.hpp"

namespace tfdude::fastdds {
namespace {

using testing::Bytes;
using testing::Random;
using testing::serialized;

constexpr int kRounds = 12;

std::string random_name(Random& random) {
  static const std::string letters = "abcdefghijklmnopqrstuvwxyz_/0123456789";
  std::string name(1 + random.index(random.index(8) == 0 ? 255 : 12), 'x');
  for (char& letter : name) letter = letters[random.index(letters.size())];
  return name;
}

// Within the range of those that are counted on (counters.hpp).
std::uint64_t random_count(Random& random) {
  return random.index(4) == 0 ? random.engine()() >> 2U : random.index(1000);
}

std::optional<Time> random_stamp(Random& random) {
  if (random.index(3) == 0) return std::nullopt;
  return time_of(static_cast<std::int64_t>(random.engine()() >> 1U));
}

std::size_t random_length(Random& random) { return random.index(random.index(6) == 0 ? 40 : 4); }

template <class Make>
auto several(Random& random, std::size_t least, Make make) {
  std::vector<decltype(make())> all;
  for (std::size_t left = least + random_length(random); left > 0; --left) all.push_back(make());
  return all;
}

Transform random_transform(Random& random) {
  return random.index(3) == 0 ? testing::unspecified(random) : random.transform();
}

std::vector<CommonError> random_common_errors(Random& random) {
  std::vector<CommonError> all;
  for (std::size_t left = random.index(4); left > 0; --left) {
    const auto columns = static_cast<Eigen::Index>(1 + random.index(kMaxLoadingColumns));
    const Loading loading = Loading::NullaryExpr(6, columns, [&] { return random.normal(); });
    all.push_back(
        {std::to_string(left) + random_name(random).substr(0, 200), random.index(2) == 0, loading});
  }
  return all;
}

Correlation random_correlation(Random& random) {
  return {random.index(2) == 0, random_common_errors(random),
          several(random, 0, [&] { return random_name(random); })};
}

PathCorrelation random_path_correlation(Random& random) {
  PathCorrelation one{{}, random_common_errors(random), {}};
  if (random.index(2) == 0) one.unknown = random.covariance();
  return one;
}

PartialTransform random_parts(Random& random) {
  const Transform X = random_transform(random);
  PartialTransform parts;
  if (random.index(2) == 0) parts.translation = X.pose.translation();
  if (random.index(2) == 0) parts.rotation = X.pose.rotation();
  if (random.index(2) == 0) parts.covariance = X.covariance;
  return parts;
}

std::vector<EdgeUpdate> random_edges(Random& random, std::size_t least) {
  return several(random, least, [&] {
    return EdgeUpdate{random_name(random), random_transform(random)};
  });
}

std::vector<PathEnds> random_segments(Random& random, std::size_t least) {
  return several(random, least, [&] { return PathEnds{random_name(random), random_name(random)}; });
}

std::vector<JointValue> random_joints(Random& random, std::size_t least) {
  return several(random, least, [&] {
    JointValue joint{random_name(random), random.normal()};
    if (random.index(2) == 0) joint.variance = random.uniform(0, 1);
    return joint;
  });
}

ReviseRequest random_revision(Random& random) {
  return {
      several(random, 1,
              [&] {
                ReviseRequest::Edge edge{random_name(random), {1, random.normal(), 3}, false, {}};
                edge.refused = random.index(2) == 0;
                if (random.index(2) == 0) {
                  edge.revision =
                      Revision{edge.id, random_transform(random), random_correlation(random), {}};
                  if (random.index(2) == 0) edge.revision->stamp = random_stamp(random);
                }
                return edge;
              }),
      random_stamp(random), random_count(random), random_count(random)};
}

HandedPart random_handed(Random& random) {
  HandedPart part = testing::handed_part(random);
  part.first = static_cast<std::uint32_t>(random_count(random));
  part.is_last = random.index(2) == 0;
  for (HandedEdge& edge : part.edges) {
    edge.id = random_name(random);
    edge.said = random_correlation(random);
    edge.X_PC = random_transform(random);
    edge.samples.resize(random.index(edge.samples.size() + 1));
    for (HandedSample& sample : edge.samples) {
      sample.is_row = random.index(2) == 0;
      if (random.index(2) == 0) sample.X_PC = random_transform(random);
    }
  }
  return part;
}

std::vector<Request> random_requests(Random& random) {
  const std::string first = random_name(random);
  auto edges = random_edges(random, 1);
  edges.front().id = first;
  const auto named = [&] { return random_name(random); };
  Query query{random_stamp(random), std::chrono::nanoseconds(random.index(1000)),
              random_stamp(random), random.index(2) == 0 ? Order::kSecond : Order::kFourth};
  query.believed_at = random_stamp(random);
  std::vector<Request> all;
  const auto add = [&](auto body) {
    all.push_back({static_cast<std::uint32_t>(random_count(random)), first, std::move(body),
                   random_count(random)});
  };
  add(AddRequest{named(), random_transform(random), random_count(random)});
  add(RemoveRequest{several(random, 0, named), random_count(random)});
  add(UpdateRequest{std::move(edges), random_stamp(random)});
  add(PartialUpdateRequest{several(random, 1,
                                   [&] {
                                     return PartialUpdate{named(), random_parts(random)};
                                   }),
                           random_stamp(random)});
  add(MoveRequest{named(), random_parts(random), random_count(random)});
  const std::size_t asked = random.index(5);
  add(LookupRequest{random_segments(random, 0), query, random_stamp(random), asked > 0,
                    asked == 3   ? Rows::kOfPath
                    : asked == 4 ? Rows::kAll
                                 : Rows::kNone,
                    asked == 2});
  const std::size_t watched = random.index(3);
  add(WatchRequest{random_segments(random, 1), watched == 1, watched == 2,
                   std::chrono::nanoseconds(random.index(1000)), random_stamp(random)});
  add(HistoryRequest{random.index(2) == 0});
  add(random_revision(random));
  add(ConsistencyRequest{random.index(2) == 0});
  add(JointUpdate{random_joints(random, 1), random_stamp(random)});
  add(JointsRequest{named()});
  add(CorrelateRequest{random_correlation(random)});
  add(ForgetRequest{named(), random_count(random)});
  add(FramesRequest{several(random, 0, named), several(random, 0, named), several(random, 0, [&] {
                      return SeenEpoch{random_name(random), random_count(random)};
                    })});
  add(DescriptionRequest{random_count(random)});
  add(MemoryRequest{});
  add(TimeRequest{random_stamp(random)});
  add(HandOverRequest{static_cast<HandOverRequest::Step>(1 + random.index(4)), "robot",
                      static_cast<std::uint32_t>(random_count(random)), random_stamp(random)});
  add(AdoptRequest{"robot", random.index(2) == 0 ? std::nullopt : std::optional(named()),
                   random_parts(random), random_handed(random), random_count(random)});
  add(RewriteRequest{
      random_count(random),
      {random_stamp(random).value_or(Time()), random_stamp(random).value_or(Time())},
      static_cast<std::uint32_t>(random_count(random)),
      static_cast<std::uint32_t>(random_count(random)),
      several(random, 1, [&] {
        return EdgeSample{random_stamp(random).value_or(Time()), random_transform(random)};
      })});
  return all;
}

ValuesAtInstant random_values(Random& random, std::size_t count) {
  ValuesAtInstant at;
  const bool correlated = random.index(2) == 0;
  const bool incomplete = random.index(2) == 0;
  for (std::size_t i = 0; i < count; ++i) {
    at.values.push_back(random.transform());
    if (correlated) at.correlations.push_back(random_path_correlation(random));
    if (!incomplete || random.index(2) == 0) continue;
    at.values.back().covariance.set_complete(false);
    for (std::size_t left = 1 + random.index(3); left > 0; --left) {
      at.unspecified.push_back({i, random_name(random)});
    }
  }
  return at;
}

PushedValues random_pushed(Random& random) {
  PushedValues pushed{random_count(random),
                      {},
                      random_count(random),
                      random_count(random),
                      static_cast<std::uint32_t>(random_count(random)),
                      7};
  for (std::size_t left = random_length(random); left > 0; --left) {
    PushedValue entry{static_cast<std::uint32_t>(random_count(random)), random_stamp(random),
                      random_transform(random)};
    entry.history = random_count(random);
    if (random.index(3) == 0) entry.correlation = random_correlation(random);
    if (random.index(3) == 0) entry.process_noise = random.covariance();
    entry.covariance_number = static_cast<std::uint32_t>(random.index(3));
    entry.covariance_known = entry.covariance_number != 0 && !entry.X.covariance.complete();
    entry.made_up = entry.stamp && *entry.stamp < time_of(INT64_MAX - 2) && random.index(3) == 0;
    entry.cleared = !entry.stamp && random.index(3) == 0;
    entry.unsampled = !entry.stamp && !entry.cleared && random.index(2) == 0;
    if (entry.unsampled && !entry.process_noise) entry.process_noise = Covariance();
    pushed.entries.push_back(std::move(entry));
  }
  return pushed;
}

std::vector<Reply> random_replies(Random& random) {
  std::vector<Reply> all;
  const auto add = [&](auto body) {
    all.push_back({static_cast<std::uint32_t>(random_count(random)), random_count(random),
                   std::move(body), random_count(random)});
  };
  const auto count = [&] { return random_count(random); };
  add(Done{});
  add(Error{static_cast<Errc>(1 + random.index(8)), random_name(random)});
  SegmentValues found;
  const std::size_t segments = random_length(random);
  static_cast<ValuesAtInstant&>(found) = random_values(random, segments);
  found.stamp = random_stamp(random);
  if (random.index(2) == 0) found.at_hint = random_values(random, segments);
  if (found.stamp) found.period = std::chrono::nanoseconds(random.index(1000));
  for (std::size_t left = random.index(3); left > 0; --left) {
    found.rows.push_back({static_cast<std::uint32_t>(random_count(random)),
                          random_stamp(random).value_or(Time()), random.transform(),
                          random_path_correlation(random)});
  }
  add(found);
  add(random_pushed(random));
  add(several(random, 0, [&] {
    HistoryInfo info = testing::history_info(random_name(random));
    info.oldest = random_stamp(random);
    info.samples = count();
    return info;
  }));
  add(several(random, 0, [&] {
    return EdgeConsistency{random_name(random), count(), count(), {random.normal(), 2, 3}};
  }));
  add(testing::joint_infos());
  add(several(random, 0, [&] {
    return KnownFrame{random_name(random), random.index(3) == 0 ? "" : random_name(random),
                      "robot"};
  }));
  add(DescriptionPart{count(), count(), random_name(random)});
  add(MemoryOffer{random_name(random),
                  random_name(random),
                  {count(), count()},
                  count(),
                  count(),
                  random_name(random)});
  add(random_handed(random));
  return all;
}

Page random_page(Random& random) {
  const auto count = [&] { return random_count(random); };
  const auto name = [&] { return random_name(random); };
  const auto perhaps = [&] { return random.index(2) == 0 ? std::string() : random_name(random); };
  Page page{name(), static_cast<std::uint32_t>(count()), 1 + random.index(9), count(), {}};
  page.entries = several(random, 0, [&] { return PageEntry{name(), perhaps(), count()}; });
  page.tombstones = several(random, 0, [&] {
    return Tombstone{name(), count(), static_cast<Tombstone::Kind>(1 + random.index(4)), perhaps()};
  });
  page.others = several(random, 0, [&] { return PageEpoch{7, count()}; });
  page.joints = several(random, 0, [&] { return PageJoint{name(), perhaps()}; });
  return page;
}

Presence random_presence(Random& random) {
  const auto flag = [&] { return random.index(2) == 0; };
  Presence presence{random_name(random), 1 + random_count(random) / 2, random_name(random), 7, 8};
  presence.serving = flag();
  presence.absent = several(random, 0, [&] {
    return Absent{random_name(random), static_cast<std::int64_t>(random_count(random)),
                  static_cast<Absent::Kind>(1 + random.index(5)), random_count(random)};
  });
  presence.taken = flag();
  presence.stopped = flag();
  presence.ticket = random_count(random);
  presence.protocol = {static_cast<std::uint16_t>(random.index(65536)), 3};
  presence.program = random_name(random);
  presence.clock = random_stamp(random);
  return presence;
}

double number_at(const Bytes& bytes, std::size_t place) {
  double number = 0;
  std::memcpy(&number, bytes.data() + place, sizeof number);
  return number;
}

// Whether the bytes are the same, but for the last digit of quaternions, which are normalized again
// on arrival.
bool same(const Bytes& a, const Bytes& b) {
  constexpr std::size_t kHead = 4;
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i] == b[i]) continue;
    const std::size_t place = i - (i - kHead) % sizeof(double);
    if (place + sizeof(double) > a.size()) return false;
    const double number = number_at(a, place);
    const bool digit = std::abs(number) > 1e-9 && std::abs(number - number_at(b, place)) < 5e-16;
    if (!digit) return false;
  }
  return true;
}

// Whether there is an example of each kind.
template <class Message>
bool has_all_kinds(const std::vector<Message>& examples) {
  std::set<std::size_t> kinds;
  for (const Message& one : examples) kinds.insert(one.body.index());
  return kinds.size() == std::variant_size_v<decltype(Message::body)>;
}

template <class Type, class Sample, class Decode, class Encode>
void check_law(const Sample& sent, bool (*check)(const std::uint8_t*, std::size_t), Decode decode,
               Encode encode) {
  const Bytes bytes = serialized<Type>(sent);
  REQUIRE(check(bytes.data(), bytes.size()));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    if (check(bytes.data(), size)) FAIL("cut to " << size << " of " << bytes.size());
  }
  Sample arrived;
  REQUIRE(testing::deserialized<Type>(bytes, arrived));
  const auto message = decode(arrived);
  REQUIRE(message);
  CHECK(same(serialized<Type>(Sample(encode(*message))), bytes));
}

TEST_CASE("random messages of every kind pass their check, cut ones do not, and all arrive") {
  Random random(0x1a3);
  INFO("seed " << random.seed());
  const auto decode = [](const auto& sample) { return from_wire(sample); };
  const auto decode_all = [](const auto& sample) {
    return from_wire(sample, [](std::string_view) { return true; });
  };
  const auto encode = [](const auto& message) { return to_wire(message); };
  wire::Request request;  // used again and again, as is the reply: nothing of before may be left
  wire::Reply reply;
  for (int round = 0; round < kRounds; ++round) {
    const auto requests = random_requests(random);
    REQUIRE(has_all_kinds(requests));
    for (const Request& one : requests) {
      INFO("request " << one.body.index() << " of round " << round);
      write_wire(one, "robot", request);
      CHECK(serialized<RequestType>(request) == serialized<RequestType>(to_wire(one, "robot")));
      check_law<RequestType>(request, well_formed_request, decode,
                             [](const Request& message) { return to_wire(message, "robot"); });
      testing::check_same(from_wire(request).value(), one);
    }
    const auto replies = random_replies(random);
    REQUIRE(has_all_kinds(replies));
    for (const Reply& one : replies) {
      INFO("reply " << one.body.index() << " of round " << round);
      write_wire(one, reply);
      CHECK(serialized<ReplyType>(reply) == serialized<ReplyType>(to_wire(one)));
      check_law<ReplyType>(reply, well_formed_reply, decode, encode);
    }
    check_law<UpdateType>(to_wire(Update{random_edges(random, 0), random_stamp(random)}),
                          well_formed_update, decode_all, encode);
    check_law<JointsType>(to_wire(JointUpdate{random_joints(random, 0), random_stamp(random)}),
                          well_formed_joints, decode_all, encode);
    const PushedValues pushed = random_pushed(random);
    check_law<StateType>(to_wire(pushed), well_formed_state, decode, encode);
    testing::check_same(from_wire(to_wire(pushed)).value(), pushed);
    check_law<PageType>(to_wire(random_page(random)), well_formed_page, decode, encode);
    check_law<PresenceType>(to_wire(random_presence(random)), well_formed_presence, decode, encode);
  }
}

}  // namespace
}  // namespace tfdude::fastdds
