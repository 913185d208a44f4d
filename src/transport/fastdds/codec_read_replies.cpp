#include <utility>

#include "tfdude/base/id.hpp"

#include "transport/fastdds/codec.hpp"
#include "transport/fastdds/codec_correlation.hpp"
#include "transport/fastdds/codec_frames.hpp"
#include "transport/fastdds/codec_infos.hpp"
#include "transport/fastdds/codec_values.hpp"
#include "transport/fastdds/kinds.hpp"

// Converts replies and pushed values from the network.
namespace tfdude::fastdds {
namespace {

Result<Covariance> read_process_noise(const Numbers& numbers) {
  if (numbers.empty()) return Covariance();
  auto noise = read_covariance(numbers, 0);
  if (!noise) return fail_at("process noise", noise.error());
  return noise;
}

Result<std::vector<Transform>> read_values(const std::vector<Numbers>& body) {
  std::vector<Transform> values;
  values.reserve(body.size());
  for (const Numbers& in : body) {
    auto X = read_computed(in);
    if (!X) return fail_at("a reply", X.error());
    values.push_back(*X);
  }
  return values;
}

Result<SegmentValues> read_stamped(const wire::StampedTransforms& body) {
  SegmentValues found;
  const auto stamp = stamp_from_wire(body.stamp(), "the stamp of a reply");
  if (!stamp) return tl::unexpected(stamp.error());
  found.stamp = *stamp;
  found.period = std::chrono::nanoseconds(body.period());
  auto values = read_values(body.values());
  if (!values) return tl::unexpected(std::move(values.error()));
  found.values = *std::move(values);
  auto at_hint = read_values(body.at_hint());
  if (!at_hint) return tl::unexpected(std::move(at_hint.error()));
  found.at_hint = *std::move(at_hint);
  return found;
}

Result<SegmentValues> read_correlated(const wire::CorrelatedTransforms& body) {
  wire::StampedTransforms plain;
  plain.stamp(body.stamp());
  plain.period(body.period());
  plain.values(body.values());
  plain.at_hint(body.at_hint());
  auto found = read_stamped(plain);
  if (!found) return found;
  found->commit = body.seen();
  found->incarnation = body.incarnation();
  for (const auto& [in, out] :
       {std::pair{&body.correlations(), &found->correlations},
        std::pair{&body.correlations_at_hint(), &found->correlations_at_hint}}) {
    for (const wire::Correlation& one : *in) {
      auto correlation = read_path_correlation(one);
      if (!correlation) return fail_at("a reply", correlation.error());
      out->push_back(*std::move(correlation));
    }
  }
  return found;
}

// Marks the values as not complete.
Result<std::vector<UnspecifiedEdge>> read_unspecified(const std::vector<wire::UnspecifiedEdge>& in,
                                                      std::vector<Transform>& values) {
  std::vector<UnspecifiedEdge> edges;
  edges.reserve(in.size());
  for (const wire::UnspecifiedEdge& one : in) {
    if (one.value() >= values.size()) {
      return fail(Errc::kInvalidInput, "a reply: an unspecified edge of value " +
                                           std::to_string(one.value()) + ", of " +
                                           std::to_string(values.size()));
    }
    values[one.value()].covariance.set_complete(false);
    edges.push_back({one.value(), string_of(one.id())});
  }
  return edges;
}

Result<SegmentValues> read_incomplete(const wire::IncompleteTransforms& body) {
  auto found = read_correlated(body.found());
  if (!found) return found;
  auto edges = read_unspecified(body.unspecified(), found->values);
  if (!edges) return tl::unexpected(std::move(edges.error()));
  found->unspecified = *std::move(edges);
  edges = read_unspecified(body.unspecified_at_hint(), found->at_hint);
  if (!edges) return tl::unexpected(std::move(edges.error()));
  found->unspecified_at_hint = *std::move(edges);
  return found;
}

template <class Body, class Read>
Result<void> put(Reply& reply, Result<Read> read) {
  if (!read) return tl::unexpected(std::move(read.error()));
  reply.body = Body(*std::move(read));
  return {};
}

Result<void> read_body(const wire::ReplyBody& body, Reply& reply) {
  switch (body._d()) {
    case kError:
      // For people to read, though its sender may have put anything in it.
      reply.body = Error{static_cast<Errc>(body.error().code()), printable(body.error().message())};
      return {};
    case kTransforms:
      return put<SegmentValues>(reply, read_values(body.transforms()).map([](auto&& values) {
        return SegmentValues{std::move(values), std::nullopt, {}, {}};
      }));
    case kDoneReply:
      return {};
    case kStamped:
      return put<SegmentValues>(reply, read_stamped(body.stamped()));
    case kState:
      return put<PushedValues>(reply, tfdude::fastdds::from_wire(body.watched()));
    case kHistories: {
      std::vector<HistoryInfo> histories;
      for (const wire::HistoryInfo& history : body.histories())
        histories.push_back(read_history(history));
      reply.body = std::move(histories);
      return {};
    }
    case kCorrelated:
      return put<SegmentValues>(reply, read_correlated(body.correlated()));
    case kIncomplete:
      return put<SegmentValues>(reply, read_incomplete(body.incomplete()));
    case kConsistencies: {
      std::vector<EdgeConsistency> all;
      for (const wire::EdgeConsistency& one : body.consistency())
        all.push_back(read_consistency(one));
      reply.body = std::move(all);
      return {};
    }
    case kJointInfos: {
      std::vector<JointInfo> joints;
      for (const wire::JointState& one : body.joint_states()) joints.push_back(read_joint(one));
      reply.body = std::move(joints);
      return {};
    }
    case kKnownFrames:
      return put<std::vector<KnownFrame>>(reply, read_frames(body.structure()));
    case kDescriptionPart:
      reply.body = DescriptionPart{body.description().size(), body.description().hash(),
                                   body.description().text()};
      return {};
    default:
      return fail(Errc::kUnsupported,
                  "this kind of reply is not known to protocol " + to_string(kProtocolVersion));
  }
}

}  // namespace

Result<Reply> from_wire(const wire::Reply& sample) {
  Reply reply;
  reply.sequence = sample.sequence_number();
  reply.epoch = sample.epoch();
  reply.lamport_time = sample.lamport_time();
  if (auto ok = read_body(sample.body(), reply); !ok) return tl::unexpected(std::move(ok.error()));
  return reply;
}

Result<PushedValues> from_wire(const wire::State& sample) {
  PushedValues pushed;
  pushed.group = sample.group();
  pushed.after = sample.after();
  pushed.commit = sample.commit();
  pushed.piece = sample.piece();
  pushed.pieces = sample.pieces();
  pushed.entries.reserve(sample.entries().size());
  for (const wire::PushedEntry& entry : sample.entries()) {
    const bool cleared = entry.stamp() == kClearedStamp;
    const auto stamp =
        stamp_from_wire(cleared ? kNoStamp : entry.stamp(), "the stamp of a pushed value");
    if (!stamp) return tl::unexpected(stamp.error());
    auto X = read_computed(entry.x());
    if (!X) return fail_at("pushed values", X.error());
    const bool known = entry.covariance() != 0 && is_pose_only(entry.x());
    pushed.entries.push_back(
        {entry.index(), *stamp, *X, {}, entry.history(), {}, entry.covariance(), known, cleared});
  }
  for (const wire::PushedCorrelation& one : sample.correlations()) {
    if (one.entry() >= pushed.entries.size()) {
      return fail(Errc::kInvalidInput, "pushed values: correlation of entry " +
                                           std::to_string(one.entry()) + ", of " +
                                           std::to_string(pushed.entries.size()));
    }
    auto correlation = read_correlation(one.edge_correlation());
    if (!correlation) return fail_at("pushed values", correlation.error());
    pushed.entries[one.entry()].correlation = *std::move(correlation);
  }
  for (const wire::PushedBeginning& one : sample.beginnings()) {
    if (one.entry() >= pushed.entries.size()) {
      return fail(Errc::kInvalidInput, "pushed values: a history begins with entry " +
                                           std::to_string(one.entry()) + ", of " +
                                           std::to_string(pushed.entries.size()));
    }
    auto noise = read_process_noise(one.process_noise());
    if (!noise) return fail_at("pushed values", noise.error());
    PushedValue& entry = pushed.entries[one.entry()];
    // Listed twice: it had no sample yet.
    entry.unsampled = entry.process_noise && !entry.stamp && !entry.cleared;
    entry.process_noise = *noise;
  }
  return pushed;
}

}  // namespace tfdude::fastdds
