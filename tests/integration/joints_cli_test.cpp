// A robot of two daemons, from one URDF, driven by joints.

#include <cmath>
#include <csignal>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/cli_json.hpp"
#include "support/process.hpp"
#include "support/test_domain.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::Approx;
using testing::await_ready;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::eventually;
using testing::in_time;
using testing::Process;
using testing::TemporaryDirectory;
using testing::TestDomain;
using Arguments = std::vector<std::string>;

const std::string kMobileArm = TFDUDE_EXAMPLES "/robots/mobile_arm.urdf";

// The base and its arm, each with a daemon that keeps its state.
struct Robot {
  explicit Robot(const Arguments& of_arm = {}) : of_arm_(of_arm) {
    base.emplace(start({"--config", TFDUDE_EXAMPLES "/arm/base.yaml"}));
    start_arm();
  }

  Process start(Arguments arguments) const {
    arguments.insert(arguments.end(), {"--state", directory.path()});
    Process daemon = domain.start_daemon(arguments);
    (void)await_ready(daemon);
    return daemon;
  }
  void start_arm() {
    Arguments arguments{"--partition", "arm", "--urdf", kMobileArm, "--links", "shoulder_link"};
    arguments.insert(arguments.end(), of_arm_.begin(), of_arm_.end());
    arm.reset();
    arm.emplace(start(arguments));
  }

  json answered(Arguments arguments, int status = 0) const {
    return testing::answered(domain, std::move(arguments), status);
  }
  std::string refused(const Arguments& arguments) const {
    return answered(arguments, 1).at("error").at("message").get<std::string>();
  }
  json joint(const std::string& name) const { return testing::joint_of(domain, name); }
  // The turn about z of a frame in its parent.
  double turn(const std::string& parent, const std::string& frame) const {
    const json q = answered({"lookup", parent, frame}).at("rotation");
    return 2 * std::atan2(q.at(2).get<double>(), q.at(3).get<double>());
  }

  TestDomain domain;
  TemporaryDirectory directory;
  std::optional<Process> base;
  std::optional<Process> arm;

 private:
  const Arguments of_arm_;
};

}  // namespace

TEST_CASE("joints: two daemons serve one robot from one URDF") {
  const Robot robot;
  const json path = robot.answered({"lookup", "world", "tool0"});
  CHECK(path.at("partitions") == json({"base", "arm"}));
  CHECK(robot.answered({"joints"}).at("partitions").at(0).at("joints").size() == 6);
  CHECK(robot.joint("elbow_joint").at("frame") == "forearm_link");
  CHECK_FALSE(robot.joint("elbow_joint").at("measured").get<bool>());
  CHECK_THAT(robot.domain.cli({"joints"}).out, ContainsSubstring("no sample yet"));
  robot.answered({"joint", "shoulder_pan_joint", "0.5", "--stddev", "0.001"});
  CHECK(robot.turn("arm_mount", "shoulder_link") == Approx(0.5));
  // Negative numbers are positions, not options.
  robot.answered({"joint", "shoulder_pan_joint", "-0.25"});
  CHECK(robot.turn("arm_mount", "shoulder_link") == Approx(-0.25));
}

TEST_CASE("joints: it is told which joints follow others") {
  const TestDomain domain;
  Process daemon = domain.start_daemon(
      {"--no-state", "--partition", "hands", "--urdf", TFDUDE_EXAMPLES "/robots/two_arms.urdf"});
  (void)await_ready(daemon);
  const Arguments both = {"joint", "left_finger_1_joint=0.01", "left_finger_2_joint=0.02"};
  const json moved = testing::answered(domain, both, 0);
  REQUIRE(moved.at("joints").size() == 1);
  CHECK(moved.at("joints").at(0).at("name") == "left_finger_1_joint");
  CHECK(moved.at("ignored") == json({"left_finger_2_joint"}));
  CHECK(testing::joint_of(domain, "left_finger_2_joint").at("position") == -0.01);
  CHECK_THAT(domain.cli(both).out,
             ContainsSubstring("ignored left_finger_2_joint: it follows left_finger_1_joint\n"));
  CHECK(domain.cli({"joint", "left_finger_2_joint=0.02"}).status == 1);
}

TEST_CASE("joints: wrong input is rejected by name and changes nothing") {
  const Robot robot;
  CHECK_THAT(robot.refused({"joint", "knee", "1"}), ContainsSubstring("no joint 'knee'"));
  CHECK_THAT(robot.refused({"joint", "elbow_joint", "nan"}),
             ContainsSubstring("joint 'elbow_joint': position is not a number"));
  for (const char* bad : {"inf", "nan", "-1"}) {
    const CliResult result = robot.domain.cli({"joint", "elbow_joint", "1", "--stddev", bad});
    CHECK(result.status == 2);
    CHECK_THAT(result.err, ContainsSubstring("--stddev"));
  }
  CHECK(robot.domain.cli({"joint", "elbow_joint"}).status == 2);
  CHECK(robot.domain.cli({"joint", "elbow_joint", "much"}).status == 2);
  for (const std::vector<std::string>& typed :
       std::vector<std::vector<std::string>>{{"joint", "elbow_joint=0x1"},
                                             {"joint", "elbow_joint", "0x1"},
                                             {"joint", "elbow_joint=0x1p-2"}}) {
    const CliResult result = robot.domain.cli(typed);
    CHECK(result.status == 2);
    CHECK_THAT(result.err, ContainsSubstring("joint 'elbow_joint': '0x1") &&
                               ContainsSubstring("is not a number"));
  }
  CHECK_FALSE(robot.joint("elbow_joint").at("measured").get<bool>());
}

TEST_CASE("joints: who asks for a joint as for a frame is told which frame it moves") {
  const Robot robot;
  for (const Arguments& command :
       std::vector<Arguments>{{"history", "elbow_joint"}, {"lookup", "world", "elbow_joint"}}) {
    CHECK_THAT(robot.refused(command),
               ContainsSubstring("'elbow_joint' is a joint, which moves frame 'forearm_link'"));
  }
}

TEST_CASE("joints: positions outside the limits are counted or with strict limits rejected") {
  SECTION("applied") {
    const Robot robot;
    robot.answered({"joint", "elbow_joint", "3.5"});
    CHECK(robot.joint("elbow_joint").at("outside") == 1);
    CHECK_THAT(robot.domain.cli({"monitor", "--once"}).out,
               ContainsSubstring("joint outside limits") && ContainsSubstring("elbow_joint"));
  }
  SECTION("rejected") {
    const Robot robot({"--strict-limits"});
    CHECK_THAT(robot.refused({"joint", "elbow_joint", "3.5"}),
               ContainsSubstring("outside its limits"));
    CHECK(robot.joint("elbow_joint").at("outside") == 0);
    CHECK(robot.joint("elbow_joint").at("refused") == 1);
  }
}

TEST_CASE("joints: a killed daemon has its joint positions after a restart") {
  Robot robot;
  robot.answered({"joint", "elbow_joint", "1.25", "--stddev", "0.01"});
  robot.arm->kill();
  robot.start_arm();
  const json elbow = robot.joint("elbow_joint");
  CHECK(elbow.at("position") == 1.25);
  CHECK(elbow.at("variance") == Approx(1e-4));
  CHECK(elbow.at("measured").get<bool>());
  CHECK(robot.turn("upper_arm_link", "forearm_link") == Approx(1.25));
  robot.answered({"joint", "elbow_joint", "1.5"});
  CHECK(robot.turn("upper_arm_link", "forearm_link") == Approx(1.5));
}

TEST_CASE("joints: a path whose joints begin to move is watched without an error") {
  const Robot robot;
  Process watch = robot.domain.start_cli({"watch", "world", "tool0", "--rate", "200"});
  REQUIRE(watch.wait_for_line("translation", in_time()));
  const Process controller({TFDUDE_CONTROLLER, "--seconds", "60", "--domain",
                            std::to_string(robot.domain.number()), "--profile",
                            TFDUDE_LOOPBACK_PROFILE});
  REQUIRE(watch.wait_for_line("stamp", in_time()));
  watch.signal(SIGINT);
  CHECK(watch.wait(in_time()) == 0);
  CHECK(watch.err().empty());
}

TEST_CASE("joints: the example's controller drives the arm also after a daemon was killed") {
  Robot robot;
  Process controller({TFDUDE_CONTROLLER, "--seconds", "60", "--domain",
                      std::to_string(robot.domain.number()), "--profile", TFDUDE_LOOPBACK_PROFILE});
  const auto is_driven = [&] {
    const CliResult result =
        robot.domain.cli({"--json", "lookup", "world", "tool0", "--at", "-0.05"});
    return result.status == 0;
  };
  CHECK(eventually(is_driven));
  // The last joint has the widest path, and never rests.
  const double before = robot.joint("wrist_3_joint").at("position").get<double>();
  CHECK(eventually([&] {
    return std::abs(robot.joint("wrist_3_joint").at("position").get<double>() - before) > 0.1;
  }));
  robot.arm->kill();
  robot.start_arm();
  CHECK(eventually(is_driven));
  CHECK(controller.runs());
}

}  // namespace tfdude
