#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "tfdude/base/export.hpp"
#include "tfdude/base/result.hpp"

namespace tfdude {

/// Longest id of a frame or name of a partition, in bytes of UTF-8.
inline constexpr std::size_t kMaxIdBytes = 255;

/// Checks an id that exists already, as others may have it: 1 to 255 bytes of valid UTF-8 without
/// control characters.
/// @param what  the field's name for the message, such as "parent"
/// @return kInvalidInput naming `what` and the reason.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_id(std::string_view id, std::string_view what);

/// Checks the id of a new frame, or the name of a new joint or source. As check_id(), and it must
/// not look like another one, or like an option: no space at its begin or end, no '-' at its begin,
/// and no character that cannot be seen or looks like a space (no-break space, zero-width space and
/// so on). Spaces within it are allowed.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_new_id(std::string_view id, std::string_view what);

/// Checks a partition name: an id without the wildcards `*?[]` and without a comma, since the name
/// is also the name of a DDS partition, where those characters have a meaning.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_partition_name(std::string_view name);

/// As check_partition_name(), and as check_new_id().
[[nodiscard]] TFDUDE_EXPORT Result<void> check_new_partition_name(std::string_view name);

/// Replaces control characters, characters that cannot be seen or look like a space, and bytes that
/// are not valid UTF-8 by escapes such as "\x07". The result is safe for a terminal, also for text
/// of unknown origin.
[[nodiscard]] TFDUDE_EXPORT std::string printable(std::string_view text);

/// The same in single quotes, fit for a message or a log line.
[[nodiscard]] TFDUDE_EXPORT std::string quote(std::string_view text);

}  // namespace tfdude
