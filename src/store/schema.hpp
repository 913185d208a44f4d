#pragma once

#include <cstdint>
#include <string>

// The tables of a state. Each format has those of the one before it, and more.
namespace tfdude {

inline constexpr std::int64_t kApplication = 0x74666475;  // "tfdu"

inline constexpr std::int64_t kJointsFormat = 2;  ///< the first that has joints,
inline constexpr std::int64_t kCorrelationFormat =
    3;  ///< and the types of these, and what edges' errors have to do with each other,
inline constexpr std::int64_t kAbsentFormat = 3;  ///< and whom the partition misses
inline constexpr std::int64_t kFormat = 3;

/// What makes the tables of a format, or those that it has more than an older one. A file with other words than these is
/// refused: a change of them needs another format.
[[nodiscard]] std::string schema_of(std::int64_t format, std::int64_t older = 0);

}  // namespace tfdude
