#pragma once

#include <sstream>
#include <string>
#include <vector>

#include "partition/messages.hpp"
#include "support/catch.hpp"
#include "support/pose_diff.hpp"

// Checks that a received message is equal to the one that was sent.
namespace tfdude::testing {

// Unit quaternions are normalized again on arrival; everything else is exact.
inline void check_same(const Transform& actual, const Transform& expected) {
  CHECK(pose_diff(actual.pose, expected.pose, 1e-15) == "");
  CHECK(actual.covariance == expected.covariance);
}

inline void check_same(const std::vector<EdgeUpdate>& actual,
                       const std::vector<EdgeUpdate>& expected) {
  REQUIRE(actual.size() == expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    CHECK(actual[i].id == expected[i].id);
    check_same(actual[i].X_PC, expected[i].X_PC);
  }
}

inline void check_same(const std::vector<PathEnds>& actual, const std::vector<PathEnds>& expected) {
  REQUIRE(actual.size() == expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    CHECK(actual[i].from == expected[i].from);
    CHECK(actual[i].to == expected[i].to);
  }
}

inline void check_same(const NormalizedInnovation& actual, const NormalizedInnovation& expected) {
  CHECK(actual.squares == expected.squares);
  CHECK(actual.expected == expected.expected);
  CHECK(actual.variance == expected.variance);
}

inline void check_same(const ReviseRequest& actual, const ReviseRequest& expected) {
  CHECK(actual.stamp == expected.stamp);
  CHECK(actual.seen == expected.seen);
  CHECK(actual.incarnation == expected.incarnation);
  REQUIRE(actual.edges.size() == expected.edges.size());
  for (std::size_t i = 0; i < actual.edges.size(); ++i) {
    const ReviseRequest::Edge& came = actual.edges[i];
    const ReviseRequest::Edge& sent = expected.edges[i];
    CHECK(came.id == sent.id);
    CHECK(came.refused == sent.refused);
    check_same(came.innovation, sent.innovation);
    REQUIRE(came.revision.has_value() == sent.revision.has_value());
    if (!came.revision) continue;
    CHECK(came.revision->id == sent.revision->id);
    CHECK(came.revision->stamp == sent.revision->stamp);
    check_same(came.revision->X_PC, sent.revision->X_PC);
    CHECK(came.revision->correlation == sent.revision->correlation);
  }
}

inline void check_same(const std::vector<PathCorrelation>& actual,
                       const std::vector<PathCorrelation>& expected) {
  REQUIRE(actual.size() == expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    CHECK(actual[i].common_errors == expected[i].common_errors);
    CHECK(actual[i].observed_with == expected[i].observed_with);
    REQUIRE(actual[i].unknown.has_value() == expected[i].unknown.has_value());
    if (actual[i].unknown) CHECK(actual[i].unknown->upper() == expected[i].unknown->upper());
  }
}

inline void check_same(const std::vector<UnspecifiedEdge>& actual,
                       const std::vector<UnspecifiedEdge>& expected) {
  REQUIRE(actual.size() == expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) {
    CHECK(actual[i].segment == expected[i].segment);
    CHECK(actual[i].id == expected[i].id);
  }
}

// All fields in one text.
inline std::string listed(const JointUpdate& update) {
  std::ostringstream text;
  text.precision(17);
  for (const JointValue& joint : update.joints) {
    text << joint.name << ' ' << joint.position << ' ' << joint.variance.value_or(-1) << ' ';
  }
  text << (update.stamp ? nanoseconds(*update.stamp) : 0);
  return text.str();
}

// All fields in one text.
inline std::string listed(const FramesRequest& asked) {
  std::string text;
  for (const std::string& id : asked.ids) text += id + ' ';
  for (const std::string& tree : asked.trees) text += "tree " + tree + ' ';
  for (const SeenEpoch& seen : asked.seen) {
    text += seen.partition + ' ' + std::to_string(seen.epoch) + ' ';
  }
  return text;
}

// All fields in one text.
inline std::string listed(const std::vector<KnownFrame>& frames) {
  std::string text;
  for (const KnownFrame& frame : frames) {
    text += frame.id + " < " + frame.parent + " @ " + frame.partition + ' ';
  }
  return text;
}

// All fields in one text.
inline std::string listed(const JointInfo& joint) {
  std::ostringstream text;
  text.precision(17);
  text << joint.name << ' ' << joint.frame << ' ' << to_string(joint.type) << ' ' << joint.position
       << ' ' << joint.variance.value_or(-1) << ' ' << joint.measured << ' ' << joint.outside << ' '
       << joint.refused;
  if (joint.limits) text << " limits " << joint.limits->lower << ' ' << joint.limits->upper;
  if (joint.mimic) {
    text << " mimics " << joint.mimic->joint << ' ' << joint.mimic->multiplier << ' '
         << joint.mimic->offset;
  }
  return text.str();
}

inline void check_same(const PartialTransform& actual, const PartialTransform& expected) {
  CHECK(actual.translation == expected.translation);
  REQUIRE(actual.rotation.has_value() == expected.rotation.has_value());
  if (actual.rotation) CHECK(actual.rotation->isApprox(*expected.rotation, 1e-15));
  REQUIRE(actual.covariance.has_value() == expected.covariance.has_value());
  if (actual.covariance) CHECK(*actual.covariance == *expected.covariance);
}

inline void check_same(const PartialUpdateRequest& actual, const PartialUpdateRequest& expected) {
  CHECK(actual.stamp == expected.stamp);
  REQUIRE(actual.edges.size() == expected.edges.size());
  for (std::size_t i = 0; i < actual.edges.size(); ++i) {
    CHECK(actual.edges[i].id == expected.edges[i].id);
    check_same(actual.edges[i].X_PC, expected.edges[i].X_PC);
  }
}

inline void check_same(const std::optional<EdgeTiming>& actual,
                       const std::optional<EdgeTiming>& expected) {
  REQUIRE(actual.has_value() == expected.has_value());
  if (!actual) return;
  CHECK(actual->span == expected->span);
  CHECK(actual->count == expected->count);
  CHECK(actual->process_noise.upper() == expected->process_noise.upper());
  CHECK(actual->drifts == expected->drifts);
  CHECK(actual->moving == expected->moving);
  CHECK(actual->max_ahead == expected->max_ahead);
  CHECK(actual->restart_after == expected->restart_after);
}

inline void check_same(const HandedSample& actual, const HandedSample& expected) {
  CHECK(actual.stamp == expected.stamp);
  CHECK(actual.is_row == expected.is_row);
  CHECK(actual.made_up == expected.made_up);
  check_same(actual.X_PC, expected.X_PC);
  REQUIRE(actual.revision.has_value() == expected.revision.has_value());
  if (!actual.revision) return;
  check_same(actual.revision->given, expected.revision->given);
  CHECK(actual.revision->correlation == expected.revision->correlation);
  const RowInfo& came = actual.revision->row;
  const RowInfo& sent = expected.revision->row;
  CHECK(came.observed == sent.observed);
  CHECK(came.between == sent.between);
  CHECK(came.lasts == sent.lasts);
  CHECK(came.follows == sent.follows);
  CHECK(came.before == sent.before);
}

inline void check_same(const HandedPart& actual, const HandedPart& expected) {
  CHECK(actual.incarnation == expected.incarnation);
  CHECK(actual.first == expected.first);
  CHECK(actual.begins == expected.begins);
  CHECK(actual.is_last == expected.is_last);
  REQUIRE(actual.edges.size() == expected.edges.size());
  for (std::size_t i = 0; i < actual.edges.size(); ++i) {
    const HandedEdge& came = actual.edges[i];
    const HandedEdge& sent = expected.edges[i];
    CHECK(came.id == sent.id);
    CHECK(came.parent == sent.parent);
    CHECK(came.lamport_time == sent.lamport_time);
    CHECK(came.state == sent.state);
    CHECK(came.left_behind == sent.left_behind);
    check_same(came.timing, sent.timing);
    check_same(came.X_PC, sent.X_PC);
    CHECK(came.said == sent.said);
    REQUIRE(came.now.has_value() == sent.now.has_value());
    if (came.now) CHECK(*came.now == *sent.now);
    CHECK(came.continues == sent.continues);
    REQUIRE(came.samples.size() == sent.samples.size());
    for (std::size_t j = 0; j < came.samples.size(); ++j) {
      check_same(came.samples[j], sent.samples[j]);
    }
  }
}

inline void check_same(const Request& actual, const Request& expected) {
  CHECK(actual.sequence == expected.sequence);
  CHECK(actual.awaits_from == expected.awaits_from);
  CHECK(actual.id == expected.id);
  REQUIRE(actual.body.index() == expected.body.index());
  if (const auto* add = std::get_if<AddRequest>(&expected.body)) {
    CHECK(std::get<AddRequest>(actual.body).parent == add->parent);
    CHECK(std::get<AddRequest>(actual.body).lamport_time == add->lamport_time);
    check_same(std::get<AddRequest>(actual.body).X_PC, add->X_PC);
  } else if (const auto* remove = std::get_if<RemoveRequest>(&expected.body)) {
    CHECK(std::get<RemoveRequest>(actual.body).tops == remove->tops);
    CHECK(std::get<RemoveRequest>(actual.body).lamport_time == remove->lamport_time);
  } else if (const auto* update = std::get_if<UpdateRequest>(&expected.body)) {
    check_same(std::get<UpdateRequest>(actual.body).edges, update->edges);
    CHECK(std::get<UpdateRequest>(actual.body).stamp == update->stamp);
  } else if (const auto* move = std::get_if<MoveRequest>(&expected.body)) {
    CHECK(std::get<MoveRequest>(actual.body).parent == move->parent);
    CHECK(std::get<MoveRequest>(actual.body).lamport_time == move->lamport_time);
    check_same(std::get<MoveRequest>(actual.body).X_PC, move->X_PC);
  } else if (const auto* watch = std::get_if<WatchRequest>(&expected.body)) {
    const auto& arrived = std::get<WatchRequest>(actual.body);
    CHECK(arrived.composed == watch->composed);
    CHECK(arrived.from == watch->from);
    CHECK(arrived.period == watch->period);
    check_same(arrived.segments, watch->segments);
  } else if (const auto* history = std::get_if<HistoryRequest>(&expected.body)) {
    CHECK(std::get<HistoryRequest>(actual.body).all == history->all);
  } else if (const auto* lookup_at = std::get_if<LookupRequest>(&expected.body)) {
    const LookupRequest& lookup = *lookup_at;
    const auto& arrived = std::get<LookupRequest>(actual.body);
    CHECK(arrived.query.at == lookup.query.at);
    CHECK(arrived.query.extrapolate == lookup.query.extrapolate);
    CHECK(arrived.query.age_noise_until == lookup.query.age_noise_until);
    CHECK(arrived.query.order == lookup.query.order);
    CHECK(arrived.query.believed_at == lookup.query.believed_at);
    CHECK(arrived.hint == lookup.hint);
    CHECK(arrived.edges == lookup.edges);
    CHECK(arrived.rows == lookup.rows);
    check_same(arrived.segments, lookup.segments);
  } else if (const auto* revise = std::get_if<ReviseRequest>(&expected.body)) {
    check_same(std::get<ReviseRequest>(actual.body), *revise);
  } else if (const auto* asked = std::get_if<ConsistencyRequest>(&expected.body)) {
    CHECK(std::get<ConsistencyRequest>(actual.body).all == asked->all);
  } else if (const auto* partial = std::get_if<PartialUpdateRequest>(&expected.body)) {
    check_same(std::get<PartialUpdateRequest>(actual.body), *partial);
  } else if (const auto* from = std::get_if<JointsRequest>(&expected.body)) {
    CHECK(std::get<JointsRequest>(actual.body).after == from->after);
  } else if (const auto* said = std::get_if<CorrelateRequest>(&expected.body)) {
    CHECK(std::get<CorrelateRequest>(actual.body).correlation == said->correlation);
  } else if (const auto* forget = std::get_if<ForgetRequest>(&expected.body)) {
    CHECK(std::get<ForgetRequest>(actual.body).partition == forget->partition);
    CHECK(std::get<ForgetRequest>(actual.body).incarnation == forget->incarnation);
  } else if (const auto* frames = std::get_if<FramesRequest>(&expected.body)) {
    CHECK(listed(std::get<FramesRequest>(actual.body)) == listed(*frames));
  } else if (const auto* description = std::get_if<DescriptionRequest>(&expected.body)) {
    CHECK(std::get<DescriptionRequest>(actual.body).from == description->from);
  } else if (const auto* time = std::get_if<TimeRequest>(&expected.body)) {
    CHECK(std::get<TimeRequest>(actual.body).shown == time->shown);
  } else if (const auto* rewrite = std::get_if<RewriteRequest>(&expected.body)) {
    const auto& arrived = std::get<RewriteRequest>(actual.body);
    CHECK(arrived.number == rewrite->number);
    CHECK(arrived.interval.from == rewrite->interval.from);
    CHECK(arrived.interval.to == rewrite->interval.to);
    CHECK(arrived.total == rewrite->total);
    CHECK(arrived.first == rewrite->first);
    REQUIRE(arrived.samples.size() == rewrite->samples.size());
    for (std::size_t i = 0; i < arrived.samples.size(); ++i) {
      CHECK(arrived.samples[i].stamp == rewrite->samples[i].stamp);
      check_same(arrived.samples[i].X_PC, rewrite->samples[i].X_PC);
    }
  } else if (const auto* handover = std::get_if<HandOverRequest>(&expected.body)) {
    const auto& arrived = std::get<HandOverRequest>(actual.body);
    CHECK(arrived.step == handover->step);
    CHECK(arrived.to == handover->to);
    CHECK(arrived.edge == handover->edge);
    CHECK(arrived.after == handover->after);
  } else if (const auto* adopt = std::get_if<AdoptRequest>(&expected.body)) {
    const auto& arrived = std::get<AdoptRequest>(actual.body);
    CHECK(arrived.from == adopt->from);
    CHECK(arrived.parent == adopt->parent);
    CHECK(arrived.lamport_time == adopt->lamport_time);
    check_same(arrived.X_PC, adopt->X_PC);
    check_same(arrived.part, adopt->part);
  } else if (const auto* joints = std::get_if<JointUpdate>(&expected.body)) {
    CHECK(listed(std::get<JointUpdate>(actual.body)) == listed(*joints));
  }
}

inline void check_same(const std::vector<Transform>& actual,
                       const std::vector<Transform>& expected) {
  REQUIRE(actual.size() == expected.size());
  for (std::size_t i = 0; i < actual.size(); ++i) check_same(actual[i], expected[i]);
}

inline void check_same(const PushedValues& actual, const PushedValues& expected) {
  CHECK(actual.group == expected.group);
  CHECK(actual.after == expected.after);
  CHECK(actual.commit == expected.commit);
  CHECK(actual.piece == expected.piece);
  CHECK(actual.pieces == expected.pieces);
  REQUIRE(actual.entries.size() == expected.entries.size());
  for (std::size_t i = 0; i < actual.entries.size(); ++i) {
    CHECK(actual.entries[i].index == expected.entries[i].index);
    CHECK(actual.entries[i].stamp == expected.entries[i].stamp);
    check_same(actual.entries[i].X, expected.entries[i].X);
    CHECK(actual.entries[i].correlation == expected.entries[i].correlation);
    CHECK(actual.entries[i].history == expected.entries[i].history);
    CHECK(actual.entries[i].cleared == expected.entries[i].cleared);
    const auto& noise = expected.entries[i].process_noise;
    REQUIRE(actual.entries[i].process_noise.has_value() == noise.has_value());
    if (noise) CHECK(actual.entries[i].process_noise->upper() == noise->upper());
  }
}

// All fields in one text.
inline std::string listed(const HistoryInfo& history) {
  std::ostringstream text;
  const auto stamp = [](const std::optional<Time>& time) { return time ? nanoseconds(*time) : 0; };
  text << history.id << ' ' << history.samples << ' ' << history.bytes << ' '
       << history.span_limit.count() << ' ' << history.count_limit << ' ' << stamp(history.oldest)
       << ' ' << stamp(history.newest) << ' ' << history.mean_gap.count() << ' '
       << history.max_gap.count() << ' ' << history.jitter.count() << ' ' << history.refused_old
       << ' ' << history.refused_equal << ' ' << history.refused_ahead;
  return text.str();
}

}  // namespace tfdude::testing
