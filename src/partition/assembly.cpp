#include "partition/assembly.hpp"

#include <algorithm>
#include <utility>

#include "tfdude/base/id.hpp"

#include "math/common_errors.hpp"
#include "math/instant_sources.hpp"

namespace tfdude {
namespace {

// Visits the answers in the order of the path.
template <class Take>
void each_segment(const LookupPlan& plan, Take take) {
  std::vector<std::size_t> taken(plan.parts.size(), 0);
  for (const Segment& segment : plan.segments) {
    const auto part = std::find_if(plan.parts.begin(), plan.parts.end(),
                                   [&](const Part& asked) { return asked.owner == segment.owner; });
    const auto i = static_cast<std::size_t>(part - plan.parts.begin());
    take(i, taken[i]++);
  }
}

// What an answer names that has no instant is of static edges: it lasts.
void join_lasting(const std::vector<SegmentValues>& answers, std::vector<CommonError>& errors) {
  if (!has_instants(errors)) return;
  std::vector<std::vector<CommonError>> others;
  for (const SegmentValues& answer : answers) {
    if (answer.stamp) continue;
    for (const PathCorrelation& correlation : answer.correlations) {
      others.push_back(correlation.common_errors);
    }
  }
  std::vector<ErrorsOfEdge> all = {{&errors, false}};
  for (auto& one : others) all.push_back({&one, true});
  tfdude::join_lasting(all);
}

StampedTransform composed(const LookupPlan& plan, const std::vector<SegmentValues>& answers) {
  std::optional<Time> stamp;
  bool correlated = false;
  for (const SegmentValues& answer : answers) {
    if (answer.stamp) stamp = answer.stamp;
    correlated = correlated || !answer.correlations.empty();
  }
  const Order order = plan.parts.empty()
                          ? Order::kSecond
                          : std::get<LookupRequest>(plan.parts[0].request.body).query.order;
  if (correlated || order == Order::kFourth) {
    Belief X_AB;
    each_segment(plan, [&](std::size_t i, std::size_t k) {
      const PathCorrelation none;
      const PathCorrelation& correlation =
          k < answers[i].correlations.size() ? answers[i].correlations[k] : none;
      X_AB = compose(X_AB, belief_of(answers[i].values[k], correlation), order);
    });
    join_lasting(answers, X_AB.common_errors);
    return collapsed(X_AB, order, stamp);
  }
  StampedTransform X_AB{Transform::exact({}), stamp, {}};
  bool first = true;
  each_segment(plan, [&](std::size_t i, std::size_t k) {
    const Transform& X = answers[i].values[k];
    static_cast<Transform&>(X_AB) = first ? X : compose(X_AB, X);
    first = false;
  });
  return X_AB;
}

std::vector<std::string> unspecified_edges(const LookupPlan& plan,
                                           const std::vector<SegmentValues>& answers) {
  std::vector<std::string> ids;
  each_segment(plan, [&](std::size_t i, std::size_t k) {
    for (const UnspecifiedEdge& edge : answers[i].unspecified) {
      if (edge.segment == k) ids.push_back(edge.id);
    }
  });
  return ids;
}

}  // namespace

Result<StampedTransform> assemble(const LookupPlan& plan,
                                  const std::vector<SegmentValues>& answers) {
  if (answers.size() != plan.parts.size()) {
    return fail(Errc::kNotOwner, std::to_string(answers.size()) + " partitions of " +
                                     std::to_string(plan.parts.size()) + " answered");
  }
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const auto& asked = std::get<LookupRequest>(plan.parts[i].request.body).segments;
    if (answers[i].values.size() == asked.size()) continue;
    return fail(Errc::kNotOwner, "partition " + quote(plan.parts[i].partition) + " gave " +
                                     std::to_string(answers[i].values.size()) + " transforms for " +
                                     std::to_string(asked.size()) + " segments");
  }
  StampedTransform X_AB = composed(plan, answers);
  if (plan.before_all && X_AB.stamp) {
    return fail(Errc::kTooOld, "there is no data for a negative time");
  }
  if (!X_AB.covariance.complete()) X_AB.basis.unspecified = unspecified_edges(plan, answers);
  return X_AB;
}

}  // namespace tfdude
