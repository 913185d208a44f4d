// URDFs of a daemon, from its command line and from its configuration.

#include <csignal>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/thesis.hpp"

namespace tfdude {
namespace {

using testing::CliResult;
using testing::ContainsSubstring;
using testing::TestDomain;

const std::string kArm = TFDUDE_EXAMPLES "/robots/ur5e.urdf";
const std::string kTwoArms = TFDUDE_EXAMPLES "/robots/two_arms.urdf";

std::string ready(const TestDomain& domain, const std::vector<std::string>& arguments) {
  testing::Process daemon = domain.start_daemon(arguments);
  return testing::await_ready(daemon);
}

}  // namespace

TEST_CASE("daemon: it serves several URDFs each with its own options") {
  const TestDomain domain;
  CHECK(ready(domain, {"--partition", "a", "--urdf", kArm}) == "ready partition=a frames=8");
  CHECK(ready(domain, {"--partition", "b", "--urdf", kArm, "--prefix", "b_", "--urdf", kArm,
                       "--links", "base_link..shoulder_link,tool0"}) ==
        "ready partition=b frames=11");
  const testing::TemporaryDirectory directory;
  const std::string config = directory.write(
      "c.yaml", "partition: c\nframes: [{id: world}]\nurdf: [{file: " + kArm + ", root: world}]\n");
  CHECK(ready(domain, {"--config", config, "--urdf", kTwoArms, "--root", "world", "--prefix",
                       "two/", "--strict-limits"}) == "ready partition=c frames=37");
}

TEST_CASE("daemon: two daemons own the parts of one robot") {
  const TestDomain domain;
  testing::Process body = domain.start_daemon({"--partition", "body", "--urdf", kTwoArms, "--links",
                                               "base_link..left_arm_0_link..right_arm_0_link"});
  testing::Process left = domain.start_daemon(
      {"--partition", "left", "--urdf", kTwoArms, "--links", "left_arm_1_link"});
  CHECK(testing::await_ready(body) == "ready partition=body frames=8");
  CHECK(testing::await_ready(left) == "ready partition=left frames=10");
  const CliResult result = domain.cli({"lookup", "torso_link", "left_hand"});
  INFO(result.err);
  CHECK(result.status == 0);
  // Along the arm, which is tilted by 45 degrees: 0.3105 + 0.4 + 0.39 + 0.078 m.
  CHECK_THAT(result.out, ContainsSubstring("0.100000  0.983325  1.183325"));
}

TEST_CASE("daemon: it says how many edges have no covariance, and what to write") {
  const TestDomain domain;
  const std::vector<std::string> arguments = {"--partition", "arm", "--urdf", kArm, "--no-state"};
  // All that it has logged.
  const auto log_of = [](testing::Process& daemon) {
    daemon.signal(SIGTERM);
    CHECK(daemon.wait(testing::in_time()) == 0);
    return daemon.err();
  };
  const auto covariance_of_mount = [&] {
    const CliResult result = domain.cli({"--json", "lookup", "base_link", "tool0"});
    const auto answer = nlohmann::json::parse(result.out);
    CHECK(answer.at("covariance").is_null());
    CHECK(answer.at("unsampled_joints").size() == 6);
    return answer.at("basis").at("unspecified");
  };
  {
    testing::Process daemon = domain.start_daemon(arguments);
    (void)testing::await_ready(daemon);
    CHECK(covariance_of_mount().back() == "tool0");
    CHECK_THAT(log_of(daemon), ContainsSubstring("7 of 7 edges without covariance") &&
                                   ContainsSubstring("--covariance exact") &&
                                   ContainsSubstring("6 joints have none until"));
  }
  {
    std::vector<std::string> exact = arguments;
    exact.insert(exact.end(), {"--covariance", "exact"});
    testing::Process daemon = domain.start_daemon(exact);
    (void)testing::await_ready(daemon);
    // The flange is fixed, so only the six links that joints move are left.
    CHECK(covariance_of_mount().size() == 6);
    CHECK_THAT(domain.cli({"lookup", "base_link", "tool0"}).out,
               ContainsSubstring("assumed      6 joints have had no sample: elbow_joint"));
    for (const char* joint :
         {"shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"}) {
      const std::string name = joint + std::string("_joint");
      REQUIRE(domain.cli({"joint", name, "0.1", "--stddev", "0.001"}).status == 0);
    }
    const CliResult moved = domain.cli({"--json", "lookup", "base_link", "tool0"});
    CHECK(nlohmann::json::parse(moved.out).at("covariance").is_array());
    CHECK(nlohmann::json::parse(moved.out).at("unsampled_joints").empty());
    CHECK_THAT(log_of(daemon), ContainsSubstring("6 of 7 edges without covariance") &&
                                   !ContainsSubstring("--covariance exact"));
  }
}

TEST_CASE("daemon: wrong URDF options and URDFs that cannot be served exit with 2") {
  const TestDomain domain;
  const auto refused = [&](std::vector<std::string> arguments, const std::string& why) {
    arguments.insert(arguments.begin(), {"--partition", "legs"});
    testing::Process daemon = domain.start_daemon(arguments);
    const CliResult result = testing::finish(daemon);
    CHECK(result.status == 2);
    CHECK(result.out.empty());
    CHECK_THAT(result.err, ContainsSubstring(why));
  };
  refused({"--root", "world"}, "--root: comes before any --urdf");
  refused({"--strict-limits", "--urdf", kArm}, "--strict-limits: comes before any --urdf");
  refused({"--urdf", kArm, "--prefix", "a", "--prefix", "b"}, "--prefix: is given twice");
  refused({"--covariance", "exact"}, "--covariance: needs --urdf");
  refused({"--urdf", kArm, "--covariance", "large"}, "--covariance");
  refused({"--urdf", "/nowhere.urdf"}, "/nowhere.urdf: cannot be opened");
  refused({"--urdf", kArm, "--links", "x"}, kArm + ": links 'x': link 'x' does not exist");
  refused({"--urdf", kArm, "--urdf", kArm}, "frame 'base_link': id is taken by the frame in");
}

}  // namespace tfdude
