#include "description/python_tokens.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "description/file_edges.hpp"
#include "description/file_text.hpp"
#include "description/launch_starts.hpp"
#include "description/python_conditions.hpp"
#include "description/python_escapes.hpp"

namespace tfdude {
namespace {

struct Token {
  enum class Kind { kString, kWord, kSign };  // kWord: a name or a number
  Kind kind = Kind::kSign;
  std::string text;  // of a string its content
  int line = 0;
  std::size_t other = 0;  // of a bracket: its counterpart; of others: that which they stand in
  PythonConditions::Place place = PythonConditions::kNone;
};

constexpr std::size_t kNone = SIZE_MAX;

bool is_word(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
}

class Tokens {
 public:
  Tokens(std::string_view text, const std::string& file, PythonConditions& conditions)
      : text_(text), file_(file), conditions_(conditions) {}

  [[nodiscard]] Result<std::vector<Token>> all() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (c == '"' || c == '\'') {
        if (auto ok = string(); !ok) return tl::unexpected(ok.error());
      } else if (is_word(c)) {
        word();
      } else {
        if (auto ok = sign(c); !ok) return tl::unexpected(ok.error());
      }
    }
    conditions_.finish();
    if (open_.empty()) return std::move(tokens_);
    return file_error(Errc::kConfig, file_, tokens_[open_.back()].line, "a bracket is not closed");
  }

 private:
  [[nodiscard]] Result<void> string() {
    begin_line({});
    const std::string_view rest = text_.substr(at_);
    const bool is_long = rest.size() >= 3 && rest[1] == rest[0] && rest[2] == rest[0];
    const std::string quote(is_long ? 3 : 1, rest[0]);
    Token token{Token::Kind::kString, {}, line_, 0};
    at_ += quote.size();
    while (text_.substr(at_, quote.size()) != quote) {
      const bool is_escaped = at_ < text_.size() && text_[at_] == '\\';
      if (is_escaped) token.text += text_[at_++];
      if (at_ >= text_.size() || (text_[at_] == '\n' && !is_long && !is_escaped)) {
        return file_error(Errc::kConfig, file_, token.line, "a string has no end");
      }
      if (text_[at_] == '\n') ++line_;
      token.text += text_[at_++];
    }
    at_ += quote.size();
    if (auto plain = python_unescaped(token.text)) {
      token.text = *std::move(plain);
    } else {
      token.kind = Token::Kind::kWord;  // only Python knows what it stands for
    }
    add(std::move(token));
    return {};
  }

  void add(Token token) {
    token.other = open_.empty() ? kNone : open_.back();
    token.place = conditions_.here();
    // Strings that follow each other are one.
    const bool is_string = token.kind == Token::Kind::kString;
    if (is_string && !tokens_.empty() && tokens_.back().kind == Token::Kind::kString &&
        tokens_.back().place == token.place) {
      tokens_.back().text += token.text;
      return;
    }
    tokens_.push_back(std::move(token));
  }

  // Before the first token of a line.
  void begin_line(std::string_view first) {
    if (is_line_begun_ || !open_.empty()) return;
    is_line_begun_ = true;
    conditions_.begin_line(at_ - line_begin_, first, line_);
  }

  void end_line() {
    ++line_;
    line_begin_ = at_;
    is_line_begun_ = false;
  }

  void word() {
    const std::size_t begin = at_;
    std::size_t end = begin;
    while (end < text_.size() && is_word(text_[end])) ++end;
    begin_line(text_.substr(begin, end - begin));
    conditions_.word(text_.substr(begin, end - begin), line_);
    while (at_ < text_.size() && is_word(text_[at_])) {
      const bool exponent = text_[at_] == 'e' || text_[at_] == 'E';
      const bool number = std::isdigit(static_cast<unsigned char>(text_[begin])) != 0;
      ++at_;
      const bool has_sign = at_ < text_.size() && (text_[at_] == '-' || text_[at_] == '+');
      if (exponent && number && has_sign) ++at_;
    }
    add({Token::Kind::kWord, std::string(text_.substr(begin, at_ - begin)), line_, 0});
  }

  [[nodiscard]] Result<void> sign(char c) {
    const bool is_blank = std::isspace(static_cast<unsigned char>(c)) != 0 || c == '\\';
    if (!is_blank) begin_line({});
    ++at_;
    if (c == '\n') end_line();
    if (c == '\\') join_lines();
    if (is_blank) return {};
    note(c);
    add({Token::Kind::kSign, std::string(1, c), line_, 0});
    if (c == '(' || c == '[' || c == '{') {
      open_.push_back(tokens_.size() - 1);
      conditions_.open();
    }
    if (c != ')' && c != ']' && c != '}') return {};
    conditions_.close();
    if (open_.empty()) return file_error(Errc::kConfig, file_, line_, "a bracket was not opened");
    tokens_.back().other = open_.back();
    tokens_[open_.back()].other = tokens_.size() - 1;
    open_.pop_back();
    return {};
  }

  void note(char sign) {
    if (sign == ',') conditions_.comma();
    const bool follows_word = !tokens_.empty() && tokens_.back().kind == Token::Kind::kWord;
    const bool compares = at_ < text_.size() && text_[at_] == '=';
    if (sign == '=' && follows_word && !compares) {
      conditions_.keyword(tokens_.back().text, line_);
    }
  }

  // A backslash at the end of a line.
  void join_lines() {
    if (at_ < text_.size() && text_[at_] == '\r') ++at_;
    if (at_ >= text_.size() || text_[at_] != '\n') return;
    ++at_;
    ++line_;
  }

  std::string_view text_;
  const std::string& file_;
  PythonConditions& conditions_;
  std::size_t at_ = 0;
  std::size_t line_begin_ = 0;
  bool is_line_begun_ = false;
  int line_ = 1;
  std::vector<Token> tokens_;
  std::vector<std::size_t> open_;
};

class Calls {
 public:
  Calls(const std::vector<Token>& tokens, const std::string& file) : tokens_(tokens), file_(file) {}

  // The arguments of the call, or of the list, that begins at `open` and has this token.
  [[nodiscard]] Result<std::optional<PythonArguments>> around(std::size_t open,
                                                              std::size_t named) const {
    if (is(open, "[")) return items(named + 2, tokens_[open].other);  // after the comma
    if (!is(open, "(")) return std::nullopt;
    std::optional<std::size_t> arguments;
    for (std::size_t i = open + 1; i < tokens_[open].other; ++i) {
      if (is(i, "(") || is(i, "[") || is(i, "{")) {
        i = tokens_[i].other;
      } else if (is_keyword(i, "arguments")) {
        arguments = i + 2;
      }
    }
    if (arguments) return value(*arguments);
    // Elsewhere than as the program of a node it is only a word.
    if (named < 2 || !(is_keyword(named - 2, "executable") || is_keyword(named - 2, "exec"))) {
      return std::nullopt;
    }
    return file_error(Errc::kInvalidInput, file_, tokens_[named].line,
                      tokens_[named].text + " has no arguments here: write them there");
  }

  // Whether a string only tells people something, as far as what is around it tells.
  [[nodiscard]] bool is_about_text(std::size_t at, const PythonConditions& conditions) const {
    const auto statement = [&](std::size_t i) { return conditions.statement_of(tokens_[i].place); };
    const bool begins = at == 0 || statement(at - 1) != statement(at);
    if (tokens_[at].other == kNone && begins) return true;  // a documentation
    constexpr std::array<std::string_view, 5> kTexts = {"name", "description", "msg", "help",
                                                        "message"};
    constexpr std::array<std::string_view, 6> kPrinting = {"print",  "LogInfo",  ".info",
                                                           ".debug", ".warning", ".error"};
    const auto ends_with = [](std::string_view word, std::string_view end) {
      return word.size() >= end.size() && word.substr(word.size() - end.size()) == end;
    };
    constexpr int kOutwards = 4;
    for (int i = 0; i < kOutwards && at != kNone && at > 0; ++i, at = tokens_[at].other) {
      const bool named = at >= 2 && std::any_of(kTexts.begin(), kTexts.end(), [&](auto name) {
                           return is_keyword(at - 2, name);
                         });
      const Token& before = tokens_[at - 1];
      const bool printed =
          is(at, "(") && before.kind == Token::Kind::kWord &&
          std::any_of(kPrinting.begin(), kPrinting.end(),
                      [&](std::string_view name) { return ends_with(before.text, name); });
      if (named || printed) return true;
    }
    return false;
  }

 private:
  [[nodiscard]] bool is(std::size_t i, std::string_view sign) const {
    return i < tokens_.size() && tokens_[i].kind == Token::Kind::kSign && tokens_[i].text == sign;
  }
  [[nodiscard]] bool is_keyword(std::size_t i, std::string_view name) const {
    return !is_string(i) && tokens_[i].text == name && is(i + 1, "=");
  }
  [[nodiscard]] bool is_string(std::size_t i) const {
    return i < tokens_.size() && tokens_[i].kind == Token::Kind::kString;
  }

  [[nodiscard]] tl::unexpected<Error> computed(std::size_t i) const {
    const Token& token = tokens_[std::min(i, tokens_.size() - 1)];
    return file_error(Errc::kInvalidInput, file_, token.line,
                      "an argument is computed by '" + token.text + "': put its value there");
  }

  // The value ends there, and is not a part of a larger one.
  [[nodiscard]] bool ends(std::size_t i) const { return is(i, ",") || is(i, ")"); }

  [[nodiscard]] Result<std::optional<PythonArguments>> value(std::size_t i) const {
    if (is(i, "[")) {
      const std::size_t end = tokens_[i].other;
      return ends(end + 1) ? items(i + 1, end) : computed(end + 1);
    }
    if (i + 3 >= tokens_.size()) return computed(i);
    const bool as_shell = tokens_[i].text == "shlex.split" && !is_string(i) && is(i + 1, "(");
    const std::size_t said = as_shell ? i + 2 : i;
    const bool at_blanks = !as_shell && tokens_[i + 1].text == ".split" && is(i + 2, "(");
    if (!is_string(said) || !(at_blanks || as_shell)) return computed(said);
    const std::size_t end = tokens_[at_blanks ? i + 2 : i + 1].other;
    const bool says_blank =
        at_blanks && end == i + 4 && is_string(i + 3) && tokens_[i + 3].text == " ";
    if (end != i + 3 && !says_blank) return computed(i + 3);
    if (!ends(end + 1)) return computed(end + 1);
    const Token& text = tokens_[said];
    PythonArguments arguments{{}, text.line};
    if (as_shell) {
      auto words = launch_words(text.text, file_, text.line);
      if (!words) return tl::unexpected(std::move(words.error()));
      arguments.words = *std::move(words);
    } else {
      std::string line = text.text;
      std::replace(line.begin(), line.end(), '\n', ' ');
      for (const auto word : words_of(line)) arguments.words.emplace_back(word);
    }
    return std::optional(std::move(arguments));
  }

  // Items of a list: strings, numbers with a sign, or either of them in str().
  [[nodiscard]] Result<std::optional<PythonArguments>> items(std::size_t i, std::size_t end) const {
    PythonArguments arguments{{}, tokens_[std::min(i, end)].line};
    while (i < end) {
      const bool wrapped = tokens_[i].text == "str" && is(i + 1, "(");
      if (wrapped) i += 2;
      std::string word;
      if (!is_string(i)) {
        if (is(i, "-")) word = tokens_[i++].text;
        if (tokens_[i].kind != Token::Kind::kWord || !number_of(tokens_[i].text)) {
          return computed(i);
        }
      }
      arguments.words.push_back(word + tokens_[i++].text);
      if (wrapped && !is(i++, ")")) return computed(i - 1);
      if (i < end && !is(i++, ",")) return computed(i - 1);
    }
    return std::optional(std::move(arguments));
  }

  const std::vector<Token>& tokens_;
  const std::string& file_;
};

// Which statements give their value a name, and where a condition decides about the use of it.
class Variables {
 public:
  Variables(const std::vector<Token>& tokens, const PythonConditions& conditions)
      : conditions_(conditions) {
    auto statement = PythonConditions::kNone;
    for (std::size_t i = 0; i + 1 < tokens.size(); ++i) {
      const Token& token = tokens[i];
      const auto before = std::exchange(statement, conditions.statement_of(token.place));
      if (token.kind != Token::Kind::kWord) continue;
      const bool named = tokens[i + 1].kind == Token::Kind::kSign && tokens[i + 1].text == "=";
      if (named && statement != before) names_[statement] = token.text;
      const int line = conditions.line_of(token.place);
      if (!named && line != 0) decided_.emplace(token.text, line);
    }
  }

  // The line of a condition that decides about what a statement gives a name; 0: none.
  [[nodiscard]] int decided(PythonConditions::Place place) const {
    const auto name = names_.find(conditions_.statement_of(place));
    if (name == names_.end()) return 0;
    const auto use = decided_.find(name->second);
    return use == decided_.end() ? 0 : use->second;
  }

 private:
  const PythonConditions& conditions_;
  std::unordered_map<PythonConditions::Place, std::string> names_;
  std::unordered_map<std::string, int> decided_;
};

}  // namespace

Result<std::vector<PythonArguments>> python_arguments(const std::string& text,
                                                      const std::string& file) {
  PythonConditions conditions;
  const auto tokens = Tokens(text, file, conditions).all();
  if (!tokens) return tl::unexpected(tokens.error());
  const Calls calls(*tokens, file);
  const Variables variables(*tokens, conditions);
  std::vector<PythonArguments> found;
  std::vector<bool> read(tokens->size());  // each bracket is read once: the work is bounded
  for (std::size_t i = 0; i < tokens->size(); ++i) {
    const Token& token = (*tokens)[i];
    const bool is_string = token.kind == Token::Kind::kString;
    const bool is_program = is_string && token.text == kStaticPublisher;
    const bool is_text = is_string || token.text.find('\\') != std::string::npos;
    if (!is_program && !(is_text && mentions_publisher(token.text))) continue;
    if (calls.is_about_text(i, conditions)) continue;
    if (is_program && token.other != kNone && read[token.other]) continue;
    std::optional<PythonArguments> arguments;
    if (is_program && token.other != kNone) {
      read[token.other] = true;
      auto around = calls.around(token.other, i);
      if (!around) return tl::unexpected(std::move(around.error()));
      arguments = *std::move(around);
    }
    if (!arguments) return file_error(Errc::kInvalidInput, file, token.line, unread_start());
    const int decided = conditions.line_of(token.place);
    if (const int at = decided != 0 ? decided : variables.decided(token.place); at != 0) {
      return file_error(
          Errc::kInvalidInput, file, at,
          std::string(kStaticPublisher) + " is started under a condition: write what happens");
    }
    arguments->line = token.line;
    found.push_back(*std::move(arguments));
  }
  return found;
}

}  // namespace tfdude
