#pragma once

#include <cstddef>
#include <string>

namespace tfdude::cli {

/// Cuts a text to fit on a screen. Lines are cut at so many columns. If there are too many lines,
/// the last line that fits says how many are left out.
/// @param text  lines of UTF-8, each with its end
[[nodiscard]] std::string fitted(const std::string& text, std::size_t rows, std::size_t columns);

/// Standard output. On a terminal each page is drawn over the one before.
class Screen {
 public:
  /// In a pipe or file, pages follow each other, with an empty line between them.
  void redraw(const std::string& page);

 private:
  std::ptrdiff_t drawn_ = 0;  // number of lines of the last page
};

}  // namespace tfdude::cli
