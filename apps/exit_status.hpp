#pragma once

// The exit statuses of the programs.
namespace tfdude::cli {

inline constexpr int kDone = 0;
/// A request was rejected; or a program could not start, or has lost its partition.
inline constexpr int kRejected = 1;
inline constexpr int kWrongUsage = 2;
inline constexpr int kNoAnswer = 3;

}  // namespace tfdude::cli
