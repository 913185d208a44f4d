#pragma once

#include <cstddef>
#include <string>

// How answers look on a terminal. In a pipe or file they have no colours, and nothing is cut; tests
// have 80 columns.
namespace tfdude::cli {

/// More than any text has.
inline constexpr std::size_t kUnlimited = 1'000'000'000;

struct Terminal {
  bool colours = false;
  std::size_t columns = 80;
};

/// That of this process.
[[nodiscard]] Terminal& terminal();

/// What an open file is. A terminal is as wide as the environment's COLUMNS says, or as it says
/// itself; a file that is none is of kUnlimited columns. Without colours if the environment's
/// NO_COLOR is not empty, or TERM is "dumb".
[[nodiscard]] Terminal terminal_of(int file);

/// What a text is, not how it looks.
enum class Look { kHeader, kGood, kWarning, kBad, kFaint };

/// The text in the colour of its look, if the terminal has colours. Ends of lines stay outside.
[[nodiscard]] std::string painted(Look look, const std::string& text,
                                  const Terminal& on = terminal());

/// The same with one of six colours, which a name always has.
[[nodiscard]] std::string painted_by_name(const std::string& name, const std::string& text,
                                          const Terminal& on = terminal());

/// The length of an escape sequence of a colour at a place of a text; 0: there is none.
[[nodiscard]] std::size_t escape_at(const std::string& text, std::size_t at);

}  // namespace tfdude::cli
