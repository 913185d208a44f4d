#include "manual.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string_view>

#include "tfdude/types/version.hpp"

#include "usage.hpp"

namespace tfdude::cli {
namespace {

constexpr std::string_view kExample = "Example: ";
constexpr std::string_view kExitStatus = "Exit status: ";

// Text for roff, which reads backslashes, hyphens, and dots at the beginning of lines otherwise.
std::string escaped(std::string_view text) {
  std::string roff;
  for (const char c : text) {
    const bool begins = roff.empty() || roff.back() == '\n';
    if (begins && (c == '.' || c == '\'')) roff += "\\&";
    if (c == '\\') {
      roff += "\\e";
    } else if (c == '-') {
      roff += "\\-";
    } else {
      roff += c;
    }
  }
  return roff;
}

// The lines of a footer, by the label with which they begin.
struct Footer {
  std::vector<std::string> remarks;  // without a label
  std::vector<std::string> statuses;
  std::vector<std::string> examples;
};

Footer footer_of(const CLI::App& app) {
  Footer footer;
  std::istringstream lines(app.get_footer());
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(kExample, 0) == 0) {
      footer.examples.push_back(line.substr(kExample.size()));
    } else if (line.rfind(kExitStatus, 0) == 0) {
      footer.statuses.push_back(line.substr(kExitStatus.size()));
    } else if (!line.empty()) {
      footer.remarks.push_back(line);
    }
  }
  return footer;
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

// Writes pages of roff's macros "man", with the words that CLI11 has for --help.
class Pages : private CLI::Formatter {
 public:
  Pages(const CLI::App& program, std::string name, std::string folder,
        const std::vector<ManualSection>& more)
      : program_(program), name_(std::move(name)), folder_(std::move(folder)), more_(more) {}

  void write() const { write(program_, name_); }

 private:
  void ending(std::ostream& out, const Footer& footer, bool whole) const {
    const auto& own = footer.statuses;
    for (const std::string& status : own.empty() ? footer_of(program_).statuses : own) {
      section(out, "EXIT STATUS", status);
    }
    const char* before = ".SH EXAMPLES\n";
    for (const std::string& example : footer.examples) {
      out << before << ".nf\n" << escaped(example) << "\n.fi\n";
      before = ".PP\n";
    }
    if (whole) return;
    out << ".SH SEE ALSO\n.BR " << escaped(name_) << " (1),\nfor the options of all commands\n";
  }

  void write(const CLI::App& app, const std::string& called) const {
    std::string page = called;
    std::replace(page.begin(), page.end(), ' ', '-');
    const bool whole = &app == &program_;
    std::ofstream out(folder_ + "/" + page + ".1");
    out << R"(.TH ")" << escaped(upper(page)) << R"(" 1 "" ")" << version() << R"(" "tf\-dude")"
        << '\n';
    section(out, "NAME", page + " - " + description(app));
    out << ".SH SYNOPSIS\n.B " << escaped(called) << '\n' << escaped(usage(app)) << '\n';
    const Footer footer = footer_of(app);
    const char* heading = ".SH DESCRIPTION\n";
    for (const std::string& line : footer.remarks) {
      out << heading << escaped(line) << '\n';
      heading = ".PP\n";
    }
    options(out, app, "ARGUMENTS", true);
    options(out, app, "OPTIONS", false);
    const auto commands = commands_of(app);
    if (!commands.empty()) out << ".SH COMMANDS\n";
    std::string group = "Subcommands";  // CLI11's name for those without a group
    for (const CLI::App* command : commands) {
      if (command->get_group() != group)
        out << ".SS " << escaped(group = command->get_group()) << "\n";
      out << ".TP\n.BR " << escaped(page + "-" + command->get_name()) << " (1)\n"
          << escaped(command->get_description()) << '\n';
    }
    for (const ManualSection& one : whole ? more_ : std::vector<ManualSection>()) {
      section(out, one.first, one.second);
    }
    ending(out, footer, whole);
    out.flush();
    if (!out) throw CLI::FileError("cannot write " + folder_ + "/" + page + ".1");
    for (const CLI::App* command : commands) {
      // The page of a command that is another program is that program's.
      if (!command->get_allow_extras()) write(*command, called + " " + command->get_name());
    }
  }

  static std::string version() {
    const std::string line = version_line();
    return escaped(line.substr(0, line.find_first_of(",(;")));
  }

  // Without the name of the program, with which its description begins.
  [[nodiscard]] std::string description(const CLI::App& app) const {
    const std::string text = app.get_description();
    const std::string prefix = name_ + ": ";
    return text.rfind(prefix, 0) == 0 ? text.substr(prefix.size()) : text;
  }

  [[nodiscard]] std::string usage(const CLI::App& app) const {
    std::string text = make_usage(&app, "");
    text.erase(0, text.find(' '));
    return CLI::detail::trim(text);
  }

  static std::vector<const CLI::App*> commands_of(const CLI::App& app) {
    return app.get_subcommands(
        [](const CLI::App* command) { return !command->get_group().empty(); });
  }

  static void section(std::ostream& out, const std::string& title, const std::string& text) {
    out << ".SH " << title << '\n' << escaped(text) << '\n';
  }

  void options(std::ostream& out, const CLI::App& app, const char* title, bool positional) const {
    const auto shown = app.get_options([positional](const CLI::Option* option) {
      return !option->get_group().empty() && option->get_positional() == positional;
    });
    if (!shown.empty()) out << ".SH " << title << '\n';
    for (const CLI::Option* option : shown) {
      out << ".TP\n\\fB" << escaped(make_option_name(option, positional)) << "\\fR"
          << escaped(make_option_opts(option)) << '\n'
          << escaped(option->get_description()) << '\n';
    }
  }

  const CLI::App& program_;
  const std::string name_;
  const std::string folder_;
  const std::vector<ManualSection>& more_;
};

}  // namespace

void add_manual(CLI::App& app, std::vector<ManualSection> more) {
  const std::string name = program_name(app);
  app.add_option_function<std::string>("--manual",
                                       [&app, name, more = std::move(more)](const std::string& to) {
                                         Pages(app, name, to, more).write();
                                         throw CLI::Success();
                                       })
      ->group("");
}

}  // namespace tfdude::cli
