#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "tfdude/base/result.hpp"

namespace tfdude {

struct ShellWord {
  std::string text;          // without its quotes
  bool is_expanded = false;  // the shell replaces a part of it
};

/// How a text is divided into words: as by a shell, or as by Python's shlex.split(), which launch
/// systems use. That knows the quotes and backslashes of a shell, and nothing else of it.
enum class ShellRules : unsigned char { kShell, kShlex };

/// A text that is read as words. Reads each character once or twice, and does not call itself, so
/// that no input takes the stack.
class ShellText {
 public:
  /// @param line  the number of the first line, for messages
  ShellText(std::string_view text, const std::string& file, int line, ShellRules rules)
      : text_(text), file_(file), line_(line), rules_(rules) {}

  /// Goes on to what is no blank. @return whether there is anything
  [[nodiscard]] bool skip_blanks();
  /// Reads a word that begins here.
  /// @return kConfig naming file and line: a quote, an escape or a substitution has no end
  [[nodiscard]] Result<void> word(ShellWord& word);

 protected:
  [[nodiscard]] static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r'; }
  [[nodiscard]] static bool is_one_of(char c, std::string_view characters) {
    return characters.find(c) != std::string_view::npos;
  }
  [[nodiscard]] char here(std::size_t ahead = 0) const {
    return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\n';
  }
  [[nodiscard]] tl::unexpected<Error> error(int line, const std::string& what) const;
  /// A backslash at the end of a line.
  [[nodiscard]] bool joins_lines() const;
  void join_lines();

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  int line_;

 private:
  [[nodiscard]] bool here_is_inside(char quote) const {
    return at_ < text_.size() && text_[at_] != quote;
  }
  void take(ShellWord& word);
  [[nodiscard]] Result<void> escaped(ShellWord& word);
  [[nodiscard]] Result<void> quoted(ShellWord& word);
  [[nodiscard]] Result<void> doubly_quoted(ShellWord& word);
  [[nodiscard]] Result<void> plain(ShellWord& word);
  [[nodiscard]] Result<void> substitution(ShellWord& word);

  ShellRules rules_;
};

}  // namespace tfdude
