#include "tfdude/base/id.hpp"

#include <algorithm>
#include <cstdint>

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

Result<void> check_partition_name(std::string_view name) {
  if (auto ok = check_id(name, "partition"); !ok) return ok;
  if (const auto at = name.find_first_of("*?[],"); at != std::string_view::npos) {
    return fail(Errc::kInvalidInput, "partition " + quote(name) + " holds '" + name[at] +
                                         "', which has a special meaning in DDS");
  }
  return {};
}

std::string printable(std::string_view text) {
  if (is_plain(text)) return std::string(text);  // errors about frames are part of usual lookups
  constexpr std::string_view kHexDigits = "0123456789abcdef";
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    const CodePoint point = decode(text.substr(i));
    if (point.bytes == 0 || is_control(point.value)) {
      const auto byte = static_cast<std::uint8_t>(text[i]);
      out += "\\x";
      out += kHexDigits[byte >> 4U];
      out += kHexDigits[byte & 0xFU];
      ++i;
    } else {
      out += text.substr(i, point.bytes);
      i += point.bytes;
    }
  }
  return out;
}

std::string quote(std::string_view text) { return "'" + printable(text) + "'"; }

}  // namespace tfdude
