#include "tree/row_ways.hpp"

#include <utility>

#include "tfdude/math/interpolate.hpp"
#include "tfdude/math/perturbation.hpp"

#include "math/common_errors.hpp"
#include "math/random_walk.hpp"

namespace tfdude {
namespace {

Matrix6d moved_by(const Matrix6d& G, const Matrix6d& sigma) { return G * sigma * G.transpose(); }

Matrix6d own_of(const RowOfSample& row) { return row.X_PC.covariance.of_specified().matrix(); }

Pose given_at(const HeldVersion& edge, std::int64_t t) {
  if (t == edge.stamp) return given(*edge.samples->sample(edge.number)).pose;
  std::uint64_t back = 0;
  const auto [before, after] = edge.samples->around(t, edge.number, back);
  if (before != nullptr && before->stamp == t) return given(*before).pose;
  Pose G_PC;
  if (before == nullptr || after == nullptr) return G_PC;
  const double s =
      static_cast<double>(t - before->stamp) / static_cast<double>(after->stamp - before->stamp);
  interpolate(given(*before).pose, given(*after).pose, s, G_PC);
  return G_PC;
}

Way step(const Covariance& density, const Pose& from, const Pose& to, std::int64_t nanoseconds) {
  const Pose increment = from.inverse() * to;
  const double seconds = static_cast<double>(nanoseconds) * 1e-9;
  return {increment, walked(density, increment, seconds).matrix()};
}

Way step(const HeldVersion& edge, std::uint64_t number) {
  const Sample& from = *edge.samples->sample(number);
  const Sample& to = *edge.samples->sample(number + 1);
  return step(edge.samples->timing().process_noise, given(from).pose, given(to).pose,
              to.stamp - from.stamp);
}

}  // namespace

Way operator*(const Way& first, const Way& second) {
  return {first.increment * second.increment,
          (moved_by(second.carry(), first.added) + second.added).eval()};
}

Way way_between(const HeldVersion& edge, std::int64_t from, std::int64_t to) {
  std::vector<const Sample*> on_way;
  for (std::uint64_t number = edge.number + 1; number-- > edge.samples->oldest();) {
    const Sample* sample = edge.samples->sample(number);
    if (sample == nullptr || sample->stamp <= from) break;
    if (sample->stamp < to) on_way.push_back(sample);
  }
  const Covariance& density = edge.samples->timing().process_noise;
  Way way;
  Pose here = given_at(edge, from);
  std::int64_t now = from;
  const auto go = [&](const Pose& next, std::int64_t then) {
    way = way * step(density, here, next, then - now);
    here = next;
    now = then;
  };
  for (std::size_t i = on_way.size(); i-- > 0;) go(given(*on_way[i]).pose, on_way[i]->stamp);
  go(given_at(edge, to), to);
  return way;
}

Tied after_row(const RowOfSample& row, const Way& way) {
  return {row.X_PC.pose * way.increment, moved_by(way.carry(), own_of(row)) + way.added, false,
          times(way.carry(), row.correlation.common_errors)};
}

Tied before_row(const Way& way, const RowOfSample& row) {
  const Pose back = way.increment.inverse();
  const Matrix6d F = adjoint(way.increment);
  return {row.X_PC.pose * back, moved_by(F, own_of(row) + way.added), !way.added.isZero(0),
          times(F, row.correlation.common_errors)};
}

Tied between_rows(const RowOfSample& first, const Way& to, const Way& from,
                  const RowOfSample& second) {
  const Matrix6d F = from.carry();
  const Bridge bridge = bridged(to.added, F, from.added);
  const Matrix6d& K = bridge.K;
  const Matrix6d L = (Matrix6d::Identity() - K * F) * to.carry();
  const Pose forward = first.X_PC.pose * to.increment;
  const Twist missed = log((forward * from.increment).inverse() * second.X_PC.pose);
  Tied tied{forward * exp(Twist(K * missed)),
            bridge.rest + moved_by(L, own_of(first)) + moved_by(K, own_of(second)), false,
            times(L, first.correlation.common_errors)};
  add_errors(times(K, second.correlation.common_errors), tied.common_errors);
  return tied;
}

RowOfSample as_stored(const Sample& sample, std::size_t segment, const Correlation* said) {
  RowOfSample row{static_cast<std::uint32_t>(segment), time_of(sample.stamp), sample.value(), {}};
  const Correlation* correlation = correlation_at(sample, said);
  if (correlation == nullptr) return row;
  row.correlation.common_errors = correlation->common_errors;
  row.correlation.observed_with = correlation->observed_with;
  return row;
}

std::vector<CorrelatedValue> values_between(const HeldVersion& edge, std::uint64_t first,
                                            std::uint64_t second) {
  const RowOfSample begin = as_stored(*edge.samples->sample(first), 0, nullptr);
  const RowOfSample end = as_stored(*edge.samples->sample(second), 0, nullptr);
  std::vector<Way> left;  // to the second row, from the latest sample first
  for (std::uint64_t number = second; number-- > first + 1;) {
    const Way next = step(edge, number);
    left.push_back(left.empty() ? next : next * left.back());
  }
  std::vector<CorrelatedValue> values;
  Way done;
  for (std::uint64_t number = first; number + 1 < second; ++number) {
    done = done * step(edge, number);
    Tied tied = between_rows(begin, done, left.back(), end);
    left.pop_back();
    values.push_back({{tied.X_PC, Covariance::trusted(tied.own)},
                      {false, std::move(tied.common_errors), begin.correlation.observed_with}});
  }
  return values;
}

}  // namespace tfdude
