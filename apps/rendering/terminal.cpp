#include "terminal.hpp"

#include <cstdlib>
#include <iterator>
#include <string_view>
#include <sys/ioctl.h>
#include <unistd.h>

namespace tfdude::cli {
namespace {

constexpr std::string_view kEscape = "\x1b[";
constexpr const char* kPlain = "\x1b[0m";

std::string in_colour(const char* colour, const std::string& text, const Terminal& on) {
  if (!on.colours || text.empty()) return text;
  const std::size_t end = text.find_last_not_of('\n') + 1;
  return std::string(kEscape) + colour + "m" + text.substr(0, end) + kPlain + text.substr(end);
}

// NOLINTBEGIN(concurrency-mt-unsafe): nobody sets the environment
bool wants_colours() {
  const char* no_colour = std::getenv("NO_COLOR");
  const char* kind = std::getenv("TERM");
  return (no_colour == nullptr || *no_colour == 0) && kind != nullptr &&
         std::string_view(kind) != "dumb";
}

std::size_t wanted_columns() {
  const char* columns = std::getenv("COLUMNS");
  const long wanted = columns == nullptr ? 0 : std::strtol(columns, nullptr, 10);
  return wanted > 0 && wanted < static_cast<long>(kUnlimited) ? static_cast<std::size_t>(wanted)
                                                              : 0;
}
// NOLINTEND(concurrency-mt-unsafe)

}  // namespace

Terminal& terminal() {
  static Terminal own;
  return own;
}

Terminal terminal_of(int file) {
  Terminal found;
  if (isatty(file) == 0) return {false, kUnlimited};
  winsize size{};
  if (const std::size_t wanted = wanted_columns(); wanted > 0) {
    found.columns = wanted;
  } else if (ioctl(file, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    found.columns = size.ws_col;
  }
  found.colours = wants_colours();
  return found;
}

std::string painted(Look look, const std::string& text, const Terminal& on) {
  switch (look) {
    case Look::kHeader:
      return in_colour("1", text, on);
    case Look::kGood:
      return in_colour("32", text, on);
    case Look::kWarning:
      return in_colour("33", text, on);
    case Look::kBad:
      return in_colour("31", text, on);
    case Look::kFaint:
      return in_colour("2", text, on);
  }
  return text;
}

std::string painted_by_name(const std::string& name, const std::string& text, const Terminal& on) {
  // Red stands for what is wrong.
  constexpr const char* kColours[] = {"34", "36", "35", "32", "94", "96"};
  std::size_t sum = 0;
  for (const char c : name) sum = sum * 31 + static_cast<unsigned char>(c);
  return in_colour(kColours[sum % std::size(kColours)], text, on);
}

std::size_t escape_at(const std::string& text, std::size_t at) {
  if (text.compare(at, kEscape.size(), kEscape) != 0) return 0;
  const std::size_t end = text.find('m', at);
  return end == std::string::npos ? 0 : end + 1 - at;
}

}  // namespace tfdude::cli
