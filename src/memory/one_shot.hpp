#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "tfdude/types/one_shot.hpp"

// What a process that asks once says to one of this computer that owns frames, and what that
// answers: messages of a unix socket. Both are of unknown origin.
namespace tfdude {

/// The longest message. A longer answer is none.
inline constexpr std::size_t kMaxOneShotBytes = 65'536;

[[nodiscard]] std::string one_shot_message(const OneShotQuestion& question);
[[nodiscard]] std::string one_shot_message(const OneShotAnswer& answer);
/// Empty: it is none. What is returned has valid names, and finite numbers.
[[nodiscard]] std::optional<OneShotQuestion> one_shot_question(std::string_view message);
[[nodiscard]] std::optional<OneShotAnswer> one_shot_answer(std::string_view message);

/// How many processes of a network can be asked.
inline constexpr int kOneShotNames = 16;
/// The name of the socket of one of them.
/// @param network  as of network_of(): who can be asked are participants of the same network
[[nodiscard]] std::string one_shot_name(const std::string& network, int number);

}  // namespace tfdude
