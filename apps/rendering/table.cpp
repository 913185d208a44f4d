#include "table.hpp"

#include <algorithm>

#include "format.hpp"
#include "terminal.hpp"

namespace tfdude::cli {
namespace {

bool begins_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U; }

}  // namespace

std::size_t length_of(const std::string& text) {
  std::size_t length = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t escape = escape_at(text, i);
    if (escape > 0) {
      i += escape - 1;
    } else if (begins_character(text[i])) {
      ++length;
    }
  }
  return length;
}

std::string first_characters(const std::string& text, std::size_t count) {
  std::size_t seen = 0;
  std::size_t last_escape = std::string::npos;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (const std::size_t escape = escape_at(text, i); escape > 0) {
      last_escape = i;
      i += escape - 1;
    } else if (begins_character(text[i]) && seen++ == count) {
      const bool coloured =
          last_escape != std::string::npos && text.compare(last_escape, 4, "\x1b[0m") != 0;
      return text.substr(0, i) + (coloured ? "\x1b[0m" : "");
    }
  }
  return text;
}

std::string shortened(const std::string& text, std::size_t columns) {
  const std::size_t length = length_of(text);
  if (length <= columns) return text;
  const std::size_t before = (columns - 1) / 2;
  const std::size_t after = columns - 1 - before;
  const std::string left_out = first_characters(text, length - after);
  return first_characters(text, before) + "…" + text.substr(left_out.size());
}

std::size_t room(std::size_t at_80, std::size_t beside) {
  constexpr std::size_t kLeast = 8;
  const std::size_t columns = terminal().columns;
  if (columns == kUnlimited) return kUnlimited;
  if (columns >= 80) return at_80 + (columns - 80) * at_80 / (at_80 + beside);
  return std::max(at_80 * columns / 80, std::min(at_80, kLeast));
}

std::size_t name_width(const std::vector<std::string>& names, std::size_t at_80,
                       std::size_t beside) {
  const std::size_t most = room(at_80, beside);
  std::size_t width = std::min(at_80, most);
  for (const std::string& name : names) width = std::max(width, length_of(name));
  return std::min(width, most);
}

std::string cell(const std::string& name, std::size_t width) {
  const std::string text = shortened(name, width);
  return text + std::string(width - length_of(text), ' ');
}

std::string number(double value, int decimals, std::size_t columns) {
  std::string text = format("%.*f", decimals, value);
  if (text.size() <= columns) return text;
  constexpr std::size_t kSignPointAndExponent = 7;
  const std::size_t digits = columns > kSignPointAndExponent ? columns - kSignPointAndExponent : 1;
  return format("%.*g", static_cast<int>(digits), value);
}

}  // namespace tfdude::cli
