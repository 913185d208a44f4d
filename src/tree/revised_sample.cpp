#include "tree/revised_sample.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "tfdude/math/interpolate.hpp"
#include "tfdude/math/perturbation.hpp"

#include "math/common_errors.hpp"
#include "math/drift.hpp"
#include "math/random_walk.hpp"
#include "math/semidefinite.hpp"

namespace tfdude {
namespace {

Belief belief_of(const Transform& X, const Correlation* correlation) {
  Belief belief;
  belief.pose = X.pose;
  belief.own = X.covariance.of_specified();
  belief.unspecified = !X.covariance.complete();
  if (correlation == nullptr) return belief;
  belief.common_errors = correlation->common_errors;
  if (correlation->unknown) belief.unknown = std::exchange(belief.own, {});
  return belief;
}

Belief belief_of(const Sample& sample, const Correlation* said) {
  return belief_of(sample.value(), correlation_at(sample, said));
}

// Whether its owner has not told how it was given.
bool is_guessed(const Sample& sample) {
  return sample.revision() != nullptr && sample.revision()->row.told == Told::kGuessed;
}

// Whether observations have found the second sample elsewhere than where the first one and the way
// between both lead.
bool is_found_elsewhere(const Sample& before, const Sample& after) {
  if (after.revision() == nullptr) return false;
  const RowInfo& row = after.revision()->row;
  if (row.told == Told::kGuessed) return true;
  // From a row on, it is on the way that was given, which may have come later.
  const bool follows_row = before.revision() == nullptr || before.revision()->row.observed;
  if (follows_row && !row.observed && row.told == Told::kNot) return false;
  constexpr double kRounding = 1e-9;
  const Pose way = given(before).pose.inverse() * given(after).pose;
  const Pose led = before.value_pose() * way;
  const Pose there = after.value_pose();
  const double by = (led.translation() - there.translation()).norm();
  return by > kRounding * (1.0 + there.translation().norm()) ||
         led.rotation().angularDistance(there.rotation()) > kRounding;
}

// Whether an observation has corrected the second sample, but not the first.
bool is_corrected_alone(const Sample& before, const Sample& after, const Correlation* said) {
  if (is_found_elsewhere(before, after)) return true;
  const Correlation* second = correlation_at(after, said);
  if (second == nullptr) return false;
  const Correlation* first = correlation_at(before, said);
  const auto is_new = [&](const CommonError& error) {
    if (first == nullptr) return true;
    const auto& all = first->common_errors;
    return std::none_of(all.begin(), all.end(),
                        [&](const CommonError& one) { return one.source == error.source; });
  };
  return std::any_of(second->common_errors.begin(), second->common_errors.end(), is_new);
}

// The covariance of what was interpolated between two samples, and of what a random walk has added
// beside. The share of the later one is not the best gain, so part of this is correlated with its
// error, and an observation has changed how.
Covariance with_walk(const Covariance& interpolated, const Twist& xi, double s,
                     const Matrix6d& share, const Walk& walk) {
  const Pose to = exp(Twist(s * xi));
  const Pose from = exp(Twist((1.0 - s) * xi));
  const Matrix6d F = adjoint(from.inverse());
  const Matrix6d until = walked(walk.density, to, s * walk.seconds).matrix();
  const Matrix6d since = walked(walk.density, from, (1.0 - s) * walk.seconds).matrix();
  const Bridge bridge = bridged(until, F, since);
  const Matrix6d beyond = bridge.K - share;
  const Matrix6d correlated = beyond * (F * until * F.transpose() + since) * beyond.transpose();
  return bound(interpolated, Covariance::trusted(correlated)) + Covariance::trusted(bridge.rest);
}

// Of a sample as it was given, with the errors that are said of its edge.
Covariance with_said(const Transform& G_PC, const Correlation* said) {
  Covariance all = G_PC.covariance.of_specified();
  if (said == nullptr) return all;
  for (const CommonError& one : said->common_errors) {
    all += Covariance::trusted(Matrix6d(one.loading * one.loading.transpose()));
  }
  return all;
}

// The covariance of X is that of the whole error, of which the common errors are a part.
CorrelatedValue split(Transform X, std::vector<CommonError> common_errors, bool unknown) {
  Matrix6d own = X.covariance.of_specified().matrix();
  for (const CommonError& one : common_errors) {
    own -= (one.subtracts ? -1.0 : 1.0) * one.loading * one.loading.transpose();
  }
  const bool complete = X.covariance.complete();
  X.covariance = Covariance::trusted(nearest_semidefinite(own));
  X.covariance.set_complete(complete);
  return {X, {unknown, std::move(common_errors), {}}};
}

}  // namespace

const Correlation* correlation_at(const Sample& sample, const Correlation* said) {
  const SharedRevision* revision = sample.revision();
  return revision != nullptr ? &revision->correlation() : said;
}

Transform whole(const Transform& X_PC, const Correlation& now, const Correlation* said) {
  Belief all;
  all.pose = X_PC.pose;
  all.own = X_PC.covariance.of_specified();
  all.unspecified = !X_PC.covariance.complete();
  const auto is_said = [&](const CommonError& one) {
    return said != nullptr &&
           std::count(said->common_errors.begin(), said->common_errors.end(), one) > 0;
  };
  std::copy_if(now.common_errors.begin(), now.common_errors.end(),
               std::back_inserter(all.common_errors),
               [&](const CommonError& one) { return !is_said(one); });
  return collapse(all);
}

Transform whole(const Sample& sample, const Correlation* said) {
  const SharedRevision* revision = sample.revision();
  const Transform X = sample.value();
  return revision != nullptr ? whole(X, revision->correlation(), said) : X;
}

CorrelatedValue drifted(const Transform& X, const Correlation* correlation, const Pose& increment,
                        const Walk& walk) {
  const Pose back = increment.inverse();
  CorrelatedValue found{{X.pose * increment, X.covariance.of_specified().transported(back)}, {}};
  found.X_PC.covariance += walked(walk.density, increment, walk.seconds);
  found.X_PC.covariance.set_complete(X.covariance.complete());
  if (correlation == nullptr) return found;
  found.correlation = *correlation;
  if (!correlation->common_errors.empty()) {
    found.correlation.common_errors = times(adjoint(back), correlation->common_errors);
  }
  return found;
}

CorrelatedValue drifted(const Sample& before, const Correlation* said, const Pose& G_PC,
                        const Walk& walk) {
  const Pose increment = given(before).pose.inverse() * G_PC;
  CorrelatedValue found = drifted(before.value(), correlation_at(before, said), increment, walk);
  if (before.revision() == nullptr) found.X_PC.pose = G_PC;
  return found;
}

bool follows(const Sample& before, const Correlation* said, const Transform& X_PC,
             const Correlation& correlation) {
  return drift_between(belief_of(before, said), belief_of(X_PC, &correlation)).has_value();
}

Transform given(const Sample& sample) {
  const SharedRevision* revision = sample.revision();
  return revision != nullptr ? revision->given : sample.value();
}

Matrix6d share_of_after(const Sample& before, const Sample& after, double s) {
  const Twist xi = log(before.value_pose().inverse() * after.value_pose());
  return s * right_jacobian(s * xi) * right_jacobian(xi).inverse();
}

CorrelatedValue interpolate_observed(const Sample& before, const Sample& after, double s,
                                     const Correlation* said, const Walk* walk) {
  const Belief X0 = belief_of(before, said);
  const Belief X1 = belief_of(after, said);
  Transform X;
  interpolate(collapse(X0), collapse(X1), s, X);
  const Twist xi = log(X0.pose.inverse() * X1.pose);
  const Matrix6d B0 = right_jacobian((s - 1.0) * xi) * right_jacobian(-xi).inverse();
  const Matrix6d share = share_of_after(before, after, s);
  if (walk != nullptr && X.covariance.complete()) {
    X.covariance = with_walk(X.covariance.of_specified(), xi, s, share, *walk);
  }
  std::vector<CommonError> common_errors = times((1.0 - s) * B0, X0.common_errors);
  add_errors(times(share, X1.common_errors), common_errors);
  return split(X, std::move(common_errors), X0.unknown || X1.unknown);
}

CorrelatedValue drifted_between(const Sample& before, const Sample& after, double s,
                                const Correlation* said, const Walk& walk) {
  if (!is_corrected_alone(before, after, said)) {
    Pose G_PC;
    interpolate(given(before).pose, given(after).pose, s, G_PC);
    return drifted(before, said, G_PC, {walk.density, s * walk.seconds});
  }
  CorrelatedValue found = interpolate_observed(before, after, s, said, &walk);
  if (is_guessed(after) && found.X_PC.covariance.complete()) {
    // Perhaps nothing was observed, but the first sample came late, and leads to the second.
    const CorrelatedValue led =
        drifted(before.value(), correlation_at(before, said),
                before.value_pose().inverse() * found.X_PC.pose, {walk.density, s * walk.seconds});
    found.X_PC.covariance += whole(led.X_PC, led.correlation, nullptr).covariance.of_specified();
  }
  return found;
}

CorrelatedValue extrapolate_correlated(const Sample& before, const Sample& after,
                                       const Transform& X_newest, double s, const Correlation* said,
                                       const Walk* walk) {
  const double beyond = s - 1.0;
  if (walk == nullptr && before.revision() == nullptr && after.revision() == nullptr) {
    CorrelatedValue found;
    extrapolate(before, after, X_newest, s, found.X_PC);
    if (said == nullptr) return found;
    found.correlation = *said;
    for (CommonError& one : found.correlation.common_errors) one.loading *= s + beyond;
    return found;
  }
  const Transform G0 = given(before);
  const Transform G1 = given(after);
  const Twist further = beyond * log(G0.pose.inverse() * G1.pose);
  const Belief X1 = belief_of(after, said);
  const Pose ahead = exp(further);
  Transform X{X1.pose * ahead, StatedCovariance()};
  const Matrix6d to_there = adjoint(ahead.inverse());
  const Covariance offset = collapse(X1).covariance.of_specified().transported(ahead.inverse());
  X.covariance = offset;
  bool complete = !X1.unspecified;
  if (walk != nullptr) {
    // If the edge truly goes on evenly, the twist is wrong by what the last interval has added, so
    // that this counts s times: its variance s², of which the newest sample has 1.
    if (complete) X.covariance += walked(walk->density, ahead, (1.0 + s) * walk->seconds);
    if (complete && is_guessed(after)) {
      const Covariance of_ends = bound(collapse(belief_of(before, said)).covariance.of_specified(),
                                       collapse(X1).covariance.of_specified());
      X.covariance = bound(X.covariance.of_specified(),
                           Covariance::trusted(Matrix6d(beyond * beyond * of_ends.matrix())));
    }
  } else {
    const Covariance of_twist = bound(with_said(G0, said), with_said(G1, said));
    X.covariance =
        bound(offset, Covariance::trusted(Matrix6d(beyond * beyond * of_twist.matrix())));
    complete = complete && G0.covariance.complete() && G1.covariance.complete();
  }
  X.covariance.set_complete(complete);
  // What the twist has of the sources is of both samples as given, and so it is on other edges.
  const bool of_sources = walk == nullptr && said != nullptr && !said->common_errors.empty();
  return split(X, times(to_there, X1.common_errors), X1.unknown.has_value() || of_sources);
}

}  // namespace tfdude
