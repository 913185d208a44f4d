// Each command of the command line: its output as text and as JSON, and its exit status.

#include <algorithm>
#include <cmath>
#include <csignal>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::Approx;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::in_time;
using testing::Process;
using testing::text;
using testing::ThesisDaemons;
using Arguments = std::vector<std::string>;

/// One line of JSON, and nothing else.
json parse_line(const CliResult& result) {
  CHECK(std::count(result.out.begin(), result.out.end(), '\n') == 1);
  return json::parse(result.out);
}

json object(const ThesisDaemons& d, Arguments arguments) {
  arguments.insert(arguments.begin(), "--json");
  const CliResult result = d.domain.cli(arguments);
  INFO(result.err);
  CHECK(result.status == 0);
  return parse_line(result);
}

// As the help lists them.
std::vector<std::string> commands_of(const std::string& help) {
  std::vector<std::string> commands;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    // Options begin with a hyphen.
    if (line.rfind("  ", 0) != 0 || line[2] < 'a' || line[2] > 'z') continue;
    commands.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return commands;
}

}  // namespace

TEST_CASE("cli: queries are answered as text") {
  const ThesisDaemons d;
  CHECK(text(d, {"tree"}) ==
        "world  [robot]\n"
        "└─ robot_1  [robot]\n"
        "   ├─ arm_1  [arms]\n"
        "   │  ├─ arm_2  [arms]\n"
        "   │  ├─ arm_left  [arms]\n"
        "   │  │  └─ hand_left  [arms]\n"
        "   │  └─ arm_right  [arms]\n"
        "   └─ robot_2  [robot]\n"
        "      └─ camera  [robot]\n");
  CHECK(text(d, {"frames"}) ==
        "arm_1\narm_2\narm_left\narm_right\ncamera\nhand_left\nrobot_1\nrobot_2\nworld\n");
  const std::string partitions = text(d, {"partitions"});
  CHECK_THAT(partitions, ContainsSubstring("partition            frames host "));
  CHECK_THAT(partitions, ContainsSubstring("arms                      5 "));
  CHECK_THAT(partitions, ContainsSubstring(" " + std::to_string(d.robot.pid()) + " "));
  CHECK(text(d, {"roots"}) == "world\n");
  CHECK(text(d, {"parent", "arm_1"}) == "robot_1\n");
  CHECK(text(d, {"parent", "world"}) == "(root)\n");
  CHECK(text(d, {"children", "robot_1"}) == "arm_1\nrobot_2\n");
  CHECK(text(d, {"exists", "camera"}) == "yes\n");
  const CliResult missing = d.domain.cli({"exists", "nowhere"});
  CHECK(missing.status == 1);
  CHECK(missing.out == "no\n");
  const std::string brief = text(d, {"lookup", "world", "robot_1"});
  CHECK_THAT(brief, ContainsSubstring("translation  2.400000  -1.150000  0.080000  m\n"));
  CHECK_THAT(brief, ContainsSubstring("rpy          0.004000  -0.011000  0.620000  rad\n"));
  CHECK_THAT(brief, ContainsSubstring("std dev      0.021338  0.029062  0.005007  m"));
  CHECK_THAT(brief, !ContainsSubstring("covariance"));
  CHECK_THAT(text(d, {"lookup", "world", "hand_left", "--cov"}),
             ContainsSubstring("\ncovariance "));
}

TEST_CASE("cli: queries are answered as JSON") {
  const ThesisDaemons d;
  const json frames = object(d, {"frames"}).at("frames");
  REQUIRE(frames.size() == 9);
  CHECK(frames[0] == json({{"id", "arm_1"},
                           {"parent", "robot_1"},
                           {"partition", "arms"},
                           {"attached", true},
                           {"reachable", true}}));
  CHECK(frames[8] == json({{"id", "world"},
                           {"parent", nullptr},
                           {"partition", "robot"},
                           {"attached", false},
                           {"reachable", true}}));
  CHECK(object(d, {"tree"}).at("frames") == frames);
  const json partitions = object(d, {"partitions"}).at("partitions");
  REQUIRE(partitions.size() == 2);
  CHECK(partitions[0].at("name") == "arms");
  CHECK(partitions[0].at("frames") == 5);
  CHECK(partitions[0].at("pid") == d.arms->pid());
  CHECK(partitions[0].at("reachable") == true);
  CHECK(partitions[0].at("host").get<std::string>() != "");
  CHECK(object(d, {"roots"}) == json({{"roots", {"world"}}}));
  CHECK(object(d, {"parent", "arm_1"}) == json({{"id", "arm_1"}, {"parent", "robot_1"}}));
  CHECK(object(d, {"parent", "world"}).at("parent").is_null());
  CHECK(object(d, {"children", "robot_1"}) == json({{"children", {"arm_1", "robot_2"}}}));
  CHECK(object(d, {"exists", "camera"}) == json({{"id", "camera"}, {"exists", true}}));
  const CliResult missing = d.domain.cli({"--json", "exists", "nowhere"});
  CHECK(missing.status == 1);
  CHECK(parse_line(missing) == json({{"id", "nowhere"}, {"exists", false}}));
  const json lookup = object(d, {"lookup", "camera", "hand_left"});
  CHECK(lookup.at("from") == "camera");
  CHECK(lookup.at("to") == "hand_left");
  CHECK(lookup.at("translation").size() == 3);
  CHECK(lookup.at("rotation").size() == 4);
  CHECK(lookup.at("covariance").size() == 6);
  CHECK(lookup.at("partitions") == json({"robot", "arms"}));
  const CliResult refused = d.domain.cli({"lookup", "camera", "nowhere", "--json"});
  CHECK(refused.status == 1);
  const json error = parse_line(refused).at("error");
  CHECK(error.at("code") == "unknown_end");
  CHECK_THAT(error.at("message").get<std::string>(), ContainsSubstring("'nowhere'"));
  CHECK(error.at("frame") == "nowhere");
}

TEST_CASE("cli: changes are made and confirmed") {
  const ThesisDaemons d;
  CHECK(text(d, {"add", "tool", "--parent", "camera", "--xyz", "0.1", "0", "-0.2"}) ==
        "added tool\n");
  CHECK(object(d, {"add", "island", "--parent", "", "--partition", "arms"}) ==
        json({{"done", "added"}, {"id", "island"}}));
  CHECK(object(d, {"lookup", "camera", "tool"}).at("translation") == json({0.1, 0.0, -0.2}));
  CHECK(text(d, {"roots"}) == "island\nworld\n");
  CHECK(text(d, {"update", "tool", "--quat", "0", "0", "1", "0", "--stddev", "0.5", "0", "0", "0",
                 "0", "0"}) == "updated tool\n");
  const json updated = object(d, {"lookup", "camera", "tool"});
  CHECK(updated.at("rotation") == json({0.0, 0.0, 1.0, 0.0}));
  CHECK(updated.at("covariance")[0][0] == 0.25);
  CHECK(updated.at("translation") == json({0.1, 0.0, -0.2}));
  CHECK(text(d, {"update", "tool", "--xyz", "-.5", "1e-3", ".25"}) == "updated tool\n");
  const json placed = object(d, {"lookup", "camera", "tool"});
  CHECK(placed.at("translation") == json({-0.5, 0.001, 0.25}));
  CHECK(placed.at("rotation") == updated.at("rotation"));
  CHECK(placed.at("covariance") == updated.at("covariance"));
  CHECK(text(d, {"update", "tool", "--rpy", "0", "0", "-.5"}) == "updated tool\n");
  CHECK(object(d, {"lookup", "camera", "tool"}).at("rotation")[2] ==
        Approx(std::sin(-0.25)).epsilon(1e-12));
  CHECK(text(d, {"update", "tool", "--cov", "9e9", "0", "0", "0", "0", "0", "1", "0",   "0",
                 "0",      "0",    "1",     "0",   "0", "0", "1", "0", "0", "1", "-.5", "1"}) ==
        "updated tool\n");
  const json spread = object(d, {"lookup", "camera", "tool"}).at("covariance");
  CHECK(spread[0][0] == 9e9);
  CHECK(spread[4][5] == -0.5);
  CHECK(text(d, {"update", "tool", "--quat", "0", "0", "1", "0", "--stddev", "0.5", "0", "0", "0",
                 "0", "0"}) == "updated tool\n");
  CHECK(object(d, {"update", "tool", "--xyz", "1", "2", "3"}).at("done") == "updated");
  const json again = object(d, {"lookup", "camera", "tool"});
  CHECK(again.at("translation") == json({1.0, 2.0, 3.0}));
  CHECK(again.at("rotation") == updated.at("rotation"));
  CHECK(again.at("covariance") == updated.at("covariance"));
  // A move keeps the edge's value, or takes a new one.
  CHECK(text(d, {"move", "tool", "--parent", "island"}) == "moved tool\n");
  CHECK(text(d, {"parent", "tool"}) == "island\n");
  CHECK(object(d, {"lookup", "island", "tool"}).at("covariance")[0][0] == 0.25);
  CHECK(object(d, {"move", "tool", "--parent", "arm_1", "--xyz", "1", "2", "3"}) ==
        json({{"done", "moved"}, {"id", "tool"}}));
  CHECK(object(d, {"lookup", "arm_1", "tool"}).at("translation") == json({1.0, 2.0, 3.0}));
  CHECK(text(d, {"remove", "arm_1"}) == "removed arm_1\n");
  CHECK(text(d, {"frames"}) == "camera\nisland\nrobot_1\nrobot_2\nworld\n");
}

TEST_CASE("cli: watch polls, and continues after its daemons have ended") {
  ThesisDaemons d;
  Process watch = d.domain.start_cli({"--json", "watch", "world", "hand_left", "--rate", "50"});
  const auto lines = [&watch] {
    (void)watch.runs();
    return std::count(watch.out().begin(), watch.out().end(), '\n');
  };
  REQUIRE(eventually([&] { return lines() >= 3; }));
  CHECK(json::parse(*watch.wait_for_line("{", in_time())).at("to") == "hand_left");
  d.arms->freeze();
  const auto complaint = watch.wait_for_line("{\"error\"", in_time());
  REQUIRE(complaint);
  CHECK_THAT(*complaint, ContainsSubstring("'arms'"));
  d.arms->signal(SIGCONT);
  const auto before = std::count(watch.out().begin(), watch.out().end(), '\n');
  CHECK(eventually([&] {
    return lines() > before && watch.out().rfind("{\"cov") > watch.out().rfind("{\"err");
  }));
  watch.signal(SIGINT);
  CHECK(watch.wait(in_time()) == 0);
}

TEST_CASE("cli: answers have colours and wide tables on a terminal only") {
  const ThesisDaemons d;
  (void)text(d, {"add", std::string(30, 'n'), "--parent", "camera"});
  const auto on_terminal = [&](const std::string& before, const std::string& command) {
    const std::string run = before + TFDUDE_CLI " --domain " + std::to_string(d.domain.number()) +
                            " --profile " TFDUDE_LOOPBACK_PROFILE " " + command;
    Process script({"/usr/bin/env", "TERM=xterm", "script", "-qec", run, "/dev/null"});
    return testing::finish(script).out;
  };
  const std::string escape = "\x1b[";
  CHECK_THAT(text(d, {"tree"}), !ContainsSubstring(escape));
  CHECK_THAT(on_terminal("", "tree"), ContainsSubstring(escape));
  CHECK_THAT(on_terminal("NO_COLOR=1 ", "tree"), !ContainsSubstring(escape));
  CHECK_THAT(on_terminal("TERM=dumb ", "tree"), !ContainsSubstring(escape));
  CHECK_THAT(on_terminal("", "--json tree"), !ContainsSubstring(escape));
  CHECK_THAT(on_terminal("", "lookup world nowhere"), ContainsSubstring(escape + "31mtfdude:"));
  // The column of names has 22 of 80 columns, and 33 of 120.
  (void)text(d, {"update", std::string(30, 'n'), "--xyz", "1", "0", "0", "--stamp", "-1"});
  CHECK_THAT(on_terminal("stty cols 80; ", "monitor --once"),
             !ContainsSubstring(std::string(30, 'n')));
  CHECK_THAT(on_terminal("stty cols 120; ", "monitor --once"),
             ContainsSubstring(std::string(30, 'n')));
  // What is no terminal has no width.
  CHECK_THAT(text(d, {"monitor", "--once"}), ContainsSubstring(std::string(30, 'n')));
}

TEST_CASE("cli: every command has help with an example") {
  const testing::TestDomain domain;
  const CliResult all = domain.cli({"--help"});
  CHECK(all.status == 0);
  const std::vector<std::string> commands = commands_of(all.out);
  CHECK(commands.size() == 39);
  for (const std::string& command : commands) {
    const CliResult help = domain.cli({command, "--help"});
    CHECK(help.status == 0);
    CHECK(help.err.empty());
    CHECK_THAT(help.out, ContainsSubstring("Example: tfdude ") && ContainsSubstring(command));
  }
}

TEST_CASE("cli: nothing is written into what takes the place of a closed standard output") {
  const ThesisDaemons d;
  for (const std::string command : {"tree", "lookup world camera"}) {
    CAPTURE(command);
    testing::Process process({"/bin/sh", "-c", "exec \"$0\" \"$@\" " + command + " >&-", TFDUDE_CLI,
                              "--domain", std::to_string(d.domain.number()), "--profile",
                              TFDUDE_LOOPBACK_PROFILE});
    const CliResult result = testing::finish(process);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, ContainsSubstring("standard output: Bad file descriptor"));
  }
}

TEST_CASE("cli: an answer that cannot be written is an error") {
  const ThesisDaemons d;
  const auto into_full_disk = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(),
                     {"/bin/sh", "-c", "exec \"$@\" >/dev/full", "sh", TFDUDE_CLI, "--domain",
                      std::to_string(d.domain.number()), "--profile", TFDUDE_LOOPBACK_PROFILE});
    testing::Process process(arguments);
    return testing::finish(process);
  };
  // The last ones print until they are interrupted.
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--help"},
                                             {"--version"},
                                             {"tree", "--help"},
                                             {"tree"},
                                             {"--json", "lookup", "world", "camera"},
                                             {"watch", "world", "camera"},
                                             {"tree", "--watch"}}) {
    CAPTURE(arguments);
    const CliResult result = into_full_disk(arguments);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, ContainsSubstring("tfdude: standard output: "));
  }
}

TEST_CASE("cli: export says that no partition answers") {
  const testing::TestDomain domain;
  const CliResult result = domain.cli({"--timeout", "300", "export", "-", "--format", "ros2"});
  CHECK(result.status == 3);
  CHECK(result.out.empty());
  CHECK_THAT(result.err, ContainsSubstring("no partition answers in domain"));
}

TEST_CASE("cli: help lists lookup first, and the options of all commands last") {
  const testing::TestDomain domain;
  const std::string help = domain.cli({"--help"}).out;
  CHECK(commands_of(help).front() == "lookup");
  const std::vector<std::string> groups = {"Ask",  "Change", "Watch",           "Record",
                                           "Draw", "Keys",   "Look for faults", "Options"};
  std::size_t at = 0;
  for (const std::string& group : groups) {
    INFO(group);
    at = help.find("\n" + group + ":", at);
    REQUIRE(at != std::string::npos);
  }
}

TEST_CASE("cli: every command says what it does not have") {
  const testing::TestDomain domain;
  for (const std::string& command : commands_of(domain.cli({"--help"}).out)) {
    const CliResult wrong = domain.cli({command, "--no-such-option"});
    // The command that is a program of its own passes its arguments on.
    const std::string name = command == "web" ? "tfdude-web" : "tfdude";
    const std::string whose = command == "web" ? "tfdude-web" : command;
    INFO(wrong.err);
    CHECK(wrong.status == 2);
    CHECK(wrong.err.rfind(name + ": " + whose + " has no --no-such-option", 0) == 0);
    CHECK_THAT(wrong.err, ContainsSubstring(" --help shows what is possible"));
  }
}

TEST_CASE("cli: an unknown frame is answered with the nearest name") {
  const ThesisDaemons d;
  for (const Arguments& command : std::vector<Arguments>{{"lookup", "world", "hand_lef"},
                                                         {"lookup", "hand_lef", "world"},
                                                         {"update", "hand_lef"},
                                                         {"history", "hand_lef"},
                                                         {"parent", "hand_lef"}}) {
    const CliResult result = d.domain.cli(command);
    INFO(command[0] << ": " << result.err);
    CHECK(result.status == 1);
    CHECK_THAT(result.err, ContainsSubstring("no frame 'hand_lef'") &&
                               ContainsSubstring("did you mean hand_left?"));
  }
  CHECK_THAT(d.domain.cli({"parent", "zzzz"}).err, !ContainsSubstring("mean"));
}

TEST_CASE("cli: who asks for the instant 0 is told how to ask for the newest") {
  const ThesisDaemons d;
  CHECK(text(d, {"update", "arm_1", "--xyz", "1", "0", "0", "--stamp", "-1"}) == "updated arm_1\n");
  const std::string hint = "leave --at out for the newest";
  for (const std::string at : {"--at=0", "--at=0.0"}) {
    const CliResult zero = d.domain.cli({"lookup", "world", "arm_1", at});
    INFO(zero.err);
    CHECK(zero.status == 1);
    CHECK_THAT(zero.err, ContainsSubstring(hint));
  }
  CHECK_THAT(d.domain.cli({"lookup", "world", "arm_1", "--at", "0"}).err, ContainsSubstring(hint));
  CHECK_THAT(d.domain.cli({"lookup", "world", "arm_1", "--at", "1"}).err, !ContainsSubstring(hint));
}

}  // namespace tfdude
