// Values on the command line: units of angles, many joints, samples from a pipe, points.

#include <algorithm>
#include <cmath>
#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <string>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
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

const double kPi = std::acos(-1.0);

// A mobile arm: one daemon for its base, one for the rest.
struct Robot {
  Robot()
      : base(domain.serve(TFDUDE_EXAMPLES "/arm/base.yaml")),
        arm(domain.serve(TFDUDE_EXAMPLES "/arm/arm.yaml")) {}

  std::string text(const Arguments& arguments) const {
    const CliResult result = domain.cli(arguments);
    INFO(result.err);
    CHECK(result.status == 0);
    return result.out;
  }
  json answered(Arguments arguments, int status = 0) const {
    return testing::answered(domain, std::move(arguments), status);
  }
  double position(const std::string& joint) const {
    return testing::joint_of(domain, joint).at("position").get<double>();
  }

  TestDomain domain;
  TemporaryDirectory directory;
  Process base;
  Process arm;
};

}  // namespace

TEST_CASE("values: angles are in radians, and in degrees with --deg") {
  const Robot robot;
  CHECK(robot.text({"joint", "elbow_joint", "90", "--deg"}) == "moved elbow_joint to 90 deg\n");
  CHECK(robot.position("elbow_joint") == Approx(kPi / 2));
  CHECK_THAT(robot.text({"joints"}), ContainsSubstring("1.57080         ? rad"));
  CHECK_THAT(robot.text({"joints", "--deg"}), ContainsSubstring("90.000         ? deg"));
  robot.text({"add", "tool", "--parent", "tool0", "--rpy", "0", "0", "90", "--deg", "--stddev", "1",
              "1", "1", "0", "0", "9"});
  const json tool = robot.answered({"lookup", "tool0", "tool"});
  CHECK(tool.at("rotation").at(2).get<double>() == Approx(std::sqrt(0.5)));
  CHECK(tool.at("covariance").at(5).at(5).get<double>() == Approx(std::pow(kPi / 20, 2)));
  CHECK_THAT(robot.text({"lookup", "tool0", "tool"}),
             ContainsSubstring("rpy          0.000000  0.000000  1.570796  rad\n"));
  CHECK_THAT(robot.text({"lookup", "tool0", "tool", "--deg", "--cov"}),
             ContainsSubstring("rpy          0.0000  0.0000  90.0000  deg\n") &&
                 ContainsSubstring("0.0000  0.0000  9.0000  deg\n") &&
                 ContainsSubstring("(translation first, of the right perturbation; m, deg)") &&
                 ContainsSubstring("8.10000e+01"));
  // JSON has radians in any case.
  CHECK(robot.answered({"lookup", "tool0", "tool", "--deg"}) == tool);
}

TEST_CASE("values: a pose is typed and printed as a matrix") {
  const Robot robot;
  robot.text({"add", "tool", "--parent", "tool0", "--matrix", "0", "-1", "0", "1", "1", "0",
              "0",   "2",    "0",        "0",     "1",        "3", "0",  "0", "0", "1"});
  const json tool = robot.answered({"lookup", "tool0", "tool", "--matrix"});
  CHECK(tool.at("translation").at(1).get<double>() == Approx(2));
  CHECK(tool.at("matrix").at(1).at(0).get<double>() == Approx(1));
  CHECK_THAT(robot.text({"lookup", "tool0", "tool", "--matrix"}),
             ContainsSubstring("matrix       0.000000000 -1.000000000  0.000000000  1.0000"));
  const CliResult scaled =
      robot.domain.cli({"update", "tool", "--matrix", "2", "0", "0", "0", "0", "1", "0", "0", "0",
                        "0", "1", "0", "0", "0", "0", "1"});
  CHECK(scaled.status == 1);
  CHECK_THAT(scaled.err, ContainsSubstring("frame 'tool': matrix: the upper left 3x3 is not"));
  CHECK(robot.answered({"lookup", "tool0", "tool"}).at("translation") == tool.at("translation"));
}

TEST_CASE("values: many joints move at once, and one outside its limits is said at once") {
  const Robot robot;
  CHECK(robot.text({"joint", "elbow_joint=0.5", "wrist_1_joint=-7", "--stddev", "0.01"}) ==
        "moved elbow_joint to 0.5 rad\n"
        "moved wrist_1_joint to -7 rad, outside its limits -6.283..6.283 rad\n");
  const json moved = robot.answered({"joint", "elbow_joint=0.25", "wrist_1_joint=1"});
  CHECK(moved.at("joints").at(0) ==
        json({{"name", "elbow_joint"}, {"position", 0.25}, {"outside", false}}));
  // One unknown joint: nothing moves.
  const CliResult wrong = robot.domain.cli({"joint", "elbow_joint=3", "knee=1"});
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.err, ContainsSubstring("no joint 'knee'"));
  CHECK(robot.position("elbow_joint") == 0.25);
  for (const Arguments& bad : std::vector<Arguments>{
           {"joint"}, {"joint", "elbow_joint"}, {"joint", "elbow_joint="}, {"joint", "a=1", "b"}}) {
    CHECK(robot.domain.cli(bad).status == 2);
  }
}

TEST_CASE("values: joints are set from a file line by line") {
  const Robot robot;
  const std::string file = robot.directory.write("moves.jsonl",
                                                 "{\"joints\": {\"elbow_joint\": 0.1}}\n\n"
                                                 "{\"joints\": {\"knee\": 1}}\n"
                                                 "{\"edge\": \"tool0\", \"xyz\": [0, 0, 1]}\n"
                                                 "{\"joints\": {\"elbow_joint\": 0.2}}");
  const CliResult result = robot.domain.cli({"joint", "--from", file, "--rate", "50"});
  CHECK(result.status == 1);
  CHECK_THAT(result.err, ContainsSubstring("line 3: no joint 'knee'") &&
                             ContainsSubstring("line 4: an edge is not a joint"));
  CHECK_THAT(result.out, ContainsSubstring("sent         2 lines with 2 values") &&
                             ContainsSubstring("rejected     2 lines"));
  CHECK(robot.position("elbow_joint") == 0.2);
  CHECK(robot.domain.cli({"joint", "--from", "/nowhere"}).status == 2);
}

TEST_CASE("values: samples from a pipe are streamed until it ends") {
  const Robot robot;
  std::string csv = "stamp_ns,elbow_joint,wrist_1_joint\n";
  const auto now = nanoseconds(Time(std::chrono::duration_cast<Time::duration>(
      std::chrono::system_clock::now().time_since_epoch())));
  for (int i = 0; i < 200; ++i) {
    csv += std::to_string(now + i * 1'000'000) + "," + std::to_string(i * 0.001) + ",0.5\n";
  }
  const std::string file = robot.directory.write("moves.csv", csv);
  const json sent = robot.answered({"publish", file});
  CHECK(sent.at("lines") == 200);
  CHECK(sent.at("values") == 400);
  CHECK(sent.at("rejected") == 0);
  CHECK(sent.at("rate").get<double>() > 0);
  CHECK(eventually([&] { return robot.position("elbow_joint") == Approx(0.199); }));
  CHECK(robot.answered({"history", "forearm_link"}).at("samples") == 200);
}

TEST_CASE("values: a first line that is neither JSON nor names of columns is told") {
  const Robot robot;
  for (const char* text : {"this is garbage\n", "[1,2]\n", "\x01\x02\n"}) {
    const CliResult sent = robot.domain.cli({"publish", robot.directory.write("moves", text)});
    CHECK(sent.status == 1);
    CHECK_THAT(sent.err, ContainsSubstring("tfdude: line 1: "));
  }
  const std::string csv =
      "\xef\xbb\xbf"
      "elbow_joint\n0.25\n";
  CHECK(robot.answered({"publish", robot.directory.write("moves.csv", csv)}).at("lines") == 1);
  CHECK(eventually([&] { return robot.position("elbow_joint") == 0.25; }));
}

namespace {

// Makes a pipe with this text in it. @return its other end, which keeps it open
int filled_pipe(const std::string& pipe, const std::string& text) {
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  const int writer = open(pipe.c_str(), O_RDWR | O_CLOEXEC);
  REQUIRE(write(writer, text.data(), text.size()) == static_cast<ssize_t>(text.size()));
  return writer;
}

}  // namespace

TEST_CASE("values: publishing a pipe ends at an interrupt and tells what was sent") {
  const Robot robot;
  const std::string pipe = robot.directory.path() + "/pipe";
  const int writer =
      filled_pipe(pipe, "{\"edge\": \"tool0\", \"xyz\": [0, 0, 0.25]}\n{\"edge\": \"too");
  Process publish = robot.domain.start_cli({"publish", pipe});
  CHECK(eventually([&] {
    return robot.answered({"lookup", "wrist_3_link", "tool0"}).at("translation").at(2) == 0.25;
  }));
  publish.signal(SIGINT);
  CHECK(publish.wait(in_time()) == 0);
  close(writer);
  CHECK_THAT(publish.out(), ContainsSubstring("sent         1 lines with 1 values"));
}

TEST_CASE("values: an interrupt before the first row is no error") {
  const Robot robot;
  const std::string pipe = robot.directory.path() + "/pipe";
  const int writer = filled_pipe(pipe, "edge,x,y,z,qx,qy,qz,qw\n");
  Process publish = robot.domain.start_cli({"publish", pipe});
  CHECK(eventually([&] {
    int left = -1;
    return ioctl(writer, FIONREAD, &left) == 0 && left == 0;
  }));
  publish.signal(SIGINT);
  CHECK(publish.wait(in_time()) == 0);
  close(writer);
  CHECK(publish.err().empty());
}

TEST_CASE("values: publishing waits for the writer of a pipe, and a signal ends that") {
  const Robot robot;
  const std::string pipe = robot.directory.path() + "/pipe";
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  Process publish = robot.domain.start_cli({"publish", pipe});
  SECTION("a writer comes") {
    int writer = -1;
    CHECK(eventually([&] {
      writer = open(pipe.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
      return writer >= 0;
    }));
    const std::string line = "{\"edge\": \"tool0\", \"xyz\": [0, 0, 0.5]}\n";
    CHECK(write(writer, line.data(), line.size()) == static_cast<ssize_t>(line.size()));
    close(writer);
    CHECK(publish.wait(in_time()) == 0);
    CHECK_THAT(publish.out(), ContainsSubstring("sent         1 lines with 1 values"));
  }
  SECTION("a signal comes") {
    const auto opens = [&] {
      const std::string held = "/proc/" + std::to_string(publish.pid()) + "/fd";
      const std::filesystem::directory_iterator files(held);
      return std::any_of(begin(files), end(files), [&](const auto& file) {
        std::error_code gone;
        return std::filesystem::read_symlink(file, gone) == pipe;
      });
    };
    CHECK(eventually(opens));
    publish.signal(SIGTERM);
    CHECK(publish.wait(in_time()) == 0);
    CHECK_THAT(publish.out(), ContainsSubstring("sent         0 lines"));
  }
}

TEST_CASE("values: a line without an end is no sample") {
  const Robot robot;
  const std::string file =
      robot.directory.write("long", std::string((std::size_t{16} << 20U) + 1, '0'));
  const CliResult sent = robot.domain.cli({"publish", file});
  CHECK(sent.status == 1);
  CHECK(sent.err == "tfdude: line 1: it is longer than 16 MiB\n");
  const CliResult rewritten = robot.domain.cli({"rewrite", "tool0", file});
  CHECK(rewritten.status == 1);
  CHECK_THAT(rewritten.err, ContainsSubstring("long, line 1: it is longer than 16 MiB"));
}

TEST_CASE("values: points of one frame are given in another with their covariance") {
  const Robot robot;
  robot.text({"add", "tool", "--parent", "tool0", "--xyz", "1", "2", "3", "--stddev", "0.01",
              "0.01", "0.01", "0", "0", "0.1"});
  const json origin = robot.answered({"point", "tool0", "tool", "0", "0", "0"});
  CHECK(origin.at("points").at(0).at("coordinates") == json({1.0, 2.0, 3.0}));
  CHECK(origin.at("points").at(0).at("covariance").at(1).at(1).get<double>() == Approx(1e-4));
  const json two = robot.answered({"point", "tool0", "tool", "1", "0", "0", "-1", "0", "0",
                                   "--joint", "--cov", "1e-6", "0", "0", "1e-6", "0", "1e-6"});
  REQUIRE(two.at("points").size() == 2);
  CHECK(two.at("points").at(0).at("covariance").at(1).at(1).get<double>() ==
        Approx(1e-4 + 1e-2 + 1e-6));
  CHECK(two.at("points").at(0).at("bias").at(0).get<double>() == Approx(-0.005));
  // Turned by the same error, the two move in opposite directions.
  CHECK(two.at("joint_covariance").at(1).at(4).get<double>() == Approx(1e-4 - 1e-2));
  const json normal = robot.answered({"point", "tool0", "tool", "0", "0", "1", "--direction"});
  CHECK(normal.at("points").at(0).at("coordinates") == json({0.0, 0.0, 1.0}));
  CHECK_THAT(robot.text({"point", "tool0", "tool", "1", "0", "0"}),
             ContainsSubstring("point        2.000000  2.000000  3.000000  m\n"
                               "std dev      0.010000  0.100499  0.010000  m\n"
                               "mean off by  -0.005000  0.000000  0.000000  m\n"));
  CHECK_THAT(robot.text({"point", "world", "tool", "1", "0", "0"}),
             ContainsSubstring("std dev      "));
  CHECK(robot.domain.cli({"point", "tool0", "tool", "1", "0"}).status == 2);
  const CliResult negative = robot.domain.cli(
      {"point", "tool0", "tool", "1", "0", "0", "--cov", "-1", "0", "0", "1", "0", "1"});
  CHECK(negative.status == 1);
  CHECK_THAT(negative.err, ContainsSubstring("point 1: covariance"));
  CHECK(robot.domain.cli({"point", "tool0", "nowhere", "1", "0", "0"}).status == 1);
}

TEST_CASE("values: frames of a calibration are imported, updated and exported") {
  const Robot robot;
  const auto camchain = [&](const char* baseline) {
    return robot.directory.write("camchain.yaml",
                                 std::string("cam0:\n  T_cam_imu: [0, 1, 0, 0.5,  -1, 0, 0, 0,  "
                                             "0, 0, 1, 0,  0, 0, 0, 1]\n"
                                             "cam1:\n  T_cn_cnm1: [1, 0, 0, ") +
                                     baseline + ", 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n");
  };
  const Arguments options = {"--into", "arm", "--name", "imu0=tool0", "--prefix", "head_"};
  const auto import = [&](const std::string& file, Arguments more = {}) {
    Arguments arguments = {"import", file};
    arguments.insert(arguments.end(), options.begin(), options.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  CHECK(robot.text({"import", camchain("-0.1"), "--dry-run"}) ==
        "cam0 in imu0: 0.000000  -0.500000  0.000000  m, 0.000000  0.000000  1.570796  rad\n"
        "cam1 in cam0: 0.100000  0.000000  0.000000  m, 0.000000  0.000000  0.000000  rad\n");
  CHECK(robot.answered({"exists", "head_cam0"}, 1).at("exists") == false);
  const json imported = robot.answered(import(camchain("-0.1")));
  CHECK(imported.at("done") == "imported");
  CHECK(imported.at("frames").at(1).at("id") == "head_cam1");
  const json seen = robot.answered({"lookup", "tool0", "head_cam1"});
  CHECK(seen.at("translation").at(1).get<double>() == Approx(-0.4));
  CHECK(seen.at("covariance").is_null());
  // Again: other values, with a covariance.
  robot.answered(import(camchain("-0.2"), {"--stddev", "1e-3", "1e-3", "1e-3", "0", "0", "0"}));
  const json again = robot.answered({"lookup", "head_cam0", "head_cam1"});
  CHECK(again.at("translation").at(0).get<double>() == Approx(0.2));
  CHECK(again.at("covariance").at(0).at(0).get<double>() == Approx(1e-6));
  // What is wrong changes nothing.
  const CliResult wrong = robot.domain.cli(import(camchain("nought")));
  CHECK(wrong.status == 2);
  CHECK_THAT(wrong.err, ContainsSubstring("camchain.yaml:4: cam1: T_cn_cnm1 is 'nought'"));
  const CliResult taken = robot.domain.cli(
      {"import", camchain("-0.3"), "--into", "base", "--name", "imu0=tool0", "--prefix", "head_"});
  CHECK(taken.status == 1);
  CHECK_THAT(taken.err, ContainsSubstring("frame 'head_cam0' belongs to partition 'arm'"));
  robot.text({"add", "below", "--parent", "head_cam1"});
  const CliResult cycle = robot.domain.cli(
      {"import", camchain("-0.3"), "--into", "arm", "--name", "imu0=below", "--prefix", "head_"});
  CHECK(cycle.status == 1);
  CHECK_THAT(cycle.err, ContainsSubstring("lies below it"));
  CHECK(robot.answered({"lookup", "head_cam0", "head_cam1"}) == again);
  // A parent that nobody has is a new root.
  robot.answered({"import", camchain("-0.1"), "--into", "arm"});
  CHECK(robot.answered({"parent", "imu0"}).at("parent").is_null());

  const std::string out = robot.directory.path() + "/stereo.yml";
  CHECK(robot.text({"export", out, "head_cam1", "--in", "head_cam0", "--format", "opencv"}) ==
        "wrote " + out + "\n");
  CHECK_THAT(robot.text({"import", out, "--dry-run"}),
             ContainsSubstring("right in left: 0.200000  0.000000  0.000000  m"));
  const json text = robot.answered({"export", "-", "--format", "ros2"});
  CHECK_THAT(text.at("text").get<std::string>(),
             ContainsSubstring("--frame-id tool0 --child-frame-id head_cam0"));
  const CliResult nobody = robot.domain.cli({"export", "-", "head_cam2", "--format", "ros2"});
  CHECK(nobody.status == 1);
  CHECK_THAT(nobody.err, ContainsSubstring("no frame 'head_cam2'; did you mean head_cam"));
  const CliResult twice = robot.domain.cli(
      {"import", camchain("-0.1"), "--dry-run", "--name", "imu0=a", "--name", "imu0=b"});
  CHECK_THAT(twice.err, ContainsSubstring("--name 'imu0' is given twice"));
  const CliResult exact = robot.domain.cli({"export", out, "head_cam1", "--format", "g2o"});
  CHECK(exact.status == 1);
  CHECK_THAT(exact.err, ContainsSubstring("an axis is known exactly"));
}

TEST_CASE("values: frames are placed and found by latitude and longitude") {
  const Robot robot;
  robot.text({"add", "earth", "--parent", "", "--partition", "base"});
  robot.text({"add", "site", "--parent", "earth", "--geodetic", "48.137154", "11.576124", "519",
              "--stddev", "0.02", "0.03", "0.05", "0", "0", "0.001"});
  robot.text({"add", "car", "--parent", "site", "--xyz", "0", "0", "2", "--rpy", "0", "0", "0.5",
              "--covariance", "exact"});
  const json seen = robot.answered({"lookup", "earth", "car", "--geodetic"}).at("geodetic");
  CHECK(seen.at("latitude").get<double>() == Approx(48.137154).epsilon(1e-12));
  CHECK(seen.at("longitude").get<double>() == Approx(11.576124).epsilon(1e-12));
  CHECK(seen.at("altitude").get<double>() == Approx(521));
  CHECK(seen.at("rotation_enu").at(2).get<double>() == Approx(std::sin(0.25)));
  CHECK(seen.at("stddev_enu").at(0).get<double>() == Approx(0.02));
  CHECK(seen.at("utm").at("zone") == "32N");
  CHECK_THAT(robot.text({"lookup", "earth", "car", "--geodetic"}),
             ContainsSubstring("latitude     48.137154000 deg\n") &&
                 ContainsSubstring("rpy to ENU   0.000000  0.000000  0.500000  rad\n") &&
                 ContainsSubstring("std dev ENU  0.020000  0.030000  0.050000  m\n") &&
                 ContainsSubstring("utm          32N  691"));
  CHECK_THAT(robot.text({"lookup", "site", "car", "--geodetic"}),
             ContainsSubstring("geodetic     none: not in an earth frame: the position is 2 m"));
  CHECK(robot.answered({"lookup", "site", "car", "--geodetic"}).at("geodetic").is_null());
  const CliResult wrong =
      robot.domain.cli({"update", "site", "--geodetic", "91", "11.576124", "519"});
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.err, ContainsSubstring("latitude is 91, not within -90 and 90 degrees"));
  CHECK(robot.domain.cli({"update", "site", "--geodetic", "1", "2", "3", "--xyz", "1", "2", "3"})
            .status == 2);
}

}  // namespace tfdude
