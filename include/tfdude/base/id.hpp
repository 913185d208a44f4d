#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"

namespace tfdude {

/// Longest id of a frame or name of a partition, in bytes of UTF-8.
inline constexpr std::size_t kMaxIdBytes = 255;

/// Checks an id: 1 to 255 bytes of valid UTF-8 without control characters.
/// @param what  the field's name for the message, such as "parent"
/// @return kInvalidInput naming `what` and the reason.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_id(std::string_view id, std::string_view what);

/// Checks a partition name: an id without the wildcards `*?[]` and without a comma, since the name
/// is also the name of a DDS partition, where those characters have a meaning.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_partition_name(std::string_view name);

/// Replaces control characters and bytes that are not valid UTF-8 by escapes such as "\x07". The
/// result is safe for a terminal, also for text of unknown origin.
[[nodiscard]] TFDUDE_EXPORT std::string printable(std::string_view text);

/// The same in single quotes, fit for a message or a log line.
[[nodiscard]] TFDUDE_EXPORT std::string quote(std::string_view text);

}  // namespace tfdude
