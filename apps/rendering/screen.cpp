#include "screen.hpp"

#include <algorithm>
#include <cstdio>
#include <sys/ioctl.h>
#include <unistd.h>
#include <vector>

#include "../standard_output.hpp"
#include "format.hpp"
#include "table.hpp"
#include "terminal.hpp"

namespace tfdude::cli {
namespace {

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

}  // namespace

std::string fitted(const std::string& text, std::size_t rows, std::size_t columns) {
  std::vector<std::string> lines = lines_of(text);
  if (lines.size() > rows && rows > 0) {
    const std::size_t left_out = lines.size() - (rows - 1);
    lines.resize(rows - 1);
    lines.push_back(format("... and %zu lines more", left_out));
  }
  std::string page;
  for (const std::string& line : lines) page += first_characters(line, columns) + "\n";
  return page;
}

void Screen::redraw(const std::string& page) {
  if (isatty(STDOUT_FILENO) == 0) {
    std::printf("%s\n", page.c_str());
  } else {
    winsize size{};
    const bool known = ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 1;
    // One row is left for the cursor, which stands below the last line.
    // The next page is made for it.
    if (known) terminal().columns = size.ws_col;
    const std::string text = known ? fitted(page, size.ws_row - 1U, size.ws_col) : page;
    if (drawn_ > 0) std::printf("\x1b[%tdA\x1b[J", drawn_);
    std::fputs(text.c_str(), stdout);
    drawn_ = std::count(text.begin(), text.end(), '\n');
  }
  flush_or_end();
}

}  // namespace tfdude::cli
