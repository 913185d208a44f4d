#include "tfdude/base/id.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>

namespace tfdude {
namespace {

struct CodePoint {
  std::uint32_t value = 0;
  std::size_t bytes = 0;  // 0: not valid UTF-8
};

// Decodes the first code point (RFC 3629: no overlong forms, no surrogates, at most U+10FFFF).
CodePoint decode(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t lead = byte(0);
  if (lead < 0x80) return {lead, 1};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  std::uint32_t value = lead & (0xFFU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return {};
    value = (value << 6U) | (byte(i) & 0x3FU);
  }
  const bool overlong = (bytes == 3 && value < 0x800) || (bytes == 4 && value < 0x10000);
  const bool surrogate = value >= 0xD800 && value <= 0xDFFF;
  if (overlong || surrogate || value > 0x10FFFF) return {};
  return {value, bytes};
}

bool is_plain(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

bool is_control(std::uint32_t value) { return value < 0x20 || (value >= 0x7F && value < 0xA0); }

struct Range {
  std::uint32_t first;
  std::uint32_t last;
};

// Those that look like a space, or cannot be seen at all, in the order of their numbers: Unicode's
// White_Space beyond ASCII, Default_Ignorable_Code_Point, and the blank pattern of Braille.
constexpr std::array<Range, 21> kUnseen = {
    {{0xA0, 0xA0},      {0xAD, 0xAD},     {0x34F, 0x34F},   {0x61C, 0x61C},     {0x115F, 0x1160},
     {0x1680, 0x1680},  {0x17B4, 0x17B5}, {0x180B, 0x180F}, {0x2000, 0x200F},   {0x2028, 0x202F},
     {0x205F, 0x206F},  {0x2800, 0x2800}, {0x3000, 0x3000}, {0x3164, 0x3164},   {0xFE00, 0xFE0F},
     {0xFEFF, 0xFEFF},  {0xFFA0, 0xFFA0}, {0xFFF0, 0xFFFB}, {0x1BCA0, 0x1BCA3}, {0x1D173, 0x1D17A},
     {0xE0000, 0xE0FFF}}};

bool is_unseen(std::uint32_t value) {
  return value >= kUnseen.front().first &&
         std::any_of(kUnseen.begin(), kUnseen.end(), [value](const Range& range) {
           return range.first <= value && value <= range.last;
         });
}

std::string code_point(std::uint32_t value) {
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), "U+%04X", static_cast<unsigned>(value));
  return text.data();
}

}  // namespace

Result<void> check_id(std::string_view id, std::string_view what) {
  // The common case, which is fast: this runs for each edge of a stream.
  if (!id.empty() && id.size() <= kMaxIdBytes && is_plain(id)) return {};
  const std::string field(what);
  if (id.empty()) return fail(Errc::kInvalidInput, field + " is empty");
  if (id.size() > kMaxIdBytes) {
    return fail(Errc::kInvalidInput, field + " " + quote(id.substr(0, 40)) + "... has " +
                                         std::to_string(id.size()) + " bytes, at most " +
                                         std::to_string(kMaxIdBytes) + " are allowed");
  }
  for (std::size_t i = 0; i < id.size();) {
    const CodePoint point = decode(id.substr(i));
    if (point.bytes == 0) {
      return fail(Errc::kInvalidInput, field + " " + quote(id) + " is not valid UTF-8");
    }
    if (is_control(point.value)) {
      return fail(Errc::kInvalidInput, field + " " + quote(id) + " holds a control character");
    }
    i += point.bytes;
  }
  return {};
}

Result<void> check_new_id(std::string_view id, std::string_view what) {
  if (auto ok = check_id(id, what); !ok) return ok;
  const std::string_view where = id.front() == ' '   ? " begins with a space"
                                 : id.front() == '-' ? " begins with '-', like an option"
                                 : id.back() == ' '  ? " ends with a space"
                                                     : "";
  if (where.empty() && is_plain(id)) return {};
  const std::string who = std::string(what) + " " + quote(id);
  if (!where.empty()) return fail(Errc::kInvalidInput, who + std::string(where));
  for (std::size_t i = 0; i < id.size();) {
    const CodePoint point = decode(id.substr(i));
    if (is_unseen(point.value)) {
      return fail(Errc::kInvalidInput, who + " holds the character " + code_point(point.value) +
                                           ", which cannot be seen or looks like a space");
    }
    i += point.bytes;
  }
  return {};
}

Result<void> check_partition_name(std::string_view name) {
  if (auto ok = check_id(name, "partition"); !ok) return ok;
  if (const auto at = name.find_first_of("*?[],"); at != std::string_view::npos) {
    return fail(Errc::kInvalidInput, "partition " + quote(name) + " holds '" + name[at] +
                                         "', which has a special meaning in DDS");
  }
  return {};
}

Result<void> check_new_partition_name(std::string_view name) {
  // DDS passes names of at most 255 bytes on, and other words stand before this one.
  constexpr std::size_t kMostBytes = 200;
  if (name.size() > kMostBytes) {
    return fail(Errc::kInvalidInput, "partition " + quote(name) + " has a name of more than " +
                                         std::to_string(kMostBytes) + " bytes");
  }
  return check_partition_name(name).and_then([&] { return check_new_id(name, "partition"); });
}

std::string printable(std::string_view text) {
  if (is_plain(text)) return std::string(text);  // errors about frames are part of usual lookups
  constexpr std::string_view kHexDigits = "0123456789abcdef";
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const CodePoint point = decode(text.substr(i));
    const std::size_t bytes = std::max<std::size_t>(point.bytes, 1);
    const bool shown = point.bytes != 0 && !is_control(point.value) && !is_unseen(point.value);
    for (const char c : text.substr(i, bytes)) {
      const auto byte = static_cast<std::uint8_t>(c);
      if (shown) {
        out += c;
      } else {
        out += "\\x";
        out += kHexDigits[byte >> 4U];
        out += kHexDigits[byte & 0xFU];
      }
    }
    i += bytes;
  }
  return out;
}

// Each id is shown whole. What is longer comes from a file or a stranger, and could fill a log.
std::string quote(std::string_view text) {
  constexpr std::size_t kLongest = 300;
  constexpr std::size_t kShown = 200;
  if (text.size() <= kLongest) return "'" + printable(text) + "'";
  std::size_t shown = kShown;
  const auto continues = [&](std::size_t at) {
    return (static_cast<std::uint8_t>(text[at]) & 0xC0U) == 0x80U;
  };
  while (shown > kShown - 3 && continues(shown)) --shown;  // no part of a character
  return "'" + printable(text.substr(0, shown)) + "...' (" + std::to_string(text.size()) +
         " bytes)";
}

}  // namespace tfdude
