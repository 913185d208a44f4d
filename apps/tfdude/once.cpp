// The command line as it is started. Another process of this computer may have the answer at once;
// everything else is done by the program that has the library. This one becomes that: it has no
// library itself, as loading that and Fast DDS takes longer than the answer.

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <unistd.h>

#include <CLI/CLI.hpp>

#include "tfdude/client/one_shot.hpp"

#include "../exit_status.hpp"
#include "../network_options.hpp"
#include "../numbers.hpp"
#include "../rendering/json.hpp"
#include "../rendering/terminal.hpp"
#include "../rendering/text.hpp"
#include "../standard_descriptors.hpp"
#include "../standard_output.hpp"
#include "path_printing.hpp"
#include "typed_stamp.hpp"

namespace {

using namespace tfdude;

// Those command lines that can be answered here: the same options as those of the whole program,
// but fewer. All others are errors here.
struct Typed {
  Options options;
  bool json = false;
  cli::AngleUnit angles = cli::kRadian;
  cli::PathPrinting path;
  std::string at;
  bool exists = false;
};

void add_options(CLI::App& app, Typed& typed) {
  app.require_subcommand(1);
  app.fallthrough();
  app.set_help_flag();
  cli::add_domain_options(app, typed.options);
  cli::add_clock_option(app, [&typed](ClockKind kind) { typed.options.clock = kind; });
  app.add_flag("--json", typed.json);
  app.add_flag_callback("--deg", [&typed] { typed.angles = cli::kDegree; });
  CLI::App* lookup = app.add_subcommand("lookup");
  typed.path.add_ends(*lookup);
  typed.path.add_printing(*lookup);
  // The whole program says that no text is no number.
  lookup->add_option("--at", typed.at)->check([](const std::string& text) {
    return std::string(text.empty() ? "is empty" : "");
  });
  CLI::App* exists = app.add_subcommand("exists");
  exists->add_option("ID", typed.path.a)->required();
  exists->callback([&typed] { typed.exists = true; });
}

int print_answer(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  return cli::status_with_output("tfdude", cli::kDone);
}

int answer_exists(const Typed& typed) {
  return print_answer(typed.json ? cli::dump({{"id", typed.path.a}, {"exists", true}}) + "\n"
                                 : "yes\n");
}

int answer_lookup(const Typed& typed, const OneShotAnswer& found, Time now) {
  cli::PathFacts facts;
  facts.path = found.path;
  if (typed.json) return print_answer(cli::dump(typed.path.json(found.X_AB, facts)) + "\n");
  // The age is not known if the stamps are of another clock.
  const bool same = std::all_of(found.path.begin(), found.path.end(), [](const PathSegment& one) {
    return !one.clock || *one.clock == ClockKind::kSystem;
  });
  if (found.X_AB.stamp) {
    facts.stamp =
        cli::describe_stamp(*found.X_AB.stamp, same ? std::optional<Time>(now) : std::nullopt);
  }
  return print_answer(typed.path.text(found.X_AB, facts, typed.angles) +
                      cli::describe(found.X_AB.basis));
}

// The exit status; none: the whole program has to answer.
std::optional<int> answer_here(int argc, char** argv) {
  const bool may = std::any_of(argv + 1, argv + argc, [](const char* word) {
    return std::string_view(word) == "lookup" || std::string_view(word) == "exists";
  });
  if (!may) return std::nullopt;
  Typed typed;
  CLI::App app;
  add_options(app, typed);
  cli::require_numbers(app);
  try {
    app.parse(cli::arguments_of(argc, argv));
  } catch (const CLI::ParseError&) {
    return std::nullopt;
  }
  if (typed.options.clock != ClockKind::kSystem || typed.path.geodetic) return std::nullopt;
  OneShotQuestion question{typed.path.a, typed.exists ? typed.path.a : typed.path.b, {}};
  if (!typed.at.empty()) {
    const auto at = cli::parse_stamp(typed.at, cli::wall_clock());
    if (!at) return std::nullopt;
    question.at = *at;
  }
  const auto found = look_up_once(question, typed.options);
  if (!found) return std::nullopt;
  return typed.exists ? answer_exists(typed) : answer_lookup(typed, *found, cli::wall_clock());
}

int become_whole_program(char** argv) {
  std::array<char, 4096> own{};
  const ssize_t size = readlink("/proc/self/exe", own.data(), own.size() - 1);
  std::string program(own.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  program.resize(program.rfind('/') + 1);
  program += TFDUDE_WHOLE_PROGRAM;
  execv(program.c_str(), argv);
  std::fprintf(stderr, "tfdude: cannot start %s: %s\n", program.c_str(), std::strerror(errno));
  return cli::kWrongUsage;
}

}  // namespace

int main(int argc, char** argv) {
  cli::hold_standard_descriptors();
  cli::terminal() = cli::terminal_of(STDOUT_FILENO);
  if (const auto status = answer_here(argc, argv)) return *status;
  return become_whole_program(argv);
}
