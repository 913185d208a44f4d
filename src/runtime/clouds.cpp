#include <algorithm>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "tfdude/base/id.hpp"
#include "tfdude/math/point.hpp"

#include "math/cloud_map.hpp"
#include "runtime/after_wait.hpp"
#include "runtime/many_lookups.hpp"
#include "types/trajectory_builder.hpp"

// Clouds of points: which transforms they need, and the points themselves.
namespace tfdude {
namespace {

// How often a trajectory is read while an edge changes that it may have, before each instant is
// asked for by itself.
constexpr int kMostTries = 3;

// Stamps that are looked up as one.
struct Groups {
  std::vector<Time> instants;
  std::vector<std::uint32_t> of_point;
};

Groups groups_of(const std::vector<Time>& stamps, std::chrono::nanoseconds length) {
  struct Span {
    std::int64_t first;
    std::int64_t last;
  };
  std::vector<Span> spans;
  std::unordered_map<std::int64_t, std::uint32_t> known;
  Groups groups;
  groups.of_point.reserve(stamps.size());
  std::int64_t key = 0;
  std::uint32_t group = 0;
  for (const Time stamp : stamps) {
    const std::int64_t t = nanoseconds(stamp);
    const std::int64_t of_this = length.count() > 0 ? t / length.count() : t;
    if (spans.empty() || of_this != key) {  // mostly as the point before
      key = of_this;
      group = known.try_emplace(key, static_cast<std::uint32_t>(spans.size())).first->second;
      if (group == spans.size()) spans.push_back({t, t});
    }
    spans[group] = {std::min(spans[group].first, t), std::max(spans[group].last, t)};
    groups.of_point.push_back(group);
  }
  for (const Span& span : spans) {
    groups.instants.push_back(time_of(span.first + (span.last - span.first) / 2));
  }
  return groups;
}

Result<void> check(const CloudQuery& query, Eigen::Index points) {
  if (query.lookup.order != Order::kSecond) {
    return fail(Errc::kInvalidInput, "the covariances of a cloud are of second order only");
  }
  if (!query.stamps.empty() && query.stamps.size() != static_cast<std::size_t>(points)) {
    return fail(Errc::kInvalidInput, std::to_string(points) + " points, but " +
                                         std::to_string(query.stamps.size()) + " stamps");
  }
  if (query.stamps.empty() && !query.fixed.empty()) {
    return fail(Errc::kInvalidInput, "a fixed frame is for points with stamps");
  }
  if (!query.stamps.empty() && query.fixed.empty() && query.lookup.at) {
    return fail(Errc::kInvalidInput, "points with stamps of their own, and one for all of them");
  }
  if (query.group < std::chrono::nanoseconds(0)) {
    return fail(Errc::kInvalidInput, "a group of stamps has a length of at least zero");
  }
  Point own;
  own.covariance = query.own;
  return check_point(own);
}

}  // namespace

// The pose of the fixed frame in a is the same for all points. Their covariances are not: what the
// two ways to the fixed frame have in common counts once.
Result<ManyLookups::CloudPoses> ManyLookups::over_fixed(std::string_view a, std::string_view b,
                                                        const CloudQuery& query,
                                                        const std::vector<Time>& instants) {
  Query at_a = query.lookup;
  if (!at_a.at) at_a.at = *std::max_element(instants.begin(), instants.end());
  if (!query.covariances) {
    auto poses = poses_over_fixed(a, b, query, at_a, instants);
    if (poses || poses.error().code != Errc::kChangedMeanwhile) return poses;
  }
  CloudPoses poses;
  for (const Time instant : instants) {
    Query at_b = query.lookup;
    at_b.at = instant;
    const auto X_AB = two_instants_.lookup(std::string(a), at_a, std::string(b), at_b, query.fixed,
                                           discovery_.call_deadline());
    if (!X_AB) return tl::unexpected(X_AB.error());
    poses.X_AB.push_back(*X_AB);
    poses.complete = poses.complete && X_AB->covariance.complete();
    TrajectoryBuilder::merge(X_AB->basis, poses.basis);
  }
  return poses;
}

// What is the same before and after the trajectory is read was so meanwhile: no point has one way
// from before a change and the other one from after it.
Result<ManyLookups::CloudPoses> ManyLookups::poses_over_fixed(std::string_view a,
                                                              std::string_view b,
                                                              const CloudQuery& query,
                                                              const Query& at_a,
                                                              const std::vector<Time>& instants) {
  const std::string_view fixed = query.fixed;
  auto X_AF = lookups_.lookup(a, fixed, at_a);
  for (int tries = 0; X_AF && tries < kMostTries; ++tries) {
    const auto X_FB = trajectory_once(fixed, b, instants, query.lookup);
    if (!X_FB) return tl::unexpected(X_FB.error());
    if (!X_FB->missing.empty()) return tl::unexpected(X_FB->missing.front().error);
    const auto before = std::exchange(X_AF, lookups_.lookup(a, fixed, at_a));
    if (!X_AF || X_AF->pose.matrix() != before->pose.matrix()) continue;
    CloudPoses poses;
    poses.complete = X_AF->covariance.complete();
    poses.basis = X_AF->basis;
    TrajectoryBuilder::merge(X_FB->basis, poses.basis);
    for (const auto& one : X_FB->X_AB) {
      poses.X_AB.push_back({X_AF->pose * one->pose, StatedCovariance()});
      poses.complete = poses.complete && one->covariance.complete();
    }
    return poses;
  }
  if (!X_AF) return tl::unexpected(std::move(X_AF.error()));
  return fail(Errc::kChangedMeanwhile,
              "edges between " + quote(a) + " and " + quote(fixed) + " are changed all the time");
}

Result<ManyLookups::CloudPoses> ManyLookups::poses_of(std::string_view a, std::string_view b,
                                                      const CloudQuery& query, Milliseconds wait) {
  CloudPoses poses;
  if (query.stamps.empty()) {
    auto X_AB = wait > Milliseconds(0) ? lookups_.wait(a, b, query.lookup, wait)
                                       : lookups_.lookup(a, b, query.lookup);
    if (!X_AB) return tl::unexpected(std::move(X_AB.error()));
    poses.X_AB.push_back(*X_AB);
    poses.complete = X_AB->covariance.complete();
    poses.basis = std::move(X_AB->basis);
    return poses;
  }
  Groups groups = groups_of(query.stamps, query.group);
  if (!query.fixed.empty()) {
    const auto ready = [&](Milliseconds left) {
      const Deadline deadline(left);
      const auto last = std::max_element(groups.instants.begin(), groups.instants.end());
      Query then = query.lookup;
      then.at = std::max(*last, query.lookup.at.value_or(*last));
      auto found = lookups_.wait(query.fixed, a, then, left);
      if (found) found = lookups_.wait(query.fixed, b, then, deadline.left());
      return found;
    };
    auto found =
        after_wait(lookups_, wait, ready, [&] { return over_fixed(a, b, query, groups.instants); });
    if (found) found->of_point = std::move(groups.of_point);
    return found;
  }
  auto found = trajectory(a, b, groups.instants, query.lookup, wait);
  if (!found) return tl::unexpected(std::move(found.error()));
  if (!found->missing.empty()) return tl::unexpected(std::move(found->missing.front().error));
  for (const auto& one : found->X_AB) {
    poses.X_AB.push_back(*one);
    poses.complete = poses.complete && one->covariance.complete();
  }
  poses.basis = std::move(found->basis);
  poses.of_point = std::move(groups.of_point);
  return poses;
}

template <class Number>
Result<TransformedCloud<Number>> ManyLookups::transform_cloud(
    std::string_view a, std::string_view b,
    const Eigen::Ref<const Eigen::Matrix<Number, 3, Eigen::Dynamic>>& points,
    const CloudQuery& query, Milliseconds wait) {
  if (auto ok = check(query, points.cols()); !ok) return tl::unexpected(std::move(ok.error()));
  const auto poses = poses_of(a, b, query, wait);
  if (!poses) return tl::unexpected(poses.error());
  TransformedCloud<Number> cloud;
  cloud.basis = poses->basis;
  cloud.complete = poses->complete;
  cloud.points.resize(3, points.cols());
  if (query.covariances) cloud.covariances.resize(6, points.cols());
  // Columns one after the other in memory.
  Eigen::Matrix<Number, 3, Eigen::Dynamic> packed;
  if (points.outerStride() != 3) packed = points;
  const Number* from = packed.size() > 0 ? packed.data() : points.data();
  std::vector<cloud::Map> maps;
  for (const Transform& X : poses->X_AB) {
    maps.push_back(query.covariances ? cloud::map_of(X, query.own) : cloud::map_of(X.pose));
  }
  // Points of one transform that follow each other.
  const auto count = static_cast<std::size_t>(points.cols());
  for (std::size_t i = 0; i < count;) {
    std::size_t end = count;
    const auto& of_point = poses->of_point;
    if (!of_point.empty()) {
      end = i + 1;
      while (end < count && of_point[end] == of_point[i]) ++end;
    }
    cloud::transform_points(maps[of_point.empty() ? 0 : of_point[i]], from + 3 * i, end - i,
                            cloud.points.data() + 3 * i,
                            query.covariances ? cloud.covariances.data() + 6 * i : nullptr);
    i = end;
  }
  return cloud;
}

template Result<TransformedCloud<double>> ManyLookups::transform_cloud(
    std::string_view a, std::string_view b, const Eigen::Ref<const Eigen::Matrix3Xd>& points,
    const CloudQuery& query, Milliseconds wait);
template Result<TransformedCloud<float>> ManyLookups::transform_cloud(
    std::string_view a, std::string_view b, const Eigen::Ref<const Eigen::Matrix3Xf>& points,
    const CloudQuery& query, Milliseconds wait);

}  // namespace tfdude
