#pragma once

// The names of the DDS topics. They are not with the transport, because permissions name them, too.
namespace tfdude {

inline constexpr const char* kRequestTopic = "tfdude/request";  ///< requests that change nothing
inline constexpr const char* kChangeTopic = "tfdude/change";    ///< requests that change something
inline constexpr const char* kReplyTopic = "tfdude/reply";
inline constexpr const char* kUpdateTopic = "tfdude/update";
inline constexpr const char* kJointTopic = "tfdude/joint";
inline constexpr const char* kStateTopic = "tfdude/state";
inline constexpr const char* kClockTopic = "tfdude/clock";  ///< the time of external clocks
inline constexpr const char* kDirectoryTopic = "tfdude/directory";
inline constexpr const char* kPresenceTopic = "tfdude/presence";

}  // namespace tfdude
