#include <algorithm>
#include <utility>

#include "transport/fastdds/cdr_check.hpp"
#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/codec_frames.hpp"
#include "transport/fastdds/codec_partial.hpp"
#include "transport/fastdds/codec_values.hpp"
#include "transport/fastdds/kinds.hpp"

// Converts messages for the network.
namespace tfdude::fastdds {
namespace {

constexpr std::size_t kMaxMessage = 4096;

wire::Edge wire_edge(const EdgeUpdate& edge) {
  wire::Edge out;
  out.id(edge.id);
  write_transform(edge.X_PC, out.x_pc());
  return out;
}

std::vector<wire::PathEnds> wire_segments(const std::vector<PathEnds>& segments) {
  std::vector<wire::PathEnds> body(segments.size());
  for (std::size_t i = 0; i < body.size(); ++i) {
    body[i].from(segments[i].from);
    body[i].to(segments[i].to);
  }
  return body;
}

std::vector<wire::CommonError> wire_common_errors(const std::vector<CommonError>& common_errors) {
  std::vector<wire::CommonError> body(common_errors.size());
  for (std::size_t i = 0; i < body.size(); ++i) {
    const Loading& loading = common_errors[i].loading;
    body[i].subtracts(common_errors[i].subtracts ? 1 : 0);
    body[i].loading().assign(loading.data(), loading.data() + loading.size());
    body[i].source(common_errors[i].source);
  }
  return body;
}

wire::Correlation wire_correlation(const PathCorrelation& correlation) {
  wire::Correlation body;
  if (correlation.unknown) {
    const Covariance::Upper& upper = correlation.unknown->upper();
    body.unknown_part().assign(upper.begin(), upper.end());
  }
  body.common_errors(wire_common_errors(correlation.common_errors));
  for (const std::string& id : correlation.observed_with) body.observed_with().emplace_back(id);
  return body;
}

wire::Correlation wire_correlation(const Correlation& correlation) {
  wire::Correlation body = wire_correlation(
      PathCorrelation{std::nullopt, correlation.common_errors, correlation.observed_with});
  body.unknown(correlation.unknown ? 1 : 0);
  return body;
}

std::vector<wire::Correlation> wire_correlation(const std::vector<PathCorrelation>& all) {
  std::vector<wire::Correlation> body;
  body.reserve(all.size());
  for (const PathCorrelation& correlation : all) body.push_back(wire_correlation(correlation));
  return body;
}

wire::RevisedEdge wire_revised(const ReviseRequest::Edge& edge) {
  wire::RevisedEdge body;
  body.squares(edge.innovation.squares);
  body.expected(edge.innovation.expected);
  body.variance(edge.innovation.variance);
  body.id(edge.id);
  body.refused(edge.refused ? 1 : 0);
  body.revised(edge.revision ? 1 : 0);
  if (!edge.revision) return body;
  write_transform(edge.revision->X_PC, body.x_pc());
  body.edge_correlation(wire_correlation(edge.revision->correlation));
  return body;
}

struct BodyWriter {
  wire::RequestBody& out;

  void operator()(const AddRequest& add) {
    wire::AddBody body;
    body.parent(add.parent);
    write_transform(add.X_PC, body.x_pc());
    body.lamport_time(add.lamport_time);
    out.add(std::move(body));
  }
  void operator()(const RemoveRequest& remove) {
    wire::RemoveBody body;
    for (const std::string& top : remove.tops) body.tops().emplace_back(top);
    body.lamport_time(remove.lamport_time);
    out.remove(std::move(body));
  }
  void operator()(const UpdateRequest& update) {
    wire::UpdateBody body;
    write_transform(update.edges.front().X_PC, body.x_pc());
    body.stamp(wire_stamp(update.stamp));
    for (auto edge = update.edges.begin() + 1; edge != update.edges.end(); ++edge) {
      body.more().push_back(wire_edge(*edge));
    }
    out.update(std::move(body));
  }
  void operator()(const PartialUpdateRequest& update) {
    wire::PartialUpdate body;
    body.stamp(wire_stamp(update.stamp));
    for (const PartialUpdate& edge : update.edges) body.edges().push_back(wire_partial(edge));
    out.partial_update(std::move(body));
  }
  void operator()(const MoveRequest& move) {
    if (move.X_PC.empty()) {
      wire::MoveBody body;
      body.parent(move.parent);
      body.lamport_time(move.lamport_time);
      out.move(std::move(body));
      return;
    }
    wire::MoveAndUpdate body;
    body.parent(move.parent);
    body.parts(write_parts(move.X_PC, body.x_pc()));
    body.lamport_time(move.lamport_time);
    out.move_and_update(std::move(body));
  }
  void operator()(const LookupRequest& lookup) {
    auto segments = wire_segments(lookup.segments);
    const Query& query = lookup.query;
    const bool plain = !query.at && !lookup.hint && !query.age_noise_until &&
                       query.extrapolate == std::chrono::nanoseconds(0) &&
                       query.order == Order::kSecond && !lookup.edges;
    if (plain) {
      out.lookup(std::move(segments));
      return;
    }
    wire::LookupAt body;
    body.at(wire_stamp(query.at));
    body.hint(wire_stamp(lookup.hint));
    body.extrapolate(query.extrapolate.count());
    body.age_noise_until(wire_stamp(query.age_noise_until));
    body.segments(std::move(segments));
    body.order(static_cast<std::uint8_t>(query.order));
    body.edges(lookup.edges ? 1 : 0);
    out.lookup_at(std::move(body));
  }
  void operator()(const WatchRequest& watch) {
    wire::WatchBody body;
    body.period(watch.period.count());
    body.from(wire_stamp(watch.from));
    body.segments(wire_segments(watch.segments));
    body.composed(watch.composed ? 1 : 0);
    out.watch(std::move(body));
  }
  void operator()(const HistoryRequest& history) { out.history(history.all ? 1 : 0); }
  void operator()(const ReviseRequest& revise) {
    wire::ReviseBody body;
    body.stamp(wire_stamp(revise.stamp));
    body.seen(revise.seen);
    body.incarnation(revise.incarnation);
    for (const ReviseRequest::Edge& edge : revise.edges) body.edges().push_back(wire_revised(edge));
    out.revise(std::move(body));
  }
  void operator()(const CorrelateRequest& said) {
    out.correlate(wire_correlation(said.correlation));
  }
  void operator()(const JointUpdate& update) { out.joint_update(to_wire(update)); }
  void operator()(const JointsRequest& asked) { out.joint_states(asked.after); }
  void operator()(const ForgetRequest& asked) {
    wire::ForgetBody body;
    body.partition(asked.partition);
    body.incarnation(asked.incarnation);
    out.forget(std::move(body));
  }
  void operator()(const ConsistencyRequest& asked) { out.consistency(asked.all ? 1 : 0); }
  void operator()(const FramesRequest& asked) { out.structure(write_frames(asked)); }
  void operator()(const DescriptionRequest& asked) { out.description(asked.from); }
};

}  // namespace

void write_wire(const Request& request, std::string_view partition, wire::Request& sample) {
  sample.id(request.id);
  sample.addressee(addressee_of(partition));
  sample.sequence_number(request.sequence);
  sample.awaits_from(request.awaits_from);
  std::visit(BodyWriter{sample.body()}, request.body);
}

wire::Request to_wire(const Request& request, std::string_view partition) {
  wire::Request sample;
  write_wire(request, partition, sample);
  return sample;
}

namespace {

std::vector<Numbers> wire_values(const std::vector<Transform>& values) {
  std::vector<Numbers> body(values.size());
  for (std::size_t i = 0; i < body.size(); ++i) write_numbers(values[i], body[i]);
  return body;
}

wire::CorrelatedTransforms wire_correlated(const SegmentValues& found) {
  wire::CorrelatedTransforms body;
  body.stamp(wire_stamp(found.stamp));
  body.period(found.period.count());
  body.seen(found.commit);
  body.incarnation(found.incarnation);
  body.values(wire_values(found.values));
  body.at_hint(wire_values(found.at_hint));
  body.correlations(wire_correlation(found.correlations));
  body.correlations_at_hint(wire_correlation(found.correlations_at_hint));
  return body;
}

// If there are too many, only the first of each value, without which it would count as complete.
std::vector<wire::UnspecifiedEdge> wire_unspecified(const std::vector<UnspecifiedEdge>& edges) {
  const bool all = edges.size() <= kMaxItems;
  std::vector<wire::UnspecifiedEdge> body;
  for (const UnspecifiedEdge& edge : edges) {
    const auto value = static_cast<std::uint32_t>(edge.segment);
    if (!all && !body.empty() && body.back().value() == value) continue;
    body.emplace_back();
    body.back().value(value);
    body.back().id(edge.id);
  }
  return body;
}

wire::HistoryInfo wire_history(const HistoryInfo& history) {
  wire::HistoryInfo body;
  body.samples(history.samples);
  body.bytes(history.bytes);
  body.span_limit(history.span_limit.count());
  body.count_limit(history.count_limit);
  body.oldest(wire_stamp(history.oldest));
  body.newest(wire_stamp(history.newest));
  body.mean_gap(history.mean_gap.count());
  body.max_gap(history.max_gap.count());
  body.jitter(history.jitter.count());
  body.refused_old(history.refused_old);
  body.refused_equal(history.refused_equal);
  body.refused_ahead(history.refused_ahead);
  body.id(history.id);
  return body;
}

wire::JointState wire_joint(const JointInfo& joint) {
  const JointLimits limits = joint.limits.value_or(JointLimits{});
  const Mimic mimic = joint.mimic.value_or(Mimic{});
  wire::JointState body;
  body.position(joint.position);
  if (joint.variance) body.variance({*joint.variance});
  body.lower(limits.lower);
  body.upper(limits.upper);
  body.multiplier(mimic.multiplier);
  body.offset(mimic.offset);
  body.outside(joint.outside);
  body.refused(joint.refused);
  body.type(static_cast<std::uint8_t>(joint.type));
  body.limited(joint.limits ? 1 : 0);
  body.measured(joint.measured ? 1 : 0);
  body.name(joint.name);
  body.frame(joint.frame);
  body.follows(mimic.joint);
  return body;
}

struct ReplyWriter {
  wire::ReplyBody& out;

  void operator()(const Done&) { out.done(0); }
  void operator()(const Error& error) {
    wire::ErrorBody body;
    body.code(static_cast<std::uint8_t>(error.code));
    body.message(error.message.substr(0, kMaxMessage));
    out.error(std::move(body));
  }
  void operator()(const SegmentValues& found) {
    if (!found.unspecified.empty() || !found.unspecified_at_hint.empty()) {
      wire::IncompleteTransforms body;
      body.found(wire_correlated(found));
      body.unspecified(wire_unspecified(found.unspecified));
      body.unspecified_at_hint(wire_unspecified(found.unspecified_at_hint));
      out.incomplete(std::move(body));
      return;
    }
    if (!found.correlations.empty() || !found.correlations_at_hint.empty()) {
      out.correlated(wire_correlated(found));
      return;
    }
    if (!found.stamp && found.at_hint.empty()) {
      out.transforms(wire_values(found.values));
      return;
    }
    wire::StampedTransforms body;
    body.stamp(wire_stamp(found.stamp));
    body.period(found.period.count());
    body.values(wire_values(found.values));
    body.at_hint(wire_values(found.at_hint));
    out.stamped(std::move(body));
  }
  void operator()(const PushedValues& pushed) { out.watched(to_wire(pushed)); }
  void operator()(const std::vector<HistoryInfo>& histories) {
    std::vector<wire::HistoryInfo> body;
    for (std::size_t i = 0; i < histories.size() && i < kMaxItems; ++i)
      body.push_back(wire_history(histories[i]));
    out.histories(std::move(body));
  }
  void operator()(const std::vector<EdgeConsistency>& all) {
    std::vector<wire::EdgeConsistency> body(all.size());
    for (std::size_t i = 0; i < body.size(); ++i) {
      body[i].observations(all[i].observations);
      body[i].refused(all[i].refused);
      body[i].squares(all[i].sum.squares);
      body[i].expected(all[i].sum.expected);
      body[i].variance(all[i].sum.variance);
      body[i].id(all[i].id);
    }
    out.consistency(std::move(body));
  }
  void operator()(const std::vector<JointInfo>& joints) {
    std::vector<wire::JointState> body;
    for (std::size_t i = 0; i < joints.size() && i < kMaxItems; ++i)
      body.push_back(wire_joint(joints[i]));
    out.joint_states(std::move(body));
  }
  void operator()(const std::vector<KnownFrame>& known) { out.structure(write_frames(known)); }
  void operator()(const DescriptionPart& part) {
    wire::DescriptionPart body;
    body.size(part.size);
    body.hash(part.hash);
    body.text(part.text.substr(0, kMaxDescriptionPart));
    out.description(std::move(body));
  }
};

}  // namespace

void write_wire(const Reply& reply, wire::Reply& sample) {
  sample.epoch(reply.epoch);
  sample.lamport_time(reply.lamport_time);
  sample.sequence_number(reply.sequence);
  std::visit(ReplyWriter{sample.body()}, reply.body);
}

wire::Reply to_wire(const Reply& reply) {
  wire::Reply sample;
  write_wire(reply, sample);
  return sample;
}

wire::State to_wire(const PushedValues& pushed) {
  wire::State sample;
  write_wire(pushed, sample);
  return sample;
}

void write_wire(const PushedValues& pushed, wire::State& sample) {
  sample.beginnings().clear();
  sample.correlations().clear();
  sample.group(pushed.group);
  sample.after(pushed.after);
  sample.commit(pushed.commit);
  sample.piece(pushed.piece);
  sample.pieces(pushed.pieces);
  sample.entries().resize(pushed.entries.size());
  // For beginnings that are listed twice. Without it an edge that had no sample yet has no value.
  std::size_t room = kMaxItems - std::min(kMaxItems, pushed.entries.size());
  for (std::size_t i = 0; i < pushed.entries.size(); ++i) {
    const PushedValue& entry = pushed.entries[i];
    const bool twice = entry.unsampled && room > 0;
    if (twice) --room;
    const bool no_value = entry.cleared || (entry.unsampled && !twice);
    sample.entries()[i].index(entry.index);
    sample.entries()[i].stamp(no_value ? kClearedStamp : wire_stamp(entry.stamp));
    sample.entries()[i].history(entry.history);
    sample.entries()[i].covariance(entry.covariance_number);
    if (entry.covariance_known) write_pose(entry.X.pose, sample.entries()[i].x());
    if (!entry.covariance_known) write_transform(entry.X, sample.entries()[i].x());
    for (int times = twice ? 2 : entry.process_noise ? 1 : 0; times > 0; --times) {
      sample.beginnings().emplace_back();
      sample.beginnings().back().entry(static_cast<std::uint32_t>(i));
      if (!entry.process_noise || entry.process_noise->upper() == Covariance::Upper{}) continue;
      const Covariance::Upper& upper = entry.process_noise->upper();
      sample.beginnings().back().process_noise().assign(upper.begin(), upper.end());
    }
    if (entry.correlation.empty()) continue;
    sample.correlations().emplace_back();
    sample.correlations().back().entry(static_cast<std::uint32_t>(i));
    sample.correlations().back().edge_correlation(wire_correlation(entry.correlation));
  }
}

}  // namespace tfdude::fastdds
