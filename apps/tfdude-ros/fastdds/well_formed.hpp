#pragma once

#include <cstddef>
#include <cstdint>

// Whether the bytes of a DDS sample are well formed: every length within the bytes present. The
// generated code checks nothing, and allocates whatever size a length says.
namespace tfdude::ros {

[[nodiscard]] bool well_formed_tf(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_joint_state(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_string(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_pose(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_odometry(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_nav_sat_fix(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_geo_pose(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_detections(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_tags(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_markers(const std::uint8_t* data, std::size_t size);
[[nodiscard]] bool well_formed_clock(const std::uint8_t* data, std::size_t size);

/// How many samples were not, in this process.
[[nodiscard]] std::uint64_t malformed_samples();

}  // namespace tfdude::ros
