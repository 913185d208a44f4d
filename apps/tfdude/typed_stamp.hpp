#pragma once

#include <string>

#include "tfdude/base/result.hpp"
#include "tfdude/base/time.hpp"

namespace tfdude::cli {

[[nodiscard]] Time wall_clock();

/// Reads a stamp of the command line: decimal seconds since the epoch, exact to nanoseconds. A
/// negative number counts back from now. @return kInvalidInput naming the text.
[[nodiscard]] Result<Time> parse_stamp(const std::string& text, Time now);

}  // namespace tfdude::cli
