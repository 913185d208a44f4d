#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace tfdude {

/// What the text between the quotes of a string in Python stands for.
/// @return absent: an escape that has no end, is no character, or is named (\N{...})
[[nodiscard]] std::optional<std::string> python_unescaped(std::string_view text);

}  // namespace tfdude
