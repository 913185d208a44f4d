#include "transport/fastdds/codec_infos.hpp"

#include "tfdude/base/id.hpp"

#include "transport/fastdds/codec_correlation.hpp"

namespace tfdude::fastdds {

EdgeConsistency read_consistency(const wire::EdgeConsistency& body) {
  return {printable(text(body.id())),
          body.observations(),
          body.refused(),
          {body.squares(), body.expected(), body.variance()}};
}

JointInfo read_joint(const wire::JointState& body) {
  JointInfo joint;
  joint.name = printable(text(body.name()));
  joint.frame = printable(text(body.frame()));
  joint.type = static_cast<JointType>(body.type());
  if (body.limited() != 0) joint.limits = JointLimits{body.lower(), body.upper()};
  if (const auto leader = printable(text(body.follows())); !leader.empty()) {
    joint.mimic = Mimic{leader, body.multiplier(), body.offset()};
  }
  joint.position = body.position();
  if (!body.variance().empty()) joint.variance = body.variance().front();
  joint.measured = body.measured() != 0;
  joint.outside = body.outside();
  joint.refused = body.refused();
  return joint;
}

HistoryInfo read_history(const wire::HistoryInfo& body) {
  const auto stamp = [](std::int64_t ns) {
    return ns >= 0 ? std::optional<Time>(time_of(ns)) : std::nullopt;
  };
  HistoryInfo history;
  history.id = printable(text(body.id()));
  history.samples = body.samples();
  history.bytes = body.bytes();
  history.span_limit = std::chrono::nanoseconds(body.span_limit());
  history.count_limit = body.count_limit();
  history.oldest = stamp(body.oldest());
  history.newest = stamp(body.newest());
  history.mean_gap = std::chrono::nanoseconds(body.mean_gap());
  history.max_gap = std::chrono::nanoseconds(body.max_gap());
  history.jitter = std::chrono::nanoseconds(body.jitter());
  history.refused_old = body.refused_old();
  history.refused_equal = body.refused_equal();
  history.refused_ahead = body.refused_ahead();
  return history;
}

}  // namespace tfdude::fastdds
