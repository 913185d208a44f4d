// Commands of shell scripts that start static_transform_publisher.

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <utility>

#include "description/file_edges.hpp"
#include "description/file_text.hpp"
#include "description/launch_starts.hpp"
#include "description/shell_text.hpp"

namespace tfdude {
namespace {

// A simple command: without its redirections, and up to what divides it from the next.
struct ShellCommand {
  std::vector<ShellWord> words;
  int line = 0;
  int mention = 0;  // the line of a here-document that names the program; 0: none
};

class ShellCommands : private ShellText {
 public:
  ShellCommands(std::string_view text, const std::string& file)
      : ShellText(text, file, 1, ShellRules::kShell) {}

  [[nodiscard]] Result<std::vector<ShellCommand>> all() {
    while (at_ < text_.size()) {
      Result<void> ok;
      if (joins_lines()) {
        join_lines();
      } else if (is_blank(here())) {
        ++at_;
      } else if (here() == '\n') {
        ok = end_line();
      } else if (here() == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
      } else if (const auto size = size_of_redirection(); size > 0) {
        ok = redirection(size);
      } else if (command_.line == 0 && here() == '(' && here(1) == '(') {
        skip_arithmetic();
      } else if (is_one_of(here(), ";&|()")) {
        end_command();
        ++at_;
      } else {
        begin_command();
        ok = word(command_.words.emplace_back());
      }
      if (!ok) return tl::unexpected(std::move(ok.error()));
      if (commands_.size() > kMostCommands) {
        return file_error(Errc::kTooMuch, file_, line_,
                          "more than " + std::to_string(kMostCommands) + " commands");
      }
    }
    if (auto ok = end_line(); !ok) return tl::unexpected(std::move(ok.error()));
    return std::move(commands_);
  }

 private:
  static constexpr std::size_t kMostCommands = 200'000;

  struct HereDocument {
    std::string end;
    bool is_indented = false;
    int line = 0;
    std::size_t command = 0;  // whose input it is
  };

  // Its "<<" is no here-document.
  void skip_arithmetic() {
    const std::size_t end = std::min(text_.find("))", at_), text_.size());
    line_ += static_cast<int>(std::count(text_.begin() + static_cast<long>(at_),
                                         text_.begin() + static_cast<long>(end), '\n'));
    at_ = std::min(end + 2, text_.size());
  }

  void begin_command() {
    if (command_.line == 0) command_.line = line_;
  }

  void end_command() {
    if (command_.line == 0) return;
    commands_.push_back(std::exchange(command_, {}));
  }

  // The here-documents of a line stand below it.
  [[nodiscard]] Result<void> end_line() {
    end_command();
    ++at_;
    ++line_;
    for (const HereDocument& document : std::exchange(documents_, {})) {
      bool is_ended = false;
      while (!is_ended && at_ < text_.size()) {
        const std::size_t end = std::min(text_.find('\n', at_), text_.size());
        std::string_view line = text_.substr(at_, end - at_);
        if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
        const std::size_t tabs = line.find_first_not_of('\t');
        if (document.is_indented) line.remove_prefix(std::min(tabs, line.size()));
        is_ended = line == document.end;
        ShellCommand& command = commands_[document.command];
        if (command.mention == 0 && mentions_publisher(line)) command.mention = line_;
        at_ = end + 1;
        ++line_;
      }
      if (!is_ended) return error(document.line, "a here-document");
    }
    return {};
  }

  // Of the operator, as in 2>&1, &>>log or <<EOF.
  [[nodiscard]] std::size_t size_of_redirection() const {
    std::size_t size = 0;
    if (here() == '&') {
      size = 1;
    } else {
      while (std::isdigit(static_cast<unsigned char>(here(size))) != 0) ++size;
    }
    const char direction = here(size);
    if (direction != '>' && (direction != '<' || here() == '&')) return 0;
    while (here(size) == direction) ++size;
    return is_one_of(here(size), direction == '<' ? "&->" : "&|") ? size + 1 : size;
  }

  [[nodiscard]] Result<void> redirection(std::size_t size) {
    begin_command();
    const std::string_view sign = text_.substr(at_, size);
    at_ += size;
    while (is_blank(here())) ++at_;
    ShellWord target;
    const int line = line_;
    if (!is_one_of(here(), "\n;&|()<>")) {
      if (auto ok = word(target); !ok) return ok;
    }
    const auto signs = std::count(sign.begin(), sign.end(), '<');
    if (signs == 2) {
      documents_.push_back({target.text, sign.back() == '-', line, commands_.size()});
    } else if (signs == 3 && mentions_publisher(target.text)) {
      command_.mention = line;
    }
    return {};
  }

  ShellCommand command_;
  std::vector<ShellCommand> commands_;
  std::vector<HereDocument> documents_;
};

// The word that says what a command does.
std::string_view name_of(const ShellCommand& command) {
  constexpr std::string_view kBefore[] = {"then", "do", "else", "{", "!", "time"};
  for (const ShellWord& word : command.words) {
    if (std::find(std::begin(kBefore), std::end(kBefore), word.text) == std::end(kBefore)) {
      return word.text;
    }
  }
  return {};
}

bool is_one_of(std::string_view name, std::initializer_list<std::string_view> names) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// How many more blocks a command begins than it ends: conditions and loops.
int opened_by(std::string_view name) {
  if (is_one_of(name, {"if", "for", "while", "until", "case"})) return 1;
  return is_one_of(name, {"fi", "done", "esac"}) ? -1 : 0;
}

// Whether the command only prints, or looks for, what it is given.
bool is_about_text(std::string_view name) {
  return is_one_of(name, {"echo", "printf", "cat", "tee", "grep", "pgrep", "pkill", "killall"});
}

}  // namespace

Result<std::vector<LaunchStart>> starts_in_shell(const std::string& text, const std::string& name) {
  const auto commands = ShellCommands(text, name).all();
  if (!commands) return tl::unexpected(commands.error());
  const auto error = [&](int line, const std::string& message) {
    return file_error(Errc::kInvalidInput, name, line, kStaticPublisher + message);
  };
  std::vector<LaunchStart> starts;
  int blocks = 0;
  for (const ShellCommand& command : *commands) {
    const std::string_view what = name_of(command);
    blocks += opened_by(what);
    if (is_about_text(what)) continue;
    int mention = command.mention;
    auto program = command.words.end();
    for (auto word = command.words.begin(); word != command.words.end(); ++word) {
      if (program == command.words.end() && is_publisher(word->text)) program = word;
      const bool is_text = !is_publisher(word->text) && mentions_publisher(word->text);
      if (mention == 0 && is_text) mention = command.line;
    }
    if (mention != 0) {
      return error(mention, " stands in a text here: write its start as a command of its own");
    }
    if (program == command.words.end()) continue;
    if (blocks > 0) {
      return error(command.line, " is started under a condition, or in a loop: write what happens");
    }
    const bool of_tf = program != command.words.begin() && (program - 1)->text == "tf";
    LaunchStart start{{}, of_tf, command.line};
    for (auto word = program + 1; word != command.words.end(); ++word) {
      if (word->is_expanded) return error(command.line, ": " + launch_substitution(word->text));
      start.words.push_back(word->text);
    }
    starts.push_back(std::move(start));
  }
  return starts;
}

}  // namespace tfdude
