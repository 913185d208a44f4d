#pragma once

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"
#include "tfdude/math/conversions.hpp"
#include "tfdude/math/perturbation.hpp"
#include "tfdude/math/ros_variances.hpp"

// tf2's exceptions, times and conversions for tfdude/tf2.hpp. Messages are the caller's: whatever
// has the members of the messages of ROS 1 or ROS 2.
namespace tfdude::tf2 {

class TransformException : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
class ConnectivityException : public TransformException {
  using TransformException::TransformException;
};
class LookupException : public TransformException {
  using TransformException::TransformException;
};
class ExtrapolationException : public TransformException {
  using TransformException::TransformException;
};
class InvalidArgumentException : public TransformException {
  using TransformException::TransformException;
};
class TimeoutException : public TransformException {
  using TransformException::TransformException;
};

using Duration = std::chrono::nanoseconds;
using TimePoint = Time;
/// Asks for the newest, as any time that is zero.
inline constexpr TimePoint TimePointZero{};

[[nodiscard]] inline Duration durationFromSec(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}
[[nodiscard]] inline TimePoint timeFromSec(double seconds) {
  return TimePoint(durationFromSec(seconds));
}
[[nodiscard]] inline double durationToSec(const Duration& duration) {
  return std::chrono::duration<double>(duration).count();
}
[[nodiscard]] inline double timeToSec(const TimePoint& time) {
  return durationToSec(time.time_since_epoch());
}

// How the parts of messages are told from each other: by their members.
namespace detail {

/// Whether an expression of T compiles.
template <class, template <class> class Expression, class = void>
struct Has : std::false_type {};
template <class T, template <class> class Expression>
struct Has<T, Expression, std::void_t<Expression<T>>> : std::true_type {};

template <class T>
using Nanosec = decltype(std::declval<T&>().sec, std::declval<T&>().nanosec);  // ROS 2
template <class T>
using Nsec = decltype(std::declval<T&>().sec, std::declval<T&>().nsec);  // ROS 1
template <class T>
using Nanoseconds = decltype(std::declval<const T&>().nanoseconds());  // rclcpp
template <class T>
using ToNSec = decltype(std::declval<const T&>().toNSec());  // ROS 1
template <class T>
using ToSec = decltype(std::declval<const T&>().toSec());
template <class T>
using SinceEpoch = decltype(std::declval<const T&>().time_since_epoch());
template <class T>
using Header = decltype(std::declval<T&>().header.stamp, std::declval<T&>().header.frame_id);
template <class T>
using PointMember = decltype(std::declval<T&>().point.x);
template <class T>
using VectorMember = decltype(std::declval<T&>().vector.x);
template <class T>
using QuaternionMember = decltype(std::declval<T&>().quaternion.w);
template <class T>
using PoseMember = decltype(std::declval<T&>().pose.position, std::declval<T&>().pose.orientation);
template <class T>
using BelievedPose =
    decltype(std::declval<T&>().pose.pose.position, std::declval<T&>().pose.covariance[0]);
template <class T>
using PlainPose = decltype(std::declval<T&>().position.x, std::declval<T&>().orientation.w);
template <class T>
using Stamped = decltype(std::declval<T&>().child_frame_id, std::declval<T&>().transform.rotation.w,
                         std::declval<T&>().header.stamp);

// Parts of messages by themselves.
template <class T>
using Xyz =
    decltype(std::declval<T&>().x = 0.0, std::declval<T&>().y = 0.0, std::declval<T&>().z = 0.0);
template <class T>
using W = decltype(std::declval<T&>().w = 0.0);
template <class T>
using TransformItself = decltype(std::declval<T&>().translation.x, std::declval<T&>().rotation.w);
template <class T>
using HeaderItself = decltype(std::declval<T&>().stamp, std::declval<T&>().frame_id);

template <class T>
inline constexpr bool kUnknown = false;

/// A duration or the time since the epoch.
template <class T>
[[nodiscard]] Duration nanoseconds_of(const T& time) {
  using std::chrono::duration_cast;
  if constexpr (Has<T, SinceEpoch>::value) {
    return duration_cast<Duration>(time.time_since_epoch());
  } else if constexpr (std::is_convertible_v<T, Duration>) {
    return time;
  } else if constexpr (Has<T, Nanoseconds>::value) {
    return Duration(time.nanoseconds());
  } else if constexpr (Has<T, ToNSec>::value) {
    return Duration(static_cast<std::int64_t>(time.toNSec()));
  } else if constexpr (Has<T, Nanosec>::value) {
    return std::chrono::seconds(time.sec) + Duration(time.nanosec);
  } else if constexpr (Has<T, Nsec>::value) {
    return std::chrono::seconds(time.sec) + Duration(time.nsec);
  } else if constexpr (std::is_arithmetic_v<T>) {
    return durationFromSec(static_cast<double>(time));
  } else {
    static_assert(kUnknown<T>, "not a time: neither std::chrono's, nor one of ROS 1 or ROS 2");
  }
}

template <class Stamp>
void set_stamp(Stamp& stamp, Time time) {
  const Duration since = time.time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(since);
  if constexpr (Has<Stamp, Nanosec>::value) {
    stamp.sec = static_cast<decltype(stamp.sec)>(seconds.count());
    stamp.nanosec = static_cast<decltype(stamp.nanosec)>((since - seconds).count());
  } else if constexpr (Has<Stamp, Nsec>::value) {
    stamp.sec = static_cast<decltype(stamp.sec)>(seconds.count());
    stamp.nsec = static_cast<decltype(stamp.nsec)>((since - seconds).count());
  } else {
    stamp = Stamp(since);
  }
}

template <class Vector>
[[nodiscard]] Eigen::Vector3d vector_of(const Vector& vector) {
  return {vector.x, vector.y, vector.z};
}
template <class Vector>
void set_vector(Vector& vector, const Eigen::Vector3d& value) {
  vector.x = value.x();
  vector.y = value.y();
  vector.z = value.z();
}
template <class Quaternion>
[[nodiscard]] Eigen::Quaterniond rotation_of(const Quaternion& q) {
  return Eigen::Quaterniond(q.w, q.x, q.y, q.z);
}
template <class Quaternion>
void set_rotation(Quaternion& quaternion, const Eigen::Quaterniond& value) {
  quaternion.x = value.x();
  quaternion.y = value.y();
  quaternion.z = value.z();
  quaternion.w = value.w();
}

/// Of tf2's tolerance; what is no rotation is an error, as in tf2.
[[nodiscard]] inline Pose pose_of(const Eigen::Quaterniond& rotation,
                                  const Eigen::Vector3d& translation) {
  constexpr double kTolerance = 1e-2;
  if (!(std::abs(rotation.squaredNorm() - 1) < kTolerance)) {
    throw InvalidArgumentException("the quaternion is not of unit length");
  }
  const auto pose = Pose::create(rotation.normalized(), translation);
  if (!pose) throw InvalidArgumentException(pose.error().message);
  return *pose;
}
template <class Message>
[[nodiscard]] Pose pose_of(const Message& pose) {
  return pose_of(rotation_of(pose.orientation), vector_of(pose.position));
}
template <class Message>
void set_pose(Message& pose, const Pose& value) {
  set_vector(pose.position, value.translation());
  set_rotation(pose.orientation, value.rotation());
}

[[noreturn]] inline void raise(const Error& error) {
  switch (error.code) {
    case Errc::kUnknownFrame:
    case Errc::kUnknownStart:
    case Errc::kUnknownEnd:
    case Errc::kUnknownParent:
      throw LookupException(error.message);
    case Errc::kNotConnected:
      throw ConnectivityException(error.message);
    case Errc::kNotYet:
    case Errc::kTooOld:
      throw ExtrapolationException(error.message);
    case Errc::kInvalidInput:
      throw InvalidArgumentException(error.message);
    case Errc::kTimeout:
      throw TimeoutException(error.message);
    default:
      throw TransformException(error.message);
  }
}

}  // namespace detail

/// What a lookup returns. It has the members of geometry_msgs' TransformStamped. It and each of its
/// parts convert to the caller's types of them.
struct TransformStamped {
  struct Stamp {
    std::int32_t sec = 0;
    std::uint32_t nanosec = 0;

    template <class T, class = std::enable_if_t<detail::Has<T, detail::Nanosec>::value ||
                                                detail::Has<T, detail::Nsec>::value>>
    operator T() const {  // NOLINT(google-explicit-constructor): it is one
      T stamp;
      detail::set_stamp(stamp, Time(detail::nanoseconds_of(*this)));
      return stamp;
    }
  };
  struct Header {
    Stamp stamp;
    std::string frame_id;

    template <class T, class = std::enable_if_t<detail::Has<T, detail::HeaderItself>::value>>
    operator T() const {  // NOLINT(google-explicit-constructor): it is one
      T header;
      detail::set_stamp(header.stamp, Time(detail::nanoseconds_of(stamp)));
      header.frame_id = frame_id;
      return header;
    }
  };
  struct Vector3 {
    double x = 0;
    double y = 0;
    double z = 0;

    template <class T, class = std::enable_if_t<detail::Has<T, detail::Xyz>::value &&
                                                !detail::Has<T, detail::W>::value>>
    operator T() const {  // NOLINT(google-explicit-constructor): it is one, or a point
      T vector;
      detail::set_vector(vector, detail::vector_of(*this));
      return vector;
    }
  };
  struct Quaternion {
    double x = 0;
    double y = 0;
    double z = 0;
    double w = 1;

    template <class T, class = std::enable_if_t<detail::Has<T, detail::Xyz>::value &&
                                                detail::Has<T, detail::W>::value>>
    operator T() const {  // NOLINT(google-explicit-constructor): it is one
      T quaternion;
      detail::set_rotation(quaternion, detail::rotation_of(*this));
      return quaternion;
    }
  };
  struct Parts {
    Vector3 translation;
    Quaternion rotation;

    template <class T, class = std::enable_if_t<detail::Has<T, detail::TransformItself>::value>>
    operator T() const {  // NOLINT(google-explicit-constructor): it is a transform
      T transform;
      detail::set_vector(transform.translation, detail::vector_of(translation));
      detail::set_rotation(transform.rotation, detail::rotation_of(rotation));
      return transform;
    }
  };

  Header header;
  std::string child_frame_id;
  Parts transform;
  StatedCovariance covariance;  ///< of the right perturbation; tf2 has none

  template <class Message, class = std::enable_if_t<detail::Has<Message, detail::Stamped>::value>>
  operator Message() const {  // NOLINT(google-explicit-constructor): it is one
    Message message;
    message.header = header;
    message.child_frame_id = child_frame_id;
    message.transform = transform;
    return message;
  }
};

/// X_AB of a TransformStamped, of its transform, or of anything with the members of either.
template <class Message>
[[nodiscard]] Eigen::Isometry3d transformToEigen(const Message& message) {
  if constexpr (detail::Has<Message, detail::TransformItself>::value) {
    return to_isometry(detail::pose_of(detail::rotation_of(message.rotation),
                                       detail::vector_of(message.translation)));
  } else {
    return transformToEigen(message.transform);
  }
}

/// Brings a message to the frame of a transform. `out` may be `in`. Messages with a header get that
/// of the transform; a pose without one is only moved. Covariance of a pose is turned, as in tf2,
/// and that of the transform is added if it is known. Variances that are no numbers mean what they
/// mean to the bridge (docs/ros.md).
template <class Message, class Transform>
void doTransform(const Message& in, Message& out, const Transform& transform) {
  using namespace detail;
  const Pose X_AB = detail::pose_of(rotation_of(transform.transform.rotation),
                                    vector_of(transform.transform.translation));
  if (&out != &in) out = in;
  if constexpr (Has<Message, BelievedPose>::value) {
    std::array<double, 36> numbers{};
    std::copy_n(in.pose.covariance.begin(), numbers.size(), numbers.begin());
    const auto X_BC = ros::with_ros_covariance(detail::pose_of(in.pose.pose), {}, numbers);
    if (!X_BC) throw InvalidArgumentException(X_BC.error().message);
    tfdude::Transform X_AC{X_AB * X_BC->pose, {}};
    // Numbers that say that it is not specified stay.
    if (X_BC->covariance.complete()) {
      tfdude::Transform X{X_AB, StatedCovariance::exact()};
      if constexpr (std::is_same_v<Transform, TransformStamped>) {
        if (transform.covariance.complete()) X.covariance = transform.covariance;
      }
      X_AC = compose(X, *X_BC);
      const Matrix6d sigma = ros_covariance(X_AC).of_specified().matrix();  // symmetric
      std::copy_n(sigma.data(), numbers.size(), out.pose.covariance.begin());
    }
    set_pose(out.pose.pose, X_AC.pose);
  } else if constexpr (Has<Message, PoseMember>::value) {
    set_pose(out.pose, X_AB * detail::pose_of(in.pose));
  } else if constexpr (Has<Message, PlainPose>::value) {
    set_pose(out, X_AB * detail::pose_of(in));
  } else if constexpr (Has<Message, PointMember>::value) {
    set_vector(out.point, X_AB * vector_of(in.point));
  } else if constexpr (Has<Message, VectorMember>::value) {
    set_vector(out.vector, X_AB.rotation() * vector_of(in.vector));
  } else if constexpr (Has<Message, QuaternionMember>::value) {
    set_rotation(out.quaternion, X_AB.rotation() * rotation_of(in.quaternion));
  } else if constexpr (Has<Message, Stamped>::value) {
    const Pose X_BC =
        detail::pose_of(rotation_of(in.transform.rotation), vector_of(in.transform.translation));
    set_vector(out.transform.translation, (X_AB * X_BC).translation());
    set_rotation(out.transform.rotation, (X_AB * X_BC).rotation());
  } else {
    static_assert(kUnknown<Message>,
                  "not a message that is known here: points, vectors, quaternions, poses, "
                  "transforms");
  }
  if constexpr (Has<Message, Header>::value) {
    set_stamp(out.header.stamp, Time(nanoseconds_of(transform.header.stamp)));
    out.header.frame_id = transform.header.frame_id;
  }
}

}  // namespace tfdude::tf2
