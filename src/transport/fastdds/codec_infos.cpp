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
  joint.variance = body.variance();
  joint.measured = body.measured() != 0;
  joint.outside = body.outside();
  joint.refused = body.refused();
  return joint;
}

PastInfo read_past(const wire::Past& body) {
  const auto stamp = [](std::int64_t ns) {
    return ns > 0 ? std::optional<Time>(time_of(ns)) : std::nullopt;
  };
  PastInfo past;
  past.id = printable(text(body.id()));
  past.samples = body.samples();
  past.bytes = body.bytes();
  past.span_limit = std::chrono::nanoseconds(body.span_limit());
  past.count_limit = body.count_limit();
  past.oldest = stamp(body.oldest());
  past.newest = stamp(body.newest());
  past.mean_gap = std::chrono::nanoseconds(body.mean_gap());
  past.max_gap = std::chrono::nanoseconds(body.max_gap());
  past.jitter = std::chrono::nanoseconds(body.jitter());
  past.refused_old = body.refused_old();
  past.refused_equal = body.refused_equal();
  past.refused_ahead = body.refused_ahead();
  return past;
}

}  // namespace tfdude::fastdds
