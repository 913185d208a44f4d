#pragma once

#include <cstdint>
#include <string>

// The tables of a state. Each format has those of the one before it, and more.
namespace tfdude {

inline constexpr std::int64_t kApplication = 0x74666475;  // "tfdu"

// The first formats with joints; with joint types and correlations; with absent partitions; with
// the stamps of values that are samples; with checksums; with the joints of configured entries. The
// tables of format 4 are those of format 3, but a transform without covariance is unspecified.
inline constexpr std::int64_t kJointsFormat = 2;
inline constexpr std::int64_t kCorrelationFormat = 3;
inline constexpr std::int64_t kAbsentFormat = 3;
inline constexpr std::int64_t kUnspecifiedFormat = 4;
inline constexpr std::int64_t kSamplesFormat = 5;
inline constexpr std::int64_t kSumsFormat = 6;
inline constexpr std::int64_t kEntryJointsFormat = 7;
inline constexpr std::int64_t kFormat = 7;

// Of a joint, instead of a variance; since format 4.
inline constexpr double kUnspecifiedVariance = -1;

// Of a dynamic edge whose history was cleared, instead of a stamp.
inline constexpr std::int64_t kClearedStamp = -1;

/// The SQL that creates the tables of a format, or only those that an older format lacks. A file
/// whose schema has other words than these is rejected, so each change of them needs a new format.
[[nodiscard]] std::string schema_of(std::int64_t format, std::int64_t older = 0);

}  // namespace tfdude
