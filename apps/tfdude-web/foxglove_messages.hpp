#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/base/time.hpp"
#include "tfdude/math/transform.hpp"

// Messages in the formats of Foxglove and Lichtblick.
namespace tfdude::web::foxglove {

/// An edge's value at an instant.
struct Edge {
  std::string parent;
  std::string child;
  Time stamp;
  Pose X_PC;
};

/// An ellipsoid of position: where the frame is with k = 3.
struct Ellipsoid {
  std::string root;  ///< in which the rest is given
  std::string frame;
  Transform X_RF;
};

/// foxglove.FrameTransforms in JSON.
[[nodiscard]] std::string frame_transforms(const std::vector<Edge>& edges);
/// tf2_msgs/msg/TFMessage in CDR, little-endian.
[[nodiscard]] std::string tf_message(const std::vector<Edge>& edges);
/// foxglove.SceneUpdate in JSON: a sphere of the right axes for each ellipsoid.
/// @param all  what was sent before is deleted first
[[nodiscard]] std::string scene_update(const std::vector<Ellipsoid>& ellipsoids, Time now,
                                       bool all);
/// foxglove.Log in JSON.
[[nodiscard]] std::string log_message(Time time, bool warning, const std::string& name,
                                      const std::string& message);

/// Binary message 1 to a client: data of a subscription.
[[nodiscard]] std::string message_data(std::uint32_t subscription, Time time,
                                       std::string_view data);

/// The schemas of the above, as channels name them.
[[nodiscard]] nlohmann::json channel(std::uint32_t id, const std::string& topic,
                                     const std::string& schema);
inline constexpr const char* kFrameTransforms = "foxglove.FrameTransforms";
inline constexpr const char* kSceneUpdate = "foxglove.SceneUpdate";
inline constexpr const char* kLog = "foxglove.Log";
inline constexpr const char* kTfMessage = "tf2_msgs/msg/TFMessage";
inline constexpr const char* kPairSchema = "tfdude.Pair";

}  // namespace tfdude::web::foxglove
