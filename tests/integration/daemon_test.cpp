// The messages of a daemon that cannot serve.

#include <string>
#include <sys/stat.h>
#include <vector>

#include "support/catch.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using testing::CliResult;
using testing::ContainsSubstring;
using testing::TemporaryDirectory;
using testing::TestDomain;

struct Refusal {
  std::vector<std::string> arguments;
  std::vector<std::string> names;  // what the message must name
};

}  // namespace

TEST_CASE("daemon: wrong arguments and configurations are rejected and named") {
  const TestDomain domain;
  const TemporaryDirectory directory;
  const auto config = [&directory](const std::string& name, const std::string& text) {
    return directory.write(name, "partition: legs\nframes:\n" + text);
  };
  // Nobody writes to it.
  const std::string pipe = directory.path() + "/pipe.xml";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  const std::vector<Refusal> refusals = {
      {{}, {"--partition"}},
      {{"--nonsense"}, {"--nonsense"}},
      {{"--partition", "le*gs"}, {"le*gs", "'*'"}},
      {{"--partition", "legs\n"}, {"legs\\x0a", "control character"}},
      {{"--partition", std::string(201, 'x')}, {"more than 200 bytes"}},
      {{"--partition", "legs", "--domain", "233"}, {"233", "232"}},
      {{"--partition", "legs", "--domain", "far"}, {"--domain", "far"}},
      {{"--partition", "legs", "--domain", ""}, {"--domain", "not a number"}},
      {{"--partition", "legs", "--save-every", ""}, {"--save-every", "not a number"}},
      {{"--partition", "legs", "--profile", "/nowhere/profile.xml"}, {"/nowhere/profile.xml"}},
      {{"--partition", "legs", "--profile", directory.write("broken.xml", "<profiles><")},
       {"broken.xml"}},
      {{"--partition", "legs", "--profile", pipe}, {pipe, "is not a regular file"}},
      {{"--config", "/nowhere/legs.yaml"}, {"/nowhere/legs.yaml", "No such file"}},
      {{"--partition", "legs", "--config", testing::kArmsFile}, {"'arms'", "'legs'"}},
      {{"--config", config("key.yaml", "  - id: knee\n    colour: red\n")},
       {"key.yaml:4", "'knee'", "'colour'"}},
      {{"--config", config("quat.yaml", "  - {id: knee, quat: [1, 1, 0, 0]}\n")},
       {"quat.yaml:3", "'knee'", "quat"}},
      {{"--config", config("cov.yaml", "  - {id: knee, stddev: [1, 1, 1, 1, 1, .nan]}\n")},
       {"cov.yaml:3", "'knee'", "stddev[5]"}},
      {{"--config", config("twice.yaml", "  - id: knee\n  - id: knee\n")},
       {"twice.yaml:4", "'knee'"}},
      {{"--config", config("cycle.yaml", "  - {id: a, parent: b}\n  - {id: b, parent: a}\n")},
       {"cycle.yaml:4", "'a'", "'b'", "parent"}},
      {{"--config", directory.write("text.yaml", "frames: [\n")}, {"text.yaml", "YAML"}},
  };
  for (const Refusal& refusal : refusals) {
    testing::Process daemon = domain.start_daemon(refusal.arguments);
    const CliResult result = testing::finish(daemon);
    INFO(result.err);
    CHECK(result.status != 0);
    CHECK(result.status < 128);
    CHECK(result.out.empty());
    for (const std::string& name : refusal.names) CHECK_THAT(result.err, ContainsSubstring(name));
  }
}

TEST_CASE("daemon: it prints how many frames it serves and may serve none") {
  const TestDomain domain;
  const TemporaryDirectory directory;
  testing::Process legs = domain.start_daemon({"--partition", "legs"});
  CHECK(testing::await_ready(legs) == "ready partition=legs frames=0");
  testing::Process arms = domain.start_daemon({"--config", testing::kArmsFile});
  CHECK(testing::await_ready(arms) == "ready partition=arms frames=5");
  const CliResult help = [&] {
    testing::Process asked = domain.start_daemon({"--help"});
    return testing::finish(asked);
  }();
  CHECK(help.status == 0);
  CHECK_THAT(help.out, ContainsSubstring("Example: tfduded "));
}

TEST_CASE("daemon: a command that was started before it waits until it serves") {
  const TestDomain domain;
  using Arguments = std::vector<std::string>;
  for (const Arguments& command :
       {Arguments{"partitions"}, {"lookup", "world", "robot_1"}, {"frames"}, {"tree"}}) {
    Arguments arguments{"--timeout", "20000"};
    arguments.insert(arguments.end(), command.begin(), command.end());
    testing::Process asking = domain.start_cli(arguments);
    const testing::Process robot = domain.start_daemon({"--config", testing::kRobotFile});
    const CliResult result = testing::finish(asking);
    INFO(command.front() << ": " << result.err);
    CHECK(result.status == 0);
    CHECK_FALSE(result.out.empty());
  }
}

}  // namespace tfdude
