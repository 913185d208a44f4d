#pragma once

#include <cstddef>
#include <string>

// How answers look on a terminal. In a pipe or file, and in tests, they have no colours, and tables
// have 80 columns.
namespace tfdude::cli {

struct Terminal {
  bool colours = false;
  std::size_t columns = 80;
};

/// That of this process.
[[nodiscard]] Terminal& terminal();

/// What an open file is. Without colours if the environment's NO_COLOR is not empty, or TERM is
/// "dumb".
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
