#pragma once

#include <cstdint>
#include <string_view>
#include <zlib.h>

namespace tfdude::recording {

/// The CRC of IEEE 802.3, which MCAP uses. Continues from the CRC of the bytes before.
[[nodiscard]] inline std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0) {
  const auto* data = reinterpret_cast<const Bytef*>(bytes.data());
  return static_cast<std::uint32_t>(::crc32_z(before, data, bytes.size()));
}

}  // namespace tfdude::recording
