#include "description/shell_text.hpp"

#include "description/file_text.hpp"

namespace tfdude {

tl::unexpected<Error> ShellText::error(int line, const std::string& what) const {
  return file_error(Errc::kConfig, file_, line, what + " has no end");
}

bool ShellText::joins_lines() const {
  const bool joins = here() == '\\' && here(here(1) == '\r' ? 2 : 1) == '\n';
  return joins && rules_ == ShellRules::kShell;
}

void ShellText::join_lines() {
  at_ += here(1) == '\r' ? 3U : 2U;
  ++line_;
}

bool ShellText::skip_blanks() {
  for (; at_ < text_.size() && (is_blank(here()) || here() == '\n'); ++at_) {
    if (here() == '\n') ++line_;
  }
  return at_ < text_.size();
}

Result<void> ShellText::escaped(ShellWord& word) {
  if (++at_ >= text_.size()) return error(line_, "an escape");
  take(word);
  return {};
}

Result<void> ShellText::word(ShellWord& word) {
  const std::string_view ends = rules_ == ShellRules::kShell ? "\n;&|()<>" : "\n";
  while (!is_blank(here()) && !is_one_of(here(), ends)) {
    Result<void> ok;
    if (joins_lines()) {
      join_lines();
    } else if (here() == '\\') {
      ok = escaped(word);
    } else if (here() == '\'') {
      ok = quoted(word);
    } else if (here() == '"') {
      ok = doubly_quoted(word);
    } else {
      ok = plain(word);
    }
    if (!ok) return ok;
  }
  return {};
}

void ShellText::take(ShellWord& word) {
  if (here() == '\n') ++line_;
  word.text += text_[at_++];
}

Result<void> ShellText::quoted(ShellWord& word) {
  const int line = line_;
  for (++at_; here_is_inside('\'');) take(word);
  if (at_ >= text_.size()) return error(line, "a quote");
  ++at_;
  return {};
}

Result<void> ShellText::doubly_quoted(ShellWord& word) {
  const int line = line_;
  const std::string_view escapable = rules_ == ShellRules::kShell ? "$`\"\\" : "\"\\";
  for (++at_; here_is_inside('"');) {
    if (joins_lines()) {
      join_lines();
      continue;
    }
    if (here() == '\\' && is_one_of(here(1), escapable)) {
      ++at_;
      take(word);
    } else if (auto ok = plain(word); !ok) {
      return ok;
    }
  }
  if (at_ >= text_.size()) return error(line, "a quote");
  ++at_;
  return {};
}

// A character that is no quote, or what the shell replaces.
Result<void> ShellText::plain(ShellWord& word) {
  const int line = line_;
  if (rules_ != ShellRules::kShell) {
    take(word);
    return {};
  }
  if (here() == '`') {
    word.is_expanded = true;
    do take(word);
    while (here_is_inside('`'));
    if (at_ >= text_.size()) return error(line, "a substitution");
  } else if (here() == '$') {
    word.is_expanded = true;
    if (here(1) == '(') return substitution(word);
  }
  take(word);
  return {};
}

// $(command), or $((expression)).
Result<void> ShellText::substitution(ShellWord& word) {
  const int line = line_;
  std::size_t open = 0;
  do {
    take(word);
    if (at_ >= text_.size()) return error(line, "a substitution");
    if (here() == '(') ++open;
    if (here() == ')') --open;
  } while (open > 0);
  take(word);
  return {};
}

}  // namespace tfdude
