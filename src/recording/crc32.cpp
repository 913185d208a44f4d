#include "recording/crc32.hpp"

#include <array>

namespace tfdude::recording {
namespace {

constexpr std::size_t kSlices = 16;
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

// Eight bytes, the first of which is the lowest.
std::uint64_t word_at(const char* bytes) {
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    word |= std::uint64_t{static_cast<std::uint8_t>(bytes[i])} << (8 * i);
  }
  return word;
}

}  // namespace

// Sixteen bytes at a time ("slicing by 8", Kounavis & Berry 2005, twice).
std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  static const Tables tables = make_tables();
  std::uint32_t crc = ~before;
  while (bytes.size() >= kSlices) {
    const std::uint64_t first = word_at(bytes.data()) ^ crc;
    const std::uint64_t second = word_at(bytes.data() + 8);
    std::uint32_t next = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      next ^= tables[15 - i][(first >> (8 * i)) & 0xFFU];
      next ^= tables[7 - i][(second >> (8 * i)) & 0xFFU];
    }
    crc = next;
    bytes.remove_prefix(kSlices);
  }
  const auto byte = [](char c) { return std::uint32_t{static_cast<std::uint8_t>(c)}; };
  for (const char c : bytes) crc = (crc >> 8U) ^ tables[0][(crc ^ byte(c)) & 0xFFU];
  return ~crc;
}

}  // namespace tfdude::recording
