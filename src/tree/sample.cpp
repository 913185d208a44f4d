#include "tree/sample.hpp"

#include <algorithm>
#include <cmath>

#include "tfdude/math/interpolate.hpp"

namespace tfdude {
namespace {

// The joint whose positions both samples are; null: none.
const PreparedJoint* joint_of(const Sample& before, const Sample& after) {
  return before.shared == after.shared ? after.joint() : nullptr;
}

}  // namespace

Transform Sample::value() const {
  const PreparedJoint* moved_by = joint();
  if (moved_by == nullptr) return {pose(), covariance()};
  Transform X;
  moved_by->compute(at(), X);
  return X;
}

Pose Sample::value_pose() const {
  const PreparedJoint* moved_by = joint();
  return moved_by != nullptr ? moved_by->pose(at().position) : pose();
}

bool Sample::complete() const {
  const PreparedJoint* moved_by = joint();
  if (moved_by == nullptr) return covariance().complete();
  return at().stated() && moved_by->joint().X_PJ.covariance.complete();
}

void interpolate(const Sample& before, const Sample& after, double s, Transform& X) {
  if (const PreparedJoint* joint = joint_of(before, after)) {
    joint->compute(interpolate(before.at(), after.at(), s), X);
  } else {
    interpolate(before.value(), after.value(), s, X);
  }
}

void interpolate(const Sample& before, const Sample& after, double s, Pose& X) {
  if (const PreparedJoint* joint = joint_of(before, after)) {
    X = joint->pose(interpolate(before.at(), after.at(), s).position);
  } else {
    interpolate(before.value_pose(), after.value_pose(), s, X);
  }
}

void extrapolate(const Sample& before, const Sample& after, const Transform& X1, double s,
                 Transform& X) {
  if (const PreparedJoint* joint = joint_of(before, after)) {
    joint->compute(extrapolate(before.at(), after.at(), s), X);
  } else {
    X = extrapolate(before.value(), X1, s);
  }
}

void extrapolate(const Sample& before, const Sample& after, const Pose& X1, double s, Pose& X) {
  if (const PreparedJoint* joint = joint_of(before, after)) {
    X = joint->pose(extrapolate(before.at(), after.at(), s).position);
  } else {
    X = extrapolate(before.value_pose(), X1, s);
  }
}

std::vector<std::int64_t> instants_between(const Sample& before, const Sample& after) {
  constexpr double kFar = 2.0;  // [rad]: well below half a turn, where interpolate() is ambiguous
  constexpr double kMost = 256;
  std::vector<std::int64_t> instants;
  const PreparedJoint* joint = joint_of(before, after);
  if (joint == nullptr) return instants;
  const double turn =
      std::abs(after.at().position - before.at().position) * joint->joint().S.tail<3>().norm();
  if (turn <= kFar) return instants;
  const auto parts = static_cast<std::int64_t>(std::min(std::ceil(turn / kFar), kMost));
  const std::int64_t span = after.stamp - before.stamp;
  for (std::int64_t i = 1; i < parts && span >= parts; ++i) {
    instants.push_back(before.stamp + span / parts * i);
  }
  return instants;
}

}  // namespace tfdude
