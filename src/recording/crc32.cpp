#include "recording/crc32.hpp"

#include <array>

namespace tfdude::recording {
namespace {

constexpr std::size_t kSlices = 8;
using Tables = std::array<std::array<std::uint32_t, 256>, kSlices>;

// Table k has the CRC of a byte that is followed by k zero bytes.
Tables make_tables() {
  Tables tables{};
  for (std::uint32_t i = 0; i < 256; ++i) {
    std::uint32_t crc = i;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
    tables[0][i] = crc;
  }
  for (std::size_t k = 1; k < kSlices; ++k) {
    for (std::size_t i = 0; i < 256; ++i) {
      const std::uint32_t crc = tables[k - 1][i];
      tables[k][i] = (crc >> 8U) ^ tables[0][crc & 0xFFU];
    }
  }
  return tables;
}

}  // namespace

// Eight bytes at a time ("slicing by 8", Kounavis & Berry 2005).
std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  static const Tables tables = make_tables();
  const auto byte = [](char c) { return std::uint32_t{static_cast<std::uint8_t>(c)}; };
  std::uint32_t crc = ~before;
  while (bytes.size() >= kSlices) {
    std::uint32_t next = 0;
    for (std::size_t i = 0; i < kSlices; ++i) {
      const std::uint32_t mixed = i < 4 ? (crc >> (8 * i)) & 0xFFU : 0U;
      next ^= tables[kSlices - 1 - i][mixed ^ byte(bytes[i])];
    }
    crc = next;
    bytes.remove_prefix(kSlices);
  }
  for (const char c : bytes) crc = (crc >> 8U) ^ tables[0][(crc ^ byte(c)) & 0xFFU];
  return ~crc;
}

}  // namespace tfdude::recording
