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

// Whether a joint that starts beside a position, by whole periods, has another pose there: one that
// mimics a continuous joint, unless its multiplier is a whole number.
bool jumps(const PreparedJoint& joint, double beside) {
  constexpr double kTurn = 2 * 3.14159265358979323846;
  constexpr double kRounding = 1e-6;
  if (std::abs(beside) <= kRounding) return false;
  return !joint.joint().S.head<3>().isZero(0) ||
         std::abs(std::remainder(beside, kTurn)) > kRounding;
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
    joint->compute(interpolate(before.at(), after.at(), s, joint->period()), X);
  } else {
    interpolate(before.value(), after.value(), s, X);
  }
}

void interpolate(const Sample& before, const Sample& after, double s, Pose& X) {
  if (const PreparedJoint* joint = joint_of(before, after)) {
    X = joint->pose(interpolate(before.at(), after.at(), s, joint->period()).position);
  } else {
    interpolate(before.value_pose(), after.value_pose(), s, X);
  }
}

void extrapolate(const Sample& before, const Sample& after, const Transform& X1, double s,
                 Transform& X) {
  if (const PreparedJoint* joint = joint_of(before, after)) {
    joint->compute(extrapolate(before.at(), after.at(), s, joint->period()), X);
  } else {
    X = extrapolate(before.value(), X1, s);
  }
}

void extrapolate(const Sample& before, const Sample& after, const Pose& X1, double s, Pose& X) {
  if (const PreparedJoint* joint = joint_of(before, after)) {
    X = joint->pose(extrapolate(before.at(), after.at(), s, joint->period()).position);
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
  const double start = start_of(before.at().position, after.at().position, joint->period());
  const std::int64_t span = after.stamp - before.stamp;
  if (span > 1 && jumps(*joint, start - before.at().position)) {
    instants.push_back(before.stamp + 1);
  }
  const double turn = std::abs(after.at().position - start) * joint->joint().S.tail<3>().norm();
  if (turn <= kFar) return instants;
  const auto parts = static_cast<std::int64_t>(std::min(std::ceil(turn / kFar), kMost));
  for (std::int64_t i = 1; i < parts && span >= parts; ++i) {
    instants.push_back(before.stamp + span / parts * i);
  }
  return instants;
}

}  // namespace tfdude
