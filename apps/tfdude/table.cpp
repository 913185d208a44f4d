#include "table.hpp"

#include <algorithm>

#include "format.hpp"

namespace tfdude::cli {
namespace {

bool begins_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U; }

}  // namespace

std::size_t length_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(text.begin(), text.end(), begins_character));
}

std::string first_characters(const std::string& text, std::size_t count) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (begins_character(text[i]) && seen++ == count) return text.substr(0, i);
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

std::string cell(const std::string& name, std::size_t columns) {
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
