#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "tfdude/base/time.hpp"
#include "tfdude/math/pose.hpp"

#include "base/cdr.hpp"

// tf2_msgs/msg/TFMessage, in recordings and on the page. Inline, as ros_rules.hpp.
namespace tfdude::ros {

inline constexpr std::string_view kTfType = "tf2_msgs/msg/TFMessage";

/// Its text, as a recording has it (ros2msg).
inline constexpr std::string_view kTfDefinition = R"(geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
Transform transform
================================================================================
MSG: geometry_msgs/Transform
Vector3 translation
Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
)";

/// Writes a TFMessage, one transform after the other.
class TfEncoder {
 public:
  /// @param out  replaced by the message
  explicit TfEncoder(std::string& out) : writer_(out), count_place_(writer_.later()) {}

  void add(std::string_view parent, std::string_view child, const Pose& X_PC, Time stamp) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    ++count_;
    const std::int64_t ns = nanoseconds(stamp);
    writer_.u32(static_cast<std::uint32_t>(ns / kSecond));
    writer_.u32(static_cast<std::uint32_t>(ns % kSecond));
    writer_.text(parent);
    writer_.text(child);
    writer_.f64s(X_PC.translation());
    const Eigen::Quaterniond& q = X_PC.rotation();
    for (const double number : {q.x(), q.y(), q.z(), q.w()}) writer_.f64(number);
  }
  [[nodiscard]] std::uint32_t count() const { return count_; }
  void finish() {
    writer_.set(count_place_, count_);
    writer_.finish();
  }

 private:
  CdrWriter writer_;
  std::size_t count_place_;
  std::uint32_t count_ = 0;
};

}  // namespace tfdude::ros
