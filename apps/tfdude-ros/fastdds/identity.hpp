#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "../ros_domain.hpp"
#include "transport/fastdds/compat.hpp"

namespace tfdude::ros {

/// As `ros2 topic info --verbose` prints it: "01.0f.2a.9c.0e.2d.c5.1f.01.00.00.00.00.00.12.03".
[[nodiscard]] std::string text_of(const fastdds::ertps::GUID_t& guid);

/// The mark as the user data of a participant, in the form of ROS 2's own "enclave=/;".
[[nodiscard]] std::vector<std::uint8_t> user_data_of(const BridgeMark& mark);
/// @return none if the user data has no mark.
[[nodiscard]] std::optional<BridgeMark> mark_of(const std::vector<std::uint8_t>& user_data);

}  // namespace tfdude::ros
