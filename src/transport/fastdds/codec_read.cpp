#include <cmath>
#include <utility>

#include "tfdude/base/id.hpp"

#include "partition/watching.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/codec_correlation.hpp"
#include "transport/fastdds/codec_frames.hpp"
#include "transport/fastdds/codec_partial.hpp"
#include "transport/fastdds/codec_values.hpp"
#include "transport/fastdds/kinds.hpp"

// Converts requests and streams from the network.
namespace tfdude::fastdds {

Result<std::optional<Time>> stamp_from_wire(std::int64_t stamp, const char* field) {
  if (stamp == kNoStamp) return std::nullopt;
  if (stamp >= 0) return time_of(stamp);
  return fail(Errc::kInvalidInput,
              std::string(field) + " of " + std::to_string(stamp) + " ns is negative");
}

namespace {

Result<std::chrono::nanoseconds> duration_from_wire(std::int64_t duration, const char* field) {
  if (duration >= 0) return std::chrono::nanoseconds(duration);
  return fail(Errc::kInvalidInput,
              std::string(field) + " of " + std::to_string(duration) + " ns is negative");
}

Result<EdgeUpdate> edge_from_wire(std::string_view id, const Numbers& x_pc) {
  if (auto ok = check_id(id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  auto X_PC = read_transform(x_pc, id);
  if (!X_PC) return tl::unexpected(std::move(X_PC.error()));
  return EdgeUpdate{std::string(id), *X_PC};
}

Result<UpdateRequest> update_from_wire(std::string_view first, const wire::UpdateBody& body) {
  UpdateRequest update;
  auto stamp = stamp_from_wire(body.stamp(), "a stamp");
  if (!stamp) return tl::unexpected(std::move(stamp.error()));
  update.stamp = *stamp;
  update.edges.reserve(1 + body.more().size());
  auto edge = edge_from_wire(first, body.x_pc());
  if (!edge) return tl::unexpected(std::move(edge.error()));
  update.edges.push_back(*std::move(edge));
  for (const wire::Edge& more : body.more()) {
    edge = edge_from_wire(text(more.id()), more.x_pc());
    if (!edge) return tl::unexpected(std::move(edge.error()));
    update.edges.push_back(*std::move(edge));
  }
  return update;
}

Result<PartialUpdateRequest> read_partial_update(const wire::PartialUpdate& body) {
  const auto stamp = stamp_from_wire(body.stamp(), "a stamp");
  if (!stamp) return tl::unexpected(stamp.error());
  PartialUpdateRequest update{{}, *stamp};
  for (const wire::PartialEdge& in : body.edges()) {
    auto edge = read_partial(in);
    if (!edge) return tl::unexpected(std::move(edge.error()));
    update.edges.push_back(*std::move(edge));
  }
  if (!update.edges.empty()) return update;
  return fail(Errc::kInvalidInput, "an update without edges");
}

std::vector<PathEnds> read_segments(const std::vector<wire::PathEnds>& body) {
  std::vector<PathEnds> segments;
  segments.reserve(body.size());
  for (const wire::PathEnds& ends : body) {
    segments.push_back({string_of(ends.from()), string_of(ends.to())});
  }
  return segments;
}

Result<LookupRequest> read_lookup(const wire::LookupAt& body) {
  const auto at = stamp_from_wire(body.at(), "the instant of a lookup");
  if (!at) return tl::unexpected(at.error());
  const auto hint = stamp_from_wire(body.hint(), "the hint of a lookup");
  if (!hint) return tl::unexpected(hint.error());
  const auto until = stamp_from_wire(body.age_noise_until(), "the end of a lookup's noise");
  if (!until) return tl::unexpected(until.error());
  const auto extrapolate = duration_from_wire(body.extrapolate(), "an extrapolation");
  if (!extrapolate) return tl::unexpected(extrapolate.error());
  if (body.order() != 2 && body.order() != 4) {
    return fail(Errc::kInvalidInput,
                "the order of a lookup is 2 or 4, not " + std::to_string(body.order()));
  }
  const Query query{*at, *extrapolate, *until, static_cast<Order>(body.order())};
  return LookupRequest{read_segments(body.segments()), query, *hint, body.edges() != 0};
}

Result<WatchRequest> read_watch(const wire::WatchBody& body) {
  const auto period = duration_from_wire(body.period(), "the period of a watch");
  if (!period) return tl::unexpected(period.error());
  WatchRequest watch;
  const auto from = stamp_from_wire(body.from(), "the instant of a watch");
  if (!from) return tl::unexpected(from.error());
  watch.segments = read_segments(body.segments());
  watch.composed = body.composed() != 0;
  watch.period = *period;
  watch.from = *from;
  if (auto ok = check_watch(watch); !ok) return tl::unexpected(ok.error());
  return watch;
}

Result<ReviseRequest> read_revise(const wire::ReviseBody& body) {
  const auto stamp = stamp_from_wire(body.stamp(), "the stamp of an observation");
  if (!stamp) return tl::unexpected(stamp.error());
  ReviseRequest revise{{}, *stamp, body.seen(), body.incarnation()};
  for (const wire::RevisedEdge& in : body.edges()) {
    const NormalizedInnovation innovation{in.squares(), in.expected(), in.variance()};
    ReviseRequest::Edge edge{string_of(in.id()), innovation, in.refused() != 0, {}};
    if (!std::isfinite(innovation.squares + innovation.expected + innovation.variance)) {
      return fail(Errc::kInvalidInput,
                  "frame " + quote(edge.id) +
                      ": its normalized innovation is not a finite number, or too large");
    }
    if (in.revised() != 0) {
      auto X_PC = read_computed(in.x_pc());
      if (!X_PC) return fail_at("frame " + quote(edge.id), X_PC.error());
      auto correlation = read_correlation(in.edge_correlation());
      if (!correlation) return fail_at("frame " + quote(edge.id), correlation.error());
      edge.revision = Revision{edge.id, *X_PC, *std::move(correlation)};
    }
    revise.edges.push_back(std::move(edge));
  }
  if (!revise.edges.empty()) return revise;
  return fail(Errc::kInvalidInput, "an observation without edges");
}

Result<CorrelateRequest> read_correlate(std::string_view id, const wire::Correlation& body) {
  auto correlation = read_correlation(body);
  if (!correlation) return fail_at("frame " + quote(id), correlation.error());
  return CorrelateRequest{*std::move(correlation)};
}

Result<AddRequest> read_add(std::string_view id, const wire::AddBody& body) {
  return read_transform(body.x_pc(), id).map([&](const Transform& X_PC) {
    return AddRequest{string_of(body.parent()), X_PC, body.lamport_time()};
  });
}

Result<MoveRequest> read_move(std::string_view id, const wire::MoveAndUpdate& body) {
  return read_parts(body.parts(), body.x_pc(), id).map([&](PartialTransform X_PC) {
    return MoveRequest{string_of(body.parent()), std::move(X_PC), body.lamport_time()};
  });
}

RemoveRequest read_remove(const wire::RemoveBody& body) {
  RemoveRequest remove;
  for (const wire::Identifier& top : body.tops()) remove.tops.push_back(string_of(top));
  remove.lamport_time = body.lamport_time();
  return remove;
}

Result<JointUpdate> read_joints(const wire::Joints& body) {
  auto joints = tfdude::fastdds::from_wire(body, [](std::string_view) { return true; });
  if (joints && joints->joints.empty())
    return fail(Errc::kInvalidInput, "an update without joints");
  return joints;
}

template <class Body>
Result<void> take(Request& request, Result<Body> body) {
  if (!body) return tl::unexpected(std::move(body.error()));
  request.body = *std::move(body);
  return {};
}

// The ids in a body need no check here: ids without a frame are rejected as unknown, and new ids
// are checked where they are added.
Result<void> read_body(const wire::Request& sample, Request& request) {
  const wire::RequestBody& body = sample.body();
  const auto as = [&request](auto read) {
    request.body = std::move(read);
    return Result<void>();
  };
  switch (body._d()) {
    case kAdd:
      return take(request, read_add(request.id, body.add()));
    case kRemove:
      return as(read_remove(body.remove()));
    case kUpdate:
      return take(request, update_from_wire(request.id, body.update()));
    case kMove:
      return as(MoveRequest{string_of(body.move().parent()), {}, body.move().lamport_time()});
    case kMoveAndUpdate:
      return take(request, read_move(request.id, body.move_and_update()));
    case kLookup:
      return as(LookupRequest{read_segments(body.lookup())});
    case kLookupAt:
      return take(request, read_lookup(body.lookup_at()));
    case kWatch:
      return take(request, read_watch(body.watch()));
    case kHistory:
      return as(HistoryRequest{body.history() != 0});
    case kRevise:
      return take(request, read_revise(body.revise()));
    case kConsistency:
      return as(ConsistencyRequest{body.consistency() != 0});
    case kJoints:
      return take(request, read_joints(body.joint_update()));
    case kJointStates:
      return as(JointsRequest{string_of(body.joint_states())});
    case kPartialUpdate:
      return take(request, read_partial_update(body.partial_update()));
    case kCorrelate:
      return take(request, read_correlate(request.id, body.correlate()));
    case kForget:
      return as(ForgetRequest{string_of(body.forget().partition()), body.forget().incarnation()});
    case kFrames:
      return take(request, read_frames(body.structure()));
    case kDescription:
      return as(DescriptionRequest{body.description()});
    default:
      // Which one it is, is not known either: Fast DDS 3 replaces the number.
      return fail(Errc::kUnsupported,
                  "this kind of request is not known to protocol " + to_string(kProtocolVersion));
  }
}

}  // namespace

Result<Request> from_wire(const wire::Request& sample) {
  Request request;
  request.sequence = sample.sequence_number();
  request.awaits_from = sample.awaits_from();
  request.id = string_of(sample.id());
  if (auto ok = check_id(request.id, "id"); !ok) return tl::unexpected(std::move(ok.error()));
  if (auto ok = read_body(sample, request); !ok) return tl::unexpected(std::move(ok.error()));
  return request;
}

Result<Update> from_wire(const wire::Update& sample,
                         const std::function<bool(std::string_view)>& accept) {
  Update update;
  const auto stamp = stamp_from_wire(sample.stamp(), "the stamp of an update");
  if (!stamp) return tl::unexpected(stamp.error());
  update.stamp = *stamp;
  update.edges.reserve(sample.edges().size());
  for (const wire::Edge& edge : sample.edges()) {
    if (!accept(text(edge.id()))) continue;
    auto read = edge_from_wire(text(edge.id()), edge.x_pc());
    if (!read) return tl::unexpected(std::move(read.error()));
    update.edges.push_back(*std::move(read));
  }
  return update;
}

Result<JointUpdate> from_wire(const wire::Joints& sample,
                              const std::function<bool(std::string_view)>& accept) {
  JointUpdate update;
  const auto stamp = stamp_from_wire(sample.stamp(), "the stamp of an update of joints");
  if (!stamp) return tl::unexpected(stamp.error());
  update.stamp = *stamp;
  for (const wire::JointPosition& joint : sample.positions()) {
    if (!accept(text(joint.id()))) continue;
    if (auto ok = check_id(text(joint.id()), "joint"); !ok) {
      return tl::unexpected(std::move(ok.error()));
    }
    const Numbers& numbers = joint.numbers();
    if (numbers.empty() || numbers.size() > 2) {
      return fail(Errc::kInvalidInput, "joint " + quote(text(joint.id())) + " without a position");
    }
    JointValue value{string_of(joint.id()), numbers[0]};
    if (numbers.size() == 2) value.variance = numbers[1];
    update.joints.push_back(std::move(value));
  }
  return update;
}

}  // namespace tfdude::fastdds
