#include "description/python_escapes.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <system_error>

namespace tfdude {
namespace {

// In UTF-8. @return false: it is no character
bool append(std::string& text, std::uint32_t point) {
  constexpr std::uint32_t kLast = 0x10FFFF;
  const bool is_surrogate = point >= 0xD800 && point <= 0xDFFF;
  if (point > kLast || is_surrogate) return false;
  if (point < 0x80) {
    text += static_cast<char>(point);
    return true;
  }
  const int more = point < 0x800 ? 1 : point < 0x10000 ? 2 : 3;
  const std::uint32_t mark = more == 1 ? 0xC0U : more == 2 ? 0xE0U : 0xF0U;
  text += static_cast<char>(mark | (point >> static_cast<unsigned>(6 * more)));
  for (int i = more - 1; i >= 0; --i) {
    text += static_cast<char>(0x80U | ((point >> static_cast<unsigned>(6 * i)) & 0x3FU));
  }
  return true;
}

// How many digits follow \x, \u and \U; 0: no such escape.
std::size_t digits_after(char kind) {
  return kind == 'x' ? 2 : kind == 'u' ? 4 : kind == 'U' ? 8 : 0;
}

bool append_number(std::string& text, std::string_view digits, int base) {
  std::uint32_t point = 0;
  const char* last = digits.data() + digits.size();
  const auto [end, code] = std::from_chars(digits.data(), last, point, base);
  return code == std::errc() && end == last && append(text, point);
}

}  // namespace

std::optional<std::string> python_unescaped(std::string_view text) {
  constexpr std::string_view kOctal = "01234567";
  constexpr std::string_view kSigns = "\\'\"abfnrtv";
  constexpr std::string_view kMeanings = "\\'\"\a\b\f\n\r\t\v";
  std::string plain;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] != '\\' || at + 1 == text.size()) {
      plain += text[at];
      continue;
    }
    const char kind = text[++at];
    if (const auto sign = kSigns.find(kind); sign != std::string_view::npos) {
      plain += kMeanings[sign];
    } else if (kOctal.find(kind) != std::string_view::npos) {
      const std::string_view three = text.substr(at, 3);
      const auto digits = three.substr(0, std::min(three.find_first_not_of(kOctal), three.size()));
      if (!append_number(plain, digits, 8)) return std::nullopt;
      at += digits.size() - 1;
    } else if (const std::size_t size = digits_after(kind); size > 0) {
      const std::string_view digits = text.substr(at + 1, size);
      if (digits.size() != size || !append_number(plain, digits, 16)) return std::nullopt;
      at += size;
    } else if (kind == 'N') {
      return std::nullopt;
    } else if (kind != '\n') {  // a backslash joins lines; others stand for themselves
      plain += '\\';
      plain += kind;
    }
  }
  return plain;
}

}  // namespace tfdude
