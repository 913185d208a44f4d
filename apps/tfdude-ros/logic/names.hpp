#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/result.hpp"
#include "tfdude/math/pose.hpp"

#include "../messages.hpp"
#include "types/ros_rules.hpp"

// What ROS's names and numbers are here.
namespace tfdude::ros {

/// Patterns of names: '*' stands for any characters, also none.
class Patterns {
 public:
  Patterns() = default;
  explicit Patterns(std::vector<std::string> patterns) : patterns_(std::move(patterns)) {}

  [[nodiscard]] bool empty() const { return patterns_.empty(); }
  [[nodiscard]] bool match(std::string_view name) const;

 private:
  std::vector<std::string> patterns_;
};

/// Which names are chosen: those that match `include` (empty: all) and not `exclude`.
struct Choice {
  Patterns include;
  Patterns exclude;

  [[nodiscard]] bool takes(std::string_view name) const {
    return (include.empty() || include.match(name)) && !exclude.match(name);
  }
};

/// The id of a frame of ROS: without leading slashes, with the prefix.
/// @return kInvalidInput naming the frame: as check_new_id().
[[nodiscard]] Result<std::string> id_of(std::string_view ros_name, const std::string& prefix);

/// The inverse. @return none for a frame without the prefix: it has no name in ROS
[[nodiscard]] std::optional<std::string> ros_name_of(std::string_view id, std::string_view prefix);

/// Whether ROS 2 accepts this as the name of a topic, absolute or not.
[[nodiscard]] bool is_topic(std::string_view name);

/// By the rules of recordings of ROS. @return kInvalidInput naming the field.
[[nodiscard]] Result<Pose> pose_of(const RosPose& pose);
[[nodiscard]] RosPose ros_pose_of(const Pose& pose);

}  // namespace tfdude::ros
