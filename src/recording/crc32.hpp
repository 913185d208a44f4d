#pragma once

#include <cstdint>
#include <string_view>

namespace tfdude::recording {

/// The CRC of IEEE 802.3, which MCAP uses. Continues from the CRC of the bytes before.
[[nodiscard]] std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

}  // namespace tfdude::recording
