// docs/cli.schema.json holds for what every command prints with --json.

#include "support/json_schema.hpp"

#include <chrono>
#include <csignal>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::CliResult;
using testing::eventually;
using testing::in_time;
using testing::JsonSchema;
using testing::Process;
using testing::TemporaryDirectory;
using testing::ThesisDaemons;
using Arguments = std::vector<std::string>;

JsonSchema the_schema() {
  std::ifstream file(TFDUDE_EXAMPLES "/../docs/cli.schema.json");
  return JsonSchema(json::parse(file));
}

// Runs commands, checks each line that they print, and notes which commands that were.
class Checked {
 public:
  explicit Checked(const ThesisDaemons& d) : d_(d) {}

  void check(const std::string& command, const std::string& lines) {
    INFO(command << ": " << lines);
    const json& commands = schema_.root().at("properties");
    REQUIRE(commands.contains(command));
    std::istringstream each(lines);
    for (std::string line; std::getline(each, line);) {
      CHECK(schema_.error(commands.at(command), json::parse(line)) == "");
      seen_.insert(command);
    }
  }

  // @param arguments  the command, or "keys" and its command, come first
  void run(Arguments arguments, int status = 0) {
    std::string command = arguments[0];
    if (command == "keys") command += " " + arguments[1];
    arguments.insert(arguments.begin(), "--json");
    const CliResult result =
        command.rfind("keys", 0) == 0 ? alone(arguments) : d_.domain.cli(arguments);
    INFO(command << ": " << result.out << result.err);
    CHECK(result.status == status);
    check(command, result.out);
  }

  // A command that runs until interrupted: its first line.
  void start(Arguments arguments) {
    const std::string command = arguments[0];
    arguments.insert(arguments.begin(), "--json");
    Process process = d_.domain.start_cli(arguments);
    const auto line = process.wait_for_line("{", in_time());
    REQUIRE(line);
    check(command, *line);
    process.signal(SIGINT);
    CHECK(process.wait(in_time()) == 0);
  }

  void refused(Arguments arguments, int status) const {
    arguments.insert(arguments.begin(), "--json");
    const CliResult result = d_.domain.cli(arguments);
    INFO(result.out);
    CHECK(result.status == status);
    CHECK(schema_.error(schema_.root().at("$defs").at("error"), json::parse(result.out)) == "");
  }

  // The commands of the schema that did not run.
  [[nodiscard]] Arguments missing() const {
    Arguments missing;
    for (const auto& [command, ignored] : schema_.root().at("properties").items()) {
      if (seen_.count(command) == 0) missing.push_back(command);
    }
    return missing;
  }

 private:
  // Such a command needs no participant, and takes no option of the network.
  static CliResult alone(Arguments arguments) {
    arguments.insert(arguments.begin(), TFDUDE_CLI);
    Process process(arguments);
    return testing::finish(process);
  }

  const ThesisDaemons& d_;
  const JsonSchema schema_ = the_schema();
  std::set<std::string> seen_;
};

const char* const kUrdf = R"(<robot name="arm">
  <link name="mount"/> <link name="upper"/> <link name="lower"/>
  <joint name="shoulder" type="revolute">
    <parent link="mount"/> <child link="upper"/> <limit lower="-1" upper="1"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/> <child link="lower"/> <mimic joint="shoulder" multiplier="2"/>
  </joint>
</robot>)";

Arguments with_stddev(Arguments arguments) {
  arguments.insert(arguments.end(), {"--xyz", "0.1", "0", "0.2", "--stddev", "0.01", "0.01", "0.01",
                                     "0.01", "0.01", "0.01"});
  return arguments;
}

}  // namespace

TEST_CASE("json: what each command prints is as the schema says") {
  ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string urdf = directory.write("arm.urdf", kUrdf);
  std::optional<Process> arm = d.domain.start_daemon(
      {"--no-state", "--partition", "arm", "--urdf", urdf, "--root", "world"});
  testing::await_ready(*arm);
  Checked checked(d);
  checked.run({"joint", "shoulder", "0.5"});
  checked.run(with_stddev({"add", "tool", "--parent", "camera"}));
  checked.run({"update", "arm_2", "--xyz", "0", "0", "1", "--stamp", "-2"});
  checked.run({"update", "arm_2", "--xyz", "0", "0", "2", "--stamp", "-1"});
  const auto past = std::chrono::system_clock::now().time_since_epoch() - std::chrono::seconds(3);
  checked.run(
      {"rewrite", "arm_2",
       directory.write("past.csv", "edge,stamp_ns,x,y,z\narm_2," +
                                       std::to_string(std::chrono::nanoseconds(past).count()) +
                                       ",0,0,1.5\n")});
  checked.run({"move", "tool", "--parent", "arm_2"});
  checked.run({"correlate", "hand_left", "--unknown"});
  checked.run({"correlate", "camera", "--source", "supply", "0", "0", "0", "0", "0", "0.002"});
  checked.run(with_stddev({"fuse", "tool"}));
  checked.run(with_stddev({"observe", "arm_1", "arm_left", "--gate", "1"}));
  for (const char* command : {"tree", "frames", "partitions", "roots", "joints"}) {
    checked.run({command});
  }
  checked.run({"parent", "arm_1"});
  checked.run({"parent", "world"});
  checked.run({"children", "robot_1"});
  checked.run({"exists", "camera"});
  checked.run({"exists", "nowhere"}, 1);
  checked.run({"lookup", "world", "hand_left"});
  checked.run({"lookup", "world", "tool", "--order", "4"});
  checked.run({"lookup", "world", "lower"});
  checked.run({"lookup", "world", "hand_left", "--matrix"});
  checked.run({"point", "world", "hand_left", "0", "0", "1", "1", "0", "0", "--joint"});
  checked.run({"point", "world", "lower", "0", "0", "1", "--joint"});
  checked.run({"joint", "shoulder=0.25"});
  checked.run({"publish", directory.write("joints.jsonl", "{\"joints\": {\"shoulder\": 0.1}}")});
  checked.run({"why", "world", "hand_left"});
  checked.run({"why", "world", "hand_lfet"}, 1);
  checked.run({"velocity", "arm_1", "arm_2"});
  checked.run({"velocity", "world", "lower"});
  checked.run({"history", "arm_2"});
  checked.run({"history", "camera"});
  checked.run({"monitor", "--once"});
  checked.run({"description", "arm"});
  checked.run(
      {"plot", "world", "hand_left", "--out", directory.path() + "/a.svg", "--samples", "5"});
  checked.run({"graph", "--out", directory.path() + "/a.dot"});
  checked.run({"add", "earth", "--parent", "", "--partition", "arm"});
  checked.run({"add", "site", "--parent", "earth", "--geodetic", "48", "11", "500", "--covariance",
               "exact"});
  checked.run({"lookup", "earth", "site", "--geodetic"});
  checked.run({"lookup", "world", "camera", "--geodetic"});
  const std::string launch = directory.path() + "/hand.launch";
  checked.run({"export", "-", "hand_left", "--in", "world", "--format", "ros1"});
  checked.run({"export", launch, "hand_left", "--in", "world", "--format", "ros2"});
  checked.run({"import", launch, "--dry-run"});
  checked.run({"import", launch, "--into", "arm", "--prefix", "seen_", "--name", "world=earth"});
  for (const char* command : {"watch", "echo"}) checked.start({command, "world", "tool"});
  const std::string file = directory.path() + "/all.mcap";
  Process recorder = d.domain.start_cli({"--json", "record", file});
  REQUIRE(eventually([&] { return d.domain.cli({"tree", "--recording", file}).status == 0; }));
  checked.run({"remove", "tool"});
  Process events = d.domain.start_cli({"--json", "events"});
  // Until it listens.
  REQUIRE(eventually([&] {
    (void)d.domain.cli({"add", "lamp", "--parent", "camera"});
    (void)d.domain.cli({"move", "lamp", "--parent", "robot_1"});
    (void)d.domain.cli({"remove", "lamp"});
    return events.wait_for_line("{", testing::Clock::now() + Milliseconds(200)).has_value();
  }));
  arm->kill();
  REQUIRE(events.wait_for_line(R"({"event":"partition_down")", in_time()));
  events.signal(SIGINT);
  CHECK(events.wait(in_time()) == 0);
  checked.check("events", events.out());
  recorder.signal(SIGINT);
  CHECK(recorder.wait(in_time()) == 0);
  checked.check("record", recorder.out());
  checked.run({"info", file});
  checked.run({"partitions"});
  checked.run({"forget", "arm"});
  // A replay serves what is recorded, in a domain of its own.
  const testing::TestDomain other;
  Process replay = other.start_cli({"--json", "replay", file, "--rate", "1000"});
  CHECK(replay.wait(in_time()) == 0);
  checked.check("replay", replay.out());
  // The doctor finds something on some computers.
  const CliResult doctor = d.domain.cli({"--json", "doctor"});
  checked.check("doctor", doctor.out);
  const std::string keys = directory.path() + "/keys";
  checked.run({"keys", "init", keys});
  checked.run({"keys", "daemon", keys, "arm"});
  checked.run({"keys", "client", keys, "eye", "--look"});
  checked.run({"keys", "renew", keys, "eye"});
  checked.run({"keys", "check", keys});
  checked.run({"keys", "check", keys + "/arm"});
  checked.run({"keys", "revoke", keys, "eye"});
  checked.run({"keys", "check", keys});
  CHECK(checked.missing().empty());
  checked.refused({"lookup", "world", "nowhere"}, 1);
  checked.refused({"lookup", "world"}, 2);
}

TEST_CASE("json: the schema has every command, and refuses what it does not describe") {
  const JsonSchema schema = the_schema();
  const testing::TestDomain domain;
  const json& commands = schema.root().at("properties");
  const std::string help = domain.cli({"--help"}).out;
  std::istringstream lines(help);
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line);) {
    // Commands of a group; options begin with a hyphen.
    if (line.rfind("  ", 0) != 0 || line[2] < 'a' || line[2] > 'z') continue;
    ++count;
    const std::string command = line.substr(2, line.find(' ', 2) - 2);
    INFO(command);
    // web prints nothing for programs; keys has commands of its own.
    if (command != "web" && command != "keys") CHECK(commands.contains(command));
  }
  CHECK(count == 39);
  const json& roots = commands.at("roots");
  CHECK(schema.error(roots, {{"roots", {"a"}}}) == "");
  CHECK(schema.error(roots, {{"roots", {1}}}) != "");
  CHECK(schema.error(roots, {{"roots", json::array()}, {"more", 1}}) != "");
  CHECK(schema.error(roots, json::object()) != "");
  CHECK(schema.error(commands.at("history"), {{"id", "a"}}) != "");
  CHECK(schema.error(commands.at("parent"), {{"id", "a"}, {"parent", nullptr}}) == "");
}

}  // namespace tfdude
