#pragma once

#include <string>

#include "tfdude/base/export.hpp"

// Numbers in messages, files and texts: with a point, whatever locale the program has set. Streams
// and printf() write and read them as the locale says.
namespace tfdude {

/// With at most so many significant digits, as "%g": "0.25", "1e+09", "nan".
[[nodiscard]] TFDUDE_EXPORT std::string number_text(double value, int digits = 6);

/// With so many digits after the point, as "%f".
[[nodiscard]] TFDUDE_EXPORT std::string fixed_text(double value, int decimals);

}  // namespace tfdude
