#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "tfdude/math/transform.hpp"

#include "math/joint_state.hpp"
#include "math/path_accumulation.hpp"
#include "tree/arena.hpp"
#include "tree/shared_correlation.hpp"

namespace tfdude {

/// The stamp of a value that holds for all times.
inline constexpr std::int64_t kAlways = INT64_MIN;

/// The stamp of an edge that is declared dynamic, until its first sample: it has no value at any
/// instant. Only lookups of the newest value get what it was configured with.
inline constexpr std::int64_t kUnsampled = kAlways + 1;

/// The stamp of a dynamic edge whose history was cleared, until its next sample; earlier than those
/// of all samples.
inline constexpr std::int64_t kNoSample = kAlways + 2;

/// What consecutive samples share: their covariance, or the joint whose positions they are.
struct SharedPart {
  std::uint32_t samples = 0;  ///< that share it; for the writer only
  bool is_joint = false;
  bool is_revised = false;  ///< an observation has made it
  bool is_given = true;     ///< neither: a pose as it was given
};

/// Three cache lines.
struct alignas(64) SharedCovariance : SharedPart {
  SharedCovariance() = default;
  ~SharedCovariance() { set_revision(nullptr); }
  SharedCovariance(const SharedCovariance&) = delete;
  SharedCovariance& operator=(const SharedCovariance&) = delete;

  void set_revision(InArena<const SharedRevision> fresh) {
    const InArena<const SharedRevision> before(revision);
    revision = fresh.release();
  }

  StatedCovariance covariance;
  const SharedRevision* revision = nullptr;  ///< its own; null: as given
};
static_assert(sizeof(SharedCovariance) == 192);

struct SharedJoint : SharedPart {
  PreparedJoint joint;
};

/// A new value of an edge.
struct GivenValue {
  const Transform& X_PC;
  const JointState* state = nullptr;         ///< if a joint gives it
  const SampleRevision* revision = nullptr;  ///< if an observation does
};

/// A sample of an edge: a pose, or the position of a joint. Immutable once its commit is visible.
class Sample {
 public:
  // NOLINTBEGIN(cppcoreguidelines-pro-type-union-access): `shared` tells which of both it is
  Sample() : pose_() {}

  void set(const GivenValue& value) {
    if (value.state == nullptr) {
      pose_ = value.X_PC.pose;
    } else {
      at_ = value.state->at;
    }
  }
  [[nodiscard]] const Pose& pose() const { return pose_; }
  /// Of the joint.
  [[nodiscard]] const JointPosition& at() const { return at_; }
  // NOLINTEND(cppcoreguidelines-pro-type-union-access)

  /// Null: it is a pose.
  [[nodiscard]] const PreparedJoint* joint() const {
    return shared->is_joint ? &static_cast<const SharedJoint*>(shared)->joint : nullptr;
  }
  /// Of a pose.
  [[nodiscard]] const StatedCovariance& covariance() const {
    return static_cast<const SharedCovariance*>(shared)->covariance;
  }
  [[nodiscard]] TransformParts parts() const { return {&pose(), &covariance()}; }
  /// Whether it is a pose as it was given.
  [[nodiscard]] bool is_given_pose() const { return shared->is_given; }
  /// Null: it is as it was given.
  [[nodiscard]] const SharedRevision* revision() const {
    if (!shared->is_revised) return nullptr;
    return static_cast<const SharedCovariance*>(shared)->revision;
  }

  [[nodiscard]] Transform value() const;
  [[nodiscard]] Pose value_pose() const;
  [[nodiscard]] bool complete() const;

  std::int64_t stamp = 0;
  std::uint64_t commit = 0;  ///< that added it
  const SharedPart* shared = nullptr;

 private:
  union {
    Pose pose_;
    JointPosition at_;
  };
};

/// The value at the fraction s of the time between two consecutive samples: that of a position
/// between both, if both are positions of one joint; otherwise as interpolate() of their values.
void interpolate(const Sample& before, const Sample& after, double s, Transform& X);
void interpolate(const Sample& before, const Sample& after, double s, Pose& X);

/// The value beyond the second of them, at s of at least 1.
/// @param X1  that of `after`
void extrapolate(const Sample& before, const Sample& after, const Transform& X1, double s,
                 Transform& X);
void extrapolate(const Sample& before, const Sample& after, const Pose& X1, double s, Pose& X);

/// Instants between two samples, so close that interpolate() of the values at consecutive ones is
/// the value between them. None, unless both are positions of a joint that turns far, or jumps
/// after the first.
[[nodiscard]] std::vector<std::int64_t> instants_between(const Sample& before, const Sample& after);

/// Consecutive samples of one history.
struct SampleChunk {
  static constexpr std::uint64_t kSize = 8;

  std::uint64_t first = 0;  ///< number of the first of them
  std::array<Sample, kSize> samples;
};

}  // namespace tfdude
