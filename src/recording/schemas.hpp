#pragma once

#include <array>
#include <cstdint>
#include <string_view>

// The topics of a recording and their types, each described in full (ros2msg).
namespace tfdude::recording {

enum class Topic : std::uint8_t { kTf, kTfStatic, kKeyframe, kFrames, kValues, kJoints, kEvents };

struct TopicType {
  Topic topic;
  std::string_view name;
  std::string_view type;
  std::string_view definition;
  std::string_view qos;  ///< for players of ROS 2; empty: the default
};

/// In the order of Topic.
[[nodiscard]] const std::array<TopicType, 7>& topic_types();

}  // namespace tfdude::recording
