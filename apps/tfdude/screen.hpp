#pragma once

#include <cstddef>
#include <string>

namespace tfdude::cli {

/// What of a text fits on a screen: lines are cut at so many columns, and where there are too many, the last line that fits
/// says how many are left out. @param text  lines of UTF-8, each with its end
[[nodiscard]] std::string fitted(const std::string& text, std::size_t rows, std::size_t columns);

/// Standard output, where a page is drawn again and again in the same place if it is a terminal.
class Screen {
 public:
  /// In a pipe pages follow each other, with an empty line between.
  void redraw(const std::string& page);

 private:
  std::ptrdiff_t drawn_ = 0;  // lines
};

}  // namespace tfdude::cli
