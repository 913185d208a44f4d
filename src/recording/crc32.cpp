#include "recording/crc32.hpp"

#include <array>
#include <cstring>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

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

// Sixteen bytes at a time ("slicing by 8", Kounavis & Berry 2005, twice).
std::uint32_t by_tables(std::string_view bytes, std::uint32_t crc) {
  static const Tables tables = make_tables();
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
  return crc;
}

#if defined(__x86_64__)
constexpr std::size_t kLanes = 4;
constexpr std::size_t kLane = 16;

__m128i load(const char* bytes) {
  __m128i value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

// What is congruent to `value`, some bytes further on.
__attribute__((target("pclmul"))) __m128i moved(__m128i value, __m128i by) {
  return _mm_xor_si128(_mm_clmulepi64_si128(value, by, 0x00),
                       _mm_clmulepi64_si128(value, by, 0x11));
}

// Folds 64 bytes at a time into 16 that have the same CRC (Gopal et al., "Fast CRC Computation for
// Generic Polynomials Using PCLMULQDQ Instruction", 2009). Takes the bytes that it has folded.
__attribute__((target("pclmul"))) std::uint32_t folded(std::string_view& bytes, std::uint32_t crc) {
  const __m128i by_lanes = _mm_set_epi64x(0x1C6E41596, 0x154442BD4);
  const __m128i by_lane = _mm_set_epi64x(0x0CCAA009E, 0x1751997D0);
  __m128i sums[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) sums[i] = load(bytes.data() + kLane * i);
  sums[0] = _mm_xor_si128(sums[0], _mm_cvtsi32_si128(static_cast<int>(crc)));
  bytes.remove_prefix(kLanes * kLane);
  while (bytes.size() >= kLanes * kLane) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      sums[i] = _mm_xor_si128(moved(sums[i], by_lanes), load(bytes.data() + kLane * i));
    }
    bytes.remove_prefix(kLanes * kLane);
  }
  __m128i sum = sums[0];
  for (std::size_t i = 1; i < kLanes; ++i) sum = _mm_xor_si128(moved(sum, by_lane), sums[i]);
  char rest[kLane];
  std::memcpy(rest, &sum, sizeof rest);
  return by_tables({rest, sizeof rest}, 0);
}
#endif

}  // namespace

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  std::uint32_t crc = ~before;
#if defined(__x86_64__)
  static const bool can_fold = __builtin_cpu_supports("pclmul") != 0;
  if (can_fold && bytes.size() >= kLanes * kLane) crc = folded(bytes, crc);
#endif
  return ~by_tables(bytes, crc);
}

}  // namespace tfdude::recording
