#include "tfdude/description/config.hpp"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>

#include "support/catch.hpp"

namespace {

using tfdude::Errc;

const std::string kValid = R"(# a comment
partition: robot
frames:
  - id: world
  - id: camera
    parent: world
    xyz: [1, -2.5, 3e-1]
    rpy: [0.1, 0.2, 0.3]
    stddev: [0.01, 0.01, 0.01, 0.001, 0.001, 0.001]
  - id: hand
    parent: camera
    quat: [0, 0, 0, 1]
    cov: [1, 0.5, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 1]
)";

// A file whose one frame, 'camera', has these further lines; the first of them is line 4.
std::string camera(const std::string& lines) {
  return "frames:\n  - id: world\n  - id: camera\n" + lines + "\n";
}

struct Refused {
  std::string text;
  Errc code;
  std::string message;
};

void check_refused(const Refused& expected) {
  CAPTURE(expected.text);
  const auto config = tfdude::parse_config(expected.text, "robot.yaml");
  REQUIRE_FALSE(config.has_value());
  CHECK(config.error().message == expected.message);
  CHECK(to_string(config.error().code) == to_string(expected.code));
}

// For texts whose message comes in part from yaml-cpp.
void check_refused_at(const std::string& text, const std::string& start) {
  CAPTURE(text.substr(0, 200));
  const auto config = tfdude::parse_config(text, "robot.yaml");
  REQUIRE_FALSE(config.has_value());
  CAPTURE(config.error().message);
  CHECK(config.error().message.rfind(start, 0) == 0);
  CHECK(config.error().code == Errc::kConfig);
}

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& text)
      : path_(std::filesystem::temp_directory_path() /
              ("tfdude_config_" + std::to_string(std::random_device()()) + ".yaml")) {
    std::ofstream(path_, std::ios::binary) << text;
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() { std::filesystem::remove(path_); }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace

TEST_CASE("a configuration is read") {
  const auto config = tfdude::parse_config(kValid, "robot.yaml");
  REQUIRE(config.has_value());
  CHECK(config->partition == "robot");
  REQUIRE(config->frames.size() == 3);

  const auto& world = config->frames[0];
  CHECK(world.id == "world");
  CHECK(world.parent.empty());
  CHECK(world.X_PC.pose.matrix().isIdentity(0));
  CHECK(world.X_PC.covariance.of_specified().matrix().isZero(0));

  const auto& camera = config->frames[1];
  CHECK(camera.parent == "world");
  CHECK(camera.X_PC.pose.translation() == Eigen::Vector3d(1, -2.5, 0.3));
  CHECK(camera.X_PC.pose.rotation().angularDistance(tfdude::from_rpy(0.1, 0.2, 0.3)) < 1e-15);
  CHECK(camera.X_PC.covariance.of_specified().stddev()[2] == tfdude::testing::Approx(0.01));
  CHECK(camera.X_PC.covariance.of_specified().stddev()[5] == tfdude::testing::Approx(0.001));

  CHECK(config->frames[2].X_PC.covariance.of_specified().matrix()(1, 0) == 0.5);
}

TEST_CASE("optional entries of a configuration may be left out") {
  CHECK(tfdude::parse_config("partition: robot\n", "f")->frames.empty());
  CHECK(tfdude::parse_config("frames: []\n", "f")->partition.empty());
  CHECK(tfdude::parse_config("frames: [{id: a}, {id: b, parent: a}]", "f")->frames.size() == 2);
  // Parents may come later or belong to another partition.
  CHECK(tfdude::parse_config("frames: [{id: b, parent: a}, {id: a, parent: x}]", "f").has_value());
  // Ids are text whatever they look like.
  CHECK(tfdude::parse_config("frames: [{id: 7}, {id: 'null'}]", "f")->frames[1].id == "null");
  CHECK(tfdude::parse_config("frames: [{id: größe ✓}]", "f")->frames[0].id == "größe ✓");
}

TEST_CASE("a frame may give the correlation of its error") {
  const auto config = tfdude::parse_config(
      "frames:\n"
      "  - {id: a}\n"
      "  - {id: b, correlation: unknown}\n"
      "  - {id: c, correlation: independent, sources: {belt: [[1, 2, 3, 4, 5, 6], [0, 0, 0, 0, 0, "
      "7]], z: [[0, 0, 1, 0, 0, 0]]}}\n",
      "robot.yaml");
  REQUIRE(config);
  CHECK(config->frames[0].correlation.empty());
  CHECK(config->frames[1].correlation.unknown);
  const auto& said = config->frames[2].correlation;
  CHECK_FALSE(said.unknown);
  REQUIRE(said.common_errors.size() == 2);
  CHECK(said.common_errors[0].source == "belt");
  CHECK(said.common_errors[0].loading.cols() == 2);
  CHECK(said.common_errors[0].loading(5, 0) == 6);
  CHECK(said.common_errors[0].loading(5, 1) == 7);
  const auto refused = [](const std::string& what, const std::string& why) {
    const auto bad = tfdude::parse_config("frames:\n  - {id: a, " + what + "}\n", "robot.yaml");
    REQUIRE_FALSE(bad.has_value());
    INFO(bad.error().message);
    CHECK(bad.error().message.rfind("robot.yaml:2: frame 'a': " + why, 0) == 0);
  };
  refused("correlation: no", "correlation is neither unknown nor independent");
  refused("correlation: [1]", "correlation is not text");
  refused("sources: [1]", "sources is not a mapping");
  refused("sources: {s: 1}", "source 's' is not a list of columns of 6 numbers");
  refused("sources: {s: []}", "source 's' is not a list of columns of 6 numbers");
  refused("sources: {s: [1, 2, 3, 4, 5, 6]}", "source 's'[0] is not a list of 6 numbers");
  refused("sources: {s: [[1, 2, 3, 4, 5]]}", "source 's'[0] is not a list of 6 numbers");
  refused("sources: {s: [[1, 2, 3, 4, 5, x]]}", "source 's'[0][5] is 'x', which is not a number");
  refused("sources: {s: [[1, 2, 3, 4, 5, 1e10]]}", "source 's': an element of its loading");
  refused("sources: {'': [[1, 2, 3, 4, 5, 6]]}", "source");
  refused("sources: {s: [[1, 2, 3, 4, 5, 6]], s: [[1, 2, 3, 4, 5, 6]]}",
          "sources: s is given twice");
  refused("sources: {'observed:1': [[1, 2, 3, 4, 5, 6]]}",
          "source 'observed:1': names with this prefix");
  refused("sources: {joint supply: [[1, 2, 3, 4, 5, 6]]}",
          "source 'joint supply': names with this prefix are reserved for joints");
}

TEST_CASE("limits of history are given for the file and for each frame") {
  const auto config = tfdude::parse_config(
      "history: {span: 2.5, count: 100, max_ahead: none, believed: 30}\n"
      "frames:\n"
      "  - {id: a}\n"
      "  - {id: b, history: {count: 7, moving: true, process_noise: [1, 2, 3, 0.1, 0.2, 0.3], "
      "max_ahead: 1.5, restart_after: 0, believed: 0}}\n",
      "f");
  REQUIRE(config.has_value());
  CHECK(config->history.span == std::chrono::milliseconds(2500));
  CHECK(config->history.count == 100);
  CHECK_FALSE(config->history.moving);
  CHECK(config->history.max_ahead == std::chrono::nanoseconds::max());
  CHECK(config->history.restart_after == 5);
  CHECK(config->frames[1].timing->max_ahead == std::chrono::milliseconds(1500));
  CHECK(config->frames[1].timing->restart_after == 0);
  CHECK(config->history.believed == std::chrono::seconds(30));
  CHECK(config->frames[1].timing->believed.count() == 0);
  CHECK_FALSE(config->frames[0].timing.has_value());
  REQUIRE(config->frames[1].timing.has_value());
  CHECK(config->frames[1].timing->span == std::chrono::milliseconds(2500));
  CHECK(config->frames[1].timing->count == 7);
  CHECK(config->frames[1].timing->moving);
  CHECK(config->frames[1].timing->process_noise.upper()[0] == 1);
  CHECK(config->frames[1].timing->process_noise.stddev()[5] == tfdude::testing::Approx(0.3));
  const auto refused = [](const std::string& history, const std::string& why) {
    const auto bad =
        tfdude::parse_config("frames:\n  - {id: a, history: " + history + "}\n", "robot.yaml");
    REQUIRE_FALSE(bad.has_value());
    CAPTURE(bad.error().message);
    CHECK(bad.error().message.rfind("robot.yaml:2: frame 'a': history" + why, 0) == 0);
  };
  refused("{span: 0}", ": span must be 1e-6 to 1e6 seconds");
  refused("{span: .nan}", ": span is not a finite number");
  refused("{count: 1}", ": count must be a whole number from 2");
  refused("{count: 2.5}", ": count must be a whole number from 2");
  refused("{process_noise: [1, 2]}", ": process_noise has 2, not 6 numbers");
  refused("{process_noise: [-1, 0, 0, 0, 0, 0]}", ": process_noise: stddev[0]");
  refused("{moving: perhaps}", ": moving is neither true nor false");
  refused("{spam: 1}",
          ": unknown key 'spam'; known are span, count, process_noise, drifts, moving, max_ahead, "
          "restart_after, believed");
  refused("{max_ahead: -1}", ": max_ahead must be 0 to 1e9 seconds, or none");
  refused("{max_ahead: .nan}", ": max_ahead is not a finite number");
  refused("{max_ahead: some}", ": max_ahead is 'some', which is not a number");
  refused("{restart_after: 1.5}", ": restart_after must be a whole number from 0");
  refused("{believed: -1}", ": believed must be 0 to 1e6 seconds");
  refused("3", " is not a mapping");
  CHECK(tfdude::parse_config("history: {max_ahead: 0}\n", "f")->history.max_ahead.count() == 0);
  CHECK_FALSE(tfdude::parse_config("history: {span: -1}\n", "f").has_value());
}

TEST_CASE("anchors and aliases stand for their values") {
  const auto config = tfdude::parse_config(
      "frames:\n  - {id: a, stddev: &joint [1, 1, 1, 1, 1, 1]}\n  - {id: b, stddev: *joint}\n",
      "f");
  REQUIRE(config.has_value());
  CHECK(config->frames[1].X_PC.covariance.of_specified().upper()[0] == 1);
  check_refused_at("frames: &a [*a]\n", "robot.yaml:1: ");
  check_refused_at("frames: &a {id: *a}\n", "robot.yaml:1: ");
  check_refused_at("&a [*a, *a]\n", "robot.yaml:1: ");
  check_refused_at("frames: *nowhere\n", "robot.yaml:1: not YAML: ");
}

// Once, the message had as many bytes as the file.
TEST_CASE("an error repeats only the begin of a long value") {
  const auto config = tfdude::parse_config(
      "frames:\n  - {id: a, xyz: [1" + std::string(1'000'000, '0') + ", 0, 0]}\n", "f");
  REQUIRE_FALSE(config);
  CHECK(config.error().message.size() < 400);
  CHECK(config.error().message.rfind("f:2: frame 'a': xyz[0] is '1000", 0) == 0);
}

TEST_CASE("a file of the wrong structure is rejected") {
  check_refused({"", Errc::kConfig, "robot.yaml: is empty"});
  check_refused({"# only a comment\n\n", Errc::kConfig, "robot.yaml: is empty"});
  check_refused({"---\n", Errc::kConfig, "robot.yaml: is empty"});
  check_refused(
      {"hello", Errc::kConfig,
       "robot.yaml:1: the file is not a mapping with the keys partition, clock, covariance, "
       "history, frames, urdf"});
  check_refused(
      {"partition: a\nframe: []\n", Errc::kConfig,
       "robot.yaml:2: the file: unknown key 'frame'; known are partition, clock, covariance, "
       "history, frames, urdf"});
  check_refused({"partition: a\npartition: a\n", Errc::kConfig,
                 "robot.yaml:2: the file: partition is given twice"});
  check_refused({"partition: [a]\n", Errc::kConfig, "robot.yaml:1: partition is not text"});
  check_refused(
      {"partition:\nframes: []\n", Errc::kConfig, "robot.yaml:1: partition has no value"});
  check_refused({"frames:\n  id: a\n", Errc::kConfig, "robot.yaml:2: frames is not a list"});
  check_refused({"frames: 7\n", Errc::kConfig, "robot.yaml:1: frames is not a list"});
  check_refused({"frames:\n", Errc::kConfig, "robot.yaml:1: frames is not a list"});
  check_refused({"[a]: b\n", Errc::kConfig, "robot.yaml:1: the file: a key is not plain text"});
  check_refused({"partition: a\n---\npartition: b\n", Errc::kConfig,
                 "robot.yaml:2: holds more than one YAML document"});
  check_refused(
      {"frames:\n  - world\n", Errc::kConfig,
       "robot.yaml:2: frames[0] is not a mapping with the keys id, parent, xyz, rpy, quat, "
       "matrix, geodetic, stddev, cov, covariance, history, correlation, sources"});
  check_refused({"frames:\n  - {id: a}\n  - parent: a\n", Errc::kConfig,
                 "robot.yaml:3: frames[1]: id is missing"});
  check_refused({"partition: a\x04\nframes: []\n", Errc::kConfig,
                 "robot.yaml:1: holds the control character '\\x04'"});
  check_refused({"partition: a\n" + std::string(1, '\0'), Errc::kConfig,
                 "robot.yaml:2: holds the control character '\\x00'"});
  check_refused_at("partition: a\nframes: [1, 2\n", "robot.yaml:");
  check_refused_at("frames: ['a\n", "robot.yaml:");
  check_refused_at("frames:\n  - id: a\n parent: b\n", "robot.yaml:3: not YAML: ");
  check_refused_at("\tpartition: a\n", "robot.yaml:1: not YAML: ");
  check_refused_at("!!str , ", "robot.yaml:1: ");
  check_refused_at("%YAML 1.2\xa5\n---\npartition: a\n",
                   "robot.yaml:1: not YAML: bad YAML version: 1.2\\xa5");
}

TEST_CASE("an invalid frame is rejected by name and line") {
  check_refused(
      {camera("    pos: [1, 2, 3]"), Errc::kConfig,
       "robot.yaml:4: frame 'camera': unknown key 'pos'; known are id, parent, xyz, rpy, quat, "
       "matrix, geodetic, stddev, cov, covariance, history, correlation, sources"});
  check_refused({camera("    parent: world\n    xyz: [1, 2, 3]\n    xyz: [1, 2, 3]"), Errc::kConfig,
                 "robot.yaml:6: frame 'camera': xyz is given twice"});
  check_refused({camera("    xyz: [1, 2]"), Errc::kConfig,
                 "robot.yaml:4: frame 'camera': xyz has 2, not 3 numbers"});
  check_refused({camera("    xyz: 1"), Errc::kConfig,
                 "robot.yaml:4: frame 'camera': xyz is not a list of 3 numbers"});
  check_refused({camera("    cov: [1, 2, 3]"), Errc::kConfig,
                 "robot.yaml:4: frame 'camera': cov has 3, not 21 numbers"});
  check_refused({camera("    xyz:\n      - 1\n      - up\n      - 3"), Errc::kConfig,
                 "robot.yaml:6: frame 'camera': xyz[1] is 'up', which is not a number"});
  check_refused({camera("    xyz: [1, [2], 3]"), Errc::kConfig,
                 "robot.yaml:4: frame 'camera': xyz[1] is not a number"});
  check_refused({camera("    xyz: [1, '2', 3]"), Errc::kConfig,
                 "robot.yaml:4: frame 'camera': xyz[1] is not a number"});
  check_refused({camera("    xyz: [1, 2 3, 3]"), Errc::kConfig,
                 "robot.yaml:4: frame 'camera': xyz[1] is '2 3', which is not a number"});
  check_refused({camera("    xyz: [0, 1e999\xff, 0]"), Errc::kConfig,
                 "robot.yaml:4: frame 'camera': xyz[1] is '1e999\\xff', which is not a number"});
  check_refused({camera("    xyz: [1, , 3]"), Errc::kConfig,
                 "robot.yaml:4: frame 'camera': xyz[1] is not a number"});
  check_refused({camera("    parent: [world]"), Errc::kConfig,
                 "robot.yaml:4: frame 'camera': parent is not text"});
  check_refused(
      {camera("    parent:"), Errc::kConfig, "robot.yaml:4: frame 'camera': parent has no value"});
  check_refused({camera("  - id: camera"), Errc::kInvalidInput,
                 "robot.yaml:4: frame 'camera': id is taken by the frame in line 3"});
}

TEST_CASE("an invalid value is rejected by field") {
  check_refused({camera("    stddev: [0, 0, -1, 0, 0, 0]"), Errc::kInvalidInput,
                 "robot.yaml:4: frame 'camera': stddev[2] is negative"});
  check_refused({camera("    xyz: [0, .nan, 0]"), Errc::kInvalidInput,
                 "robot.yaml:4: frame 'camera': xyz[1] is not a finite number"});
  check_refused({camera("    rpy: [0, 0, -.inf]"), Errc::kInvalidInput,
                 "robot.yaml:4: frame 'camera': rpy[2] is not a finite number"});
  check_refused({camera("    quat: [nan, 0, 0, 1]"), Errc::kInvalidInput,
                 "robot.yaml:4: frame 'camera': quat[0] is not a finite number"});
  check_refused({camera("    xyz: [1e999, 0, 0]"), Errc::kInvalidInput,
                 "robot.yaml:4: frame 'camera': xyz[0] is '1e999', which no double can hold"});
  check_refused({camera("    xyz: [0, 0, 2e9]"), Errc::kInvalidInput,
                 "robot.yaml:4: frame 'camera': xyz: translation.z is beyond 1e9 m"});
  check_refused({camera("    parent: world\n    quat: [0, 0, 0, 2]"), Errc::kInvalidInput,
                 "robot.yaml:5: frame 'camera': quat: rotation has the norm 2, not that of a unit "
                 "quaternion"});
  check_refused(
      {camera("    cov: [1, 2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 0, 1]"),
       Errc::kInvalidInput,
       "robot.yaml:4: frame 'camera': cov: covariance[0][1] is larger than its variances allow: "
       "not positive semi-definite"});
  check_refused({camera("    rpy: [0, 0, 0]\n    quat: [0, 0, 0, 1]"), Errc::kInvalidInput,
                 "robot.yaml:4: frame 'camera': rpy and quat are both given, one is enough"});
  check_refused(
      {"frames: [{id: ''}]", Errc::kInvalidInput, "robot.yaml:1: frames[0]: id is empty"});
  check_refused(
      {camera("    stddev: [0, 0, 0, 0, 0, 0]\n    cov: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, "
              "0, 0, 0, 0, 0, 0, 0, 0]"),
       Errc::kInvalidInput,
       "robot.yaml:4: frame 'camera': stddev and cov are both given, one is enough"});
  for (const char* pose :
       {"xyz: [0, 0, 1]", "rpy: [0, 0, 1]", "quat: [0, 0, 0, 1]", "geodetic: [48, 11, 500]"}) {
    const std::string key(pose, std::strchr(pose, ':'));
    check_refused({camera(std::string("    ") + pose), Errc::kConfig,
                   "robot.yaml:4: frame 'camera': " + key +
                       " needs parent: it places the frame in that one"});
  }
  check_refused({camera("    parent: ''"), Errc::kInvalidInput,
                 "robot.yaml:4: frame 'camera': parent is empty"});
  check_refused({"frames: [{id: \"a\\nb\"}]", Errc::kInvalidInput,
                 "robot.yaml:1: frames[0]: id 'a\\x0ab' holds a control character"});
  check_refused({"frames: [{id: a\xff}]", Errc::kInvalidInput,
                 "robot.yaml:1: frames[0]: id 'a\\xff' is not valid UTF-8"});
  check_refused({"partition: 'a*'", Errc::kInvalidInput,
                 "robot.yaml:1: partition 'a*' holds '*', which has a special meaning in DDS"});
  check_refused({"partition: ''", Errc::kInvalidInput, "robot.yaml:1: partition is empty"});
  const auto longest = tfdude::parse_config("frames: [{id: " + std::string(255, 'x') + "}]", "f");
  CHECK(longest.has_value());
  const auto longer = tfdude::parse_config("frames: [{id: " + std::string(256, 'x') + "}]", "f");
  REQUIRE_FALSE(longer.has_value());
  CHECK_THAT(longer.error().message,
             tfdude::testing::ContainsSubstring("has 256 bytes, at most 255"));
}

TEST_CASE("deep nesting is rejected") {
  for (const std::string bracket : {"[", "{", "- ", "? ", "&a [", "!!x ["}) {
    std::string text = "frames: ";
    if (bracket == "- " || bracket == "? ") text = "frames:\n  ";
    for (int i = 0; i < 20000; ++i) text += bracket;
    check_refused_at(text, "robot.yaml:");
  }
  std::string laughs = "a0: &a0 [x, x]\n";
  for (int i = 1; i < 64; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    const std::string name = "a" + std::to_string(i);
    laughs.append(name).append(": &").append(name).append(" [").append(before).append(", ");
    laughs.append(before).append("]\n");
  }
  check_refused_at(laughs, "robot.yaml:19: aliases repeat more than 2000000 values");
}

TEST_CASE("files that cannot be read are rejected") {
  const TemporaryFile file(kValid);
  REQUIRE(tfdude::load_config(file.path()).has_value());
  const TemporaryFile bad("frames: 7\n");
  CHECK(tfdude::load_config(bad.path()).error().message == bad.path() + ":1: frames is not a list");
  const TemporaryFile empty("");
  CHECK(tfdude::load_config(empty.path()).error().message == empty.path() + ": is empty");
  CHECK(tfdude::load_config("/nonexistent/robot.yaml").error().message ==
        "/nonexistent/robot.yaml: cannot be opened: No such file or directory");
  CHECK(tfdude::load_config("/tmp").error().message == "/tmp: is a directory");
  CHECK(tfdude::load_config("").error().code == Errc::kConfig);
  CHECK(tfdude::load_config("/dev/zero").error().message == "/dev/zero: is longer than 64 MiB");
}

TEST_CASE("a damaged file is rejected without a crash or an exception") {
  constexpr std::uint32_t kSeed = 20240611;
  CAPTURE(kSeed);
  std::mt19937 random(kSeed);
  const auto below = [&](std::size_t limit) { return random() % limit; };
  constexpr std::string_view kTelling = "[]{}:,-#&*!|>'\"%@`?\n\t ~.0e";
  int refused = 0;
  for (int round = 0; round < 2000; ++round) {
    std::string text = kValid;
    for (std::size_t edits = 1 + below(4); edits > 0; --edits) {
      const std::size_t at = below(text.size());
      const bool telling = below(2) == 0;
      const char byte = telling ? kTelling[below(kTelling.size())] : static_cast<char>(below(256));
      switch (below(4)) {
        case 0:
          text.erase(at, 1 + below(8));
          break;
        case 1:
          text.insert(at, 1 + below(3), byte);
          break;
        case 2:
          text.insert(at, text.substr(below(text.size()), below(30)));
          break;
        default:
          text[at] = byte;
      }
    }
    CAPTURE(round, text);
    tfdude::Result<tfdude::Config> config;
    REQUIRE_NOTHROW(config = tfdude::parse_config(text, "robot.yaml"));
    if (config) continue;
    ++refused;
    REQUIRE(config.error().message.rfind("robot.yaml:", 0) == 0);
  }
  CHECK(refused > 1000);
}
