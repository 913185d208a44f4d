#include "usage.hpp"

#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

// A program with commands, as tfdude.
struct Program {
  Program() {
    app.require_subcommand(1);
    app.fallthrough();
    app.add_flag("--json", json, "one JSON object per answer");
    auto* tree = app.add_subcommand("tree", "draw all frames");
    tree->add_flag("--watch", watch, "redraw it");
    auto* lookup = app.add_subcommand("lookup", "pose of B in A");
    lookup->add_option("A", a, "a frame")->required();
    lookup->add_option("B", b, "another one")->required();
    lookup->add_option("--at", at, "the instant")->type_name("SECONDS");
    app.add_subcommand("roots", "list roots");
    auto* keys = app.add_subcommand("keys", "make keys");
    keys->require_subcommand(1);
    keys->add_subcommand("issue", "an identity");
    keys->add_subcommand("list", "all of them");
  }

  std::string said(std::vector<std::string> typed) {
    std::vector<std::string> last_first(typed.rbegin(), typed.rend());
    try {
      app.parse(last_first);
    } catch (const CLI::ParseError& error) {
      return usage_error(app, error);
    }
    return "nothing";
  }

  CLI::App app{"tfdude: where is B?"};
  bool json = false;
  bool watch = false;
  std::string a;
  std::string b;
  double at = 0;
};

std::string said(std::vector<std::string> typed) { return Program().said(std::move(typed)); }

}  // namespace

TEST_CASE("a wrong command line is answered with what was typed and what is wanted") {
  CHECK(said({"tree", "--wait", "1"}) == "tree has no --wait; its options are --watch");
  CHECK(said({"tree", "--wacth"}) == "tree has no --wacth; did you mean --watch?");
  CHECK(said({"tree", "--jsno"}) == "tree has no --jsno; did you mean --json?");
  CHECK(said({"roots", "--all=1"}) == "roots has no --all: it has no options of its own");
  CHECK(said({"lookup", "x", "y", "z"}) == "lookup takes A B, and not 'z', too");
  CHECK(said({"roots", "x"}) == "roots takes no arguments, and not 'x', too");
  CHECK(said({"lookup"}) == "lookup: A is required; wanted: lookup A B");
  CHECK(said({"lookup", "x"}) == "lookup: B is required; wanted: lookup A B");
  CHECK(said({"lookup", "x", "--of", "y"}) == "lookup has no --of; its options are --at");
  CHECK(said({"lookup", "x", "y", "--at"}) == "lookup: --at wants SECONDS: the instant");
}

TEST_CASE("a command that does not exist is answered with the nearest one") {
  CHECK(said({"lokup", "x", "y"}) == "no command 'lokup'; did you mean lookup?");
  CHECK(said({"quux"}) == "no command 'quux'");
  CHECK(said({}) == "no subcommand given");
  CHECK(said({"keys"}) == "keys needs one of issue or list");
  CHECK(said({"keys", "isue"}) == "keys has no command 'isue'; did you mean issue?");
}

TEST_CASE("a program without commands names itself") {
  CLI::App app{"tfduded: owns frames"};
  std::string partition;
  app.add_option("--partition", partition, "its name");
  const auto said = [&](const std::string& typed) {
    try {
      app.parse(std::vector<std::string>{typed});
    } catch (const CLI::ParseError& error) {
      return usage_error(app, error);
    }
    return std::string("nothing");
  };
  CHECK(said("--partiton=x") == "tfduded has no --partiton; did you mean --partition?");
  CHECK(said("x") == "tfduded takes no arguments, and not 'x', too");
}

TEST_CASE("help lists commands before the options of all commands") {
  CLI::App app{"tfdude: where is B?"};
  bool json = false;
  app.add_flag("--json", json, "one JSON object per answer");
  show_commands_first(app);
  app.add_subcommand("lookup", "pose of B in A")->group("Ask");
  const std::string help = app.help();
  CHECK(help.find("lookup") < help.find("--json"));
  CHECK(help.find("Ask") < help.find("lookup"));
}

}  // namespace tfdude::cli
