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

std::string cell(const std::string& name, std::size_t at_80) {
  constexpr std::size_t kMost = 40;  // most names are shorter: numbers should not be far from them
  constexpr std::size_t kLeast = 8;
  const std::size_t stretched = at_80 * terminal().columns / 80;
  const std::size_t columns =
      std::clamp(stretched, std::min(at_80, kLeast), std::max(at_80, kMost));
  const std::string text = shortened(name, columns);
  return text + std::string(columns - length_of(text), ' ');
}

std::string number(double value, int decimals, std::size_t columns) {
  const std::string text = format("%.*f", decimals, value);
  if (text.size() <= columns) return text;
  constexpr std::size_t kSignPointAndExponent = 7;
  const std::size_t digits = columns > kSignPointAndExponent ? columns - kSignPointAndExponent : 1;
  return format("%.*g", static_cast<int>(digits), value);
}

}  // namespace tfdude::cli
