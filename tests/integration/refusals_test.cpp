// The messages and exit statuses of the command line if something cannot be done.

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tfdude/transport/fastdds.hpp"

#include "support/catch.hpp"
#include "support/deaf_handler.hpp"
#include "support/thesis.hpp"
#include "transport/port.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::TemporaryDirectory;
using testing::TestDomain;
using testing::ThesisDaemons;
using Arguments = std::vector<std::string>;

/// A participant that seems to serve a partition, and never answers.
class MutePartition final : public testing::DeafHandler {
 public:
  MutePartition(const TestDomain& domain, const std::string& name, const std::string& frame)
      : transport_(
            *make_fastdds_transport({domain.number(), TFDUDE_LOOPBACK_PROFILE, name, nullptr})) {
    REQUIRE(transport_->start(*this));
    REQUIRE(transport_->serve(name));
    transport_->publish({name, 0, 1, 1, {{frame, ""}}});
    transport_->announce({name, 1, "here", 1, 1, true});
  }

  [[nodiscard]] bool owns(std::string_view) const override { return true; }
  [[nodiscard]] bool owns_joint(std::string_view) const override { return true; }

 private:
  TransportPtr transport_;
};

struct Refusal {
  Arguments arguments;
  std::string code;
  std::vector<std::string> names;  // what the message must name
};

const std::string kLongId(256, 'x');

// Each breaks one rule.
const std::vector<Refusal> kRefusals = {
    {{"add", "", "--parent", "camera"}, "invalid_input", {"id", "empty"}},
    {{"add", kLongId, "--parent", "camera"}, "invalid_input", {"id", "256 bytes", "255"}},
    {{"add", "a\nb", "--parent", "camera"}, "invalid_input", {"'a\\x0ab'", "control character"}},
    {{"add", "a\xff", "--parent", "camera"}, "invalid_input", {"'a\\xff'", "UTF-8"}},
    {{"add", "tool", "--parent", "camera", "--quat", "1", "1", "0", "0"},
     "invalid_input",
     {"'tool'", "rotation", "unit"}},
    {{"add", "tool", "--parent", "camera", "--xyz", "0", "nan", "0"},
     "invalid_input",
     {"'tool'", "translation.y", "finite"}},
    {{"update", "camera", "--xyz", "0", "0", "inf"},
     "invalid_input",
     {"'camera'", "translation.z", "finite"}},
    {{"update", "arm_1", "--rpy", "nan", "0", "0"}, "invalid_input", {"'arm_1'", "rpy[0]"}},
    {{"update", "arm_1", "--stddev", "1", "1", "1", "1", "1", "-1"},
     "invalid_input",
     {"'arm_1'", "stddev[5]", "negative"}},
    // A correlation of two: not positive semi-definite.
    {{"update", "camera", "--cov", "1", "2", "0", "0", "0", "0", "1", "0", "0",
      "0",      "0",      "1",     "0", "0", "0", "1", "0", "0", "1", "0", "1"},
     "invalid_input",
     {"'camera'", "covariance"}},
    {{"move", "camera", "--parent", "arm_1", "--quat", "2", "0", "0", "0"},
     "invalid_input",
     {"'camera'", "rotation"}},
    {{"move", "robot_1", "--parent", "hand_left"}, "cycle", {"'robot_1'", "'hand_left'"}},
    {{"move", "arm_1", "--parent", "arm_1"}, "cycle", {"'arm_1'"}},
    {{"move", "arm_1", "--parent", "nowhere"}, "unknown_parent", {"'arm_1'", "'nowhere'"}},
    {{"add", "camera", "--parent", "world"}, "already_exists", {"'camera'"}},
    {{"add", "tool", "--parent", "nowhere"}, "unknown_parent", {"'tool'", "'nowhere'"}},
    {{"add", "tool", "--parent", "world", "--partition", "legs"}, "unknown_partition", {"'legs'"}},
    {{"update", "nowhere", "--xyz", "0", "0", "0"}, "unknown_frame", {"'nowhere'"}},
    {{"remove", "nowhere"}, "unknown_frame", {"'nowhere'"}},
    {{"parent", "nowhere"}, "unknown_frame", {"'nowhere'"}},
    {{"children", "nowhere"}, "unknown_frame", {"'nowhere'"}},
    {{"lookup", "nowhere", "world"}, "unknown_start", {"'nowhere'"}},
};

Arguments with_cov(Arguments arguments, const Arguments& values) {
  arguments.emplace_back("--cov");
  arguments.insert(arguments.end(), values.begin(), values.end());
  return arguments;
}

/// All that can be seen: the structure and each edge's value.
std::string snapshot(Client& client) {
  std::string all;
  const auto frames = client.frames().value();
  for (const Frame& frame : frames) {
    all += frame.id + " " + frame.parent + " " + frame.partition + "\n";
    if (frame.parent.empty()) continue;
    const auto X_PC = client.lookup(frame.parent, frame.id);
    REQUIRE(X_PC);
    const Eigen::IOFormat exact(17);
    std::ostringstream value;
    value << X_PC->pose.matrix().format(exact)
          << X_PC->covariance.of_specified().matrix().format(exact);
    all += value.str();
  }
  return all;
}

/// Each must be said on standard error, or in JSON, with status 2.
void check_wrong_usage(const TestDomain& domain, const std::vector<Refusal>& wrong) {
  for (const Refusal& usage : wrong) {
    const CliResult result = domain.cli(usage.arguments);
    INFO(result.err);
    CHECK(result.status == 2);
    CHECK(result.out.empty());
    for (const std::string& name : usage.names) CHECK_THAT(result.err, ContainsSubstring(name));
    Arguments arguments = usage.arguments;
    arguments.insert(arguments.begin(), "--json");
    const CliResult program = domain.cli(arguments);
    CHECK(program.status == 2);
    const json error = json::parse(program.out).at("error");
    for (const std::string& name : usage.names) {
      CHECK_THAT(error.at("message").get<std::string>(), ContainsSubstring(name));
    }
  }
}

}  // namespace

TEST_CASE("cli: input that breaks a rule is rejected by name and changes nothing") {
  const ThesisDaemons d;
  auto client = Client::open(d.domain.options()).value();
  // The last digits of answers over DDS may be others.
  client.find_memory();
  const std::string before = snapshot(client);
  for (const Refusal& refusal : kRefusals) {
    Arguments arguments = refusal.arguments;
    const CliResult plain = d.domain.cli(arguments);
    INFO("tfdude " << arguments[0] << " " << arguments[1] << ": " << plain.err);
    CHECK(plain.status == 1);
    CHECK(plain.out.empty());
    for (const std::string& name : refusal.names) CHECK_THAT(plain.err, ContainsSubstring(name));
    arguments.insert(arguments.begin(), "--json");
    const CliResult program = d.domain.cli(arguments);
    CHECK(program.status == 1);
    CHECK(json::parse(program.out).at("error").at("code") == refusal.code);
  }
  CHECK(snapshot(client) == before);
}

TEST_CASE("cli: wrong usage exits with 2") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  check_wrong_usage(
      d.domain,
      {
          {{}, "", {"subcommand"}},
          {{"nonsense"}, "", {"nonsense"}},
          {{"lookup"}, "", {"A"}},
          {{"lookup", "world"}, "", {"B"}},
          {{"lookup", "world", "camera", "arm_1"}, "", {"arm_1"}},
          {{"add", "tool"}, "", {"--parent"}},
          {{"add", "tool", "--parent", "camera", "--xyz", "1", "two", "3"}, "", {"--xyz", "two"}},
          {{"add", "tool", "--parent", "camera", "--xyz", "1", "2"}, "", {"--xyz"}},
          {{"update", "camera", "--quat", "0", "0", "0", "1", "--rpy", "0", "0", "0"},
           "",
           {"--quat"}},
          {{"watch", "world", "camera", "--rate", "0"}, "", {"--rate"}},
          {{"watch", "world", "camera", "--rate", "nan"}, "", {"--rate", "nan"}},
          {{"watch", "world", "camera", "--rate", "2x"}, "", {"--rate", "2x"}},
          {{"tree", "--discovery-server", "nowhere"}, "", {"'nowhere'", "HOST:PORT"}},
          {{"tree", "--timeout", "soon"}, "", {"--timeout", "soon"}},
          {{"tree", "--profile", "/nowhere/profile.xml"}, "", {"/nowhere/profile.xml"}},
          {{"tree", "--profile", directory.write("broken.xml", "<profiles><")}, "", {"broken.xml"}},
          {{"tree", "--profile", directory.path()}, "", {directory.path()}},
          {{"tree", "--domain", "233"}, "", {"233", "232"}},
          {{"tree", "--domain", "-1"}, "", {"--domain", "-1"}},
          {{"joint", "elbow", " 1"}, "", {"'elbow' is not NAME=POSITION"}},
          {{"lookup", "world", "camera", "--at", "9223372036854775807"}, "", {"--at"}},
          {{"lookup", "world", "camera", "--at", "1e10"}, "", {"--at"}},
          {{"lookup", "world", "camera", "--at", "-9223372035"}, "", {"--at"}},
      });
}

TEST_CASE("cli: no option accepts an empty text as a number") {
  const ThesisDaemons d;
  check_wrong_usage(
      d.domain,
      {
          {{"tree", "--domain", ""}, "", {"--domain", "not a number"}},
          {{"tree", "--timeout", ""}, "", {"--timeout", "not a number"}},
          {{"joint", "elbow", ""}, "", {"'elbow' is not NAME=POSITION"}},
          {{"joint", "elbow", "0", "--stddev", ""}, "", {"--stddev", "not a number"}},
          {{"joint", "elbow", "0", "--stamp", ""}, "", {"--stamp"}},
          {{"update", "camera", "--xyz", "", "", ""}, "", {"--xyz", "not a number"}},
          {{"update", "camera", "--rpy", "0", "", "0"}, "", {"--rpy", "not a number"}},
          {{"update", "camera", "--quat", "0", "0", "0", ""}, "", {"--quat", "not a number"}},
          {{"add", "tool", "--parent", "camera", "--stddev", "", "", "", "", "", ""},
           "",
           {"--stddev", "not a number"}},
          {{"lookup", "world", "camera", "--wait", ""}, "", {"--wait", "not a number"}},
          {{"lookup", "world", "camera", "--wait", "1.5"}, "", {"--wait", "no whole number"}},
          {{"lookup", "world", ""}, "", {"an empty text is no id of a frame"}},
          {{"tree", "--timeout", "1.5"}, "", {"--timeout", "not a whole number"}},
          {{"graph", "--depth", "-1"}, "", {"--depth", "negative"}},
          {{"point", "world", "camera", "0", "0", "0", "--stddev", "-1", "0", "0"},
           "",
           {"--stddev", "0 to 1e9"}},
          {{"lookup", "world", "camera", "--extrapolate", ""},
           "",
           {"--extrapolate", "not a number"}},
          {{"lookup", "world", "camera", "--order", ""}, "", {"--order", "not a number"}},
          {{"watch", "world", "camera", "--rate", ""}, "", {"--rate", "not a number"}},
          {{"fuse", "camera", "--gate", ""}, "", {"--gate", "not a number"}},
          {{"plot", "world", "camera", "--out", "x.svg", "--samples", ""},
           "",
           {"--samples", "not a number"}},
          {with_cov({"observe", "world", "camera"}, {""}), "", {"--cov"}},
          {with_cov({"observe", "world", "camera"}, Arguments(21)), "", {"--cov", "not a number"}},
          {with_cov({"update", "camera"}, Arguments(21)), "", {"--cov", "not a number"}},
          {{"correlate", "camera", "--source", "supply", "0", "0", "0", "0", "0", ""},
           "",
           {"--source", "not a number"}},
      });
}

TEST_CASE("cli: commands exit with 3 if no partition answers") {
  const TestDomain domain;
  const std::vector<Arguments> commands = {
      {"tree"},        {"frames"},           {"partitions"},
      {"roots"},       {"parent", "a"},      {"children", "a"},
      {"exists", "a"}, {"lookup", "a", "b"}, {"add", "b", "--parent", "a"},
      {"update", "a"}, {"remove", "a"},      {"move", "a", "--parent", "b"}};
  for (const Arguments& command : commands) {
    const CliResult result = domain.cli(command);
    INFO(command[0]);
    CHECK(result.status == 3);
    CHECK_THAT(result.err, ContainsSubstring("domain " + std::to_string(domain.number())));
  }
  const CliResult program = domain.cli({"--json", "tree"});
  CHECK(program.status == 3);
  CHECK(json::parse(program.out).at("error").at("code") == "unreachable");
}

TEST_CASE("cli: commands exit with 3 and name the partition that does not answer") {
  const TestDomain domain;
  const MutePartition mute(domain, "mute", "statue");
  const std::vector<Arguments> commands = {{"update", "statue"},
                                           {"remove", "statue"},
                                           {"add", "nose", "--parent", "statue"},
                                           {"move", "statue", "--parent", ""}};
  for (Arguments command : commands) {
    const CliResult result = domain.cli(command);
    INFO(command[0]);
    CHECK(result.status == 3);
    CHECK_THAT(result.err, ContainsSubstring("'mute'"));
    command.insert(command.begin(), {"--json", "--timeout", "300"});
    const CliResult program = domain.cli(command);
    CHECK(program.status == 3);
    const json error = json::parse(program.out).at("error");
    CHECK(error.at("code") == "timeout");
    const std::string message = error.at("message");
    const std::string said = "did not answer within ";
    CHECK_THAT(message, ContainsSubstring("'mute'") && ContainsSubstring(said));
    // What is left of discovery counts from the beginning, too: twice the time-out at most.
    CHECK(std::stoi(message.substr(message.find(said) + said.size())) <= 600);
  }
}

}  // namespace tfdude
