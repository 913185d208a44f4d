// Pictures on the command line, with real daemons.

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "support/catch.hpp"
#include "support/thesis_json.hpp"

namespace tfdude {
namespace {

using nlohmann::json;
using testing::answered;
using testing::CliResult;
using testing::ContainsSubstring;
using testing::Process;
using testing::TemporaryDirectory;
using testing::ThesisDaemons;
using Arguments = std::vector<std::string>;

std::string read(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::size_t files_in(const TemporaryDirectory& directory) {
  const std::filesystem::directory_iterator files(directory.path());
  return static_cast<std::size_t>(std::distance(begin(files), end(files)));
}

CliResult run(const Arguments& argv) {
  Process process(argv);
  return testing::finish(process);
}

// The names of all elements of a file of XML, or why it is none.
std::string elements_of(const std::string& file) {
  const CliResult result =
      run({"/usr/bin/env", "python3", "-c",
           "import sys, xml.etree.ElementTree as x\n"
           "print(*(e.tag.split('}')[1] for e in x.parse(sys.argv[1]).iter()))",
           file});
  return result.status == 0 ? result.out : "not XML: " + result.err;
}

// All that is written in a picture, a line each.
std::string texts_of(const std::string& file) {
  const std::string svg = read(file);
  const std::regex text("<text[^>]*>([^<]*)</text>");
  std::string all;
  for (std::sregex_iterator it(svg.begin(), svg.end(), text), end; it != end; ++it) {
    all += (*it)[1].str() + "\n";
  }
  return all;
}

bool is_png(const std::string& file) { return read(file).rfind("\x89PNG\r\n\x1a\n", 0) == 0; }

// The command line where only the programs in one directory are found.
CliResult run_with_path(const ThesisDaemons& d, const std::string& path, Arguments arguments) {
  const Arguments begin{"/usr/bin/env",
                        "PATH=" + path,
                        TFDUDE_CLI,
                        "--domain",
                        std::to_string(d.domain.number()),
                        "--profile",
                        TFDUDE_LOOPBACK_PROFILE};
  arguments.insert(arguments.begin(), begin.begin(), begin.end());
  return run(arguments);
}

}  // namespace

TEST_CASE("pictures: plot draws a path as SVG and PNG") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string svg = directory.path() + "/hand.svg";
  CHECK(text(d, {"plot", "world", "hand_left", "--out", svg, "--samples", "300"}) ==
        "wrote " + svg + "\n");
  const std::string elements = elements_of(svg);
  CHECK_THAT(elements, ContainsSubstring("svg title style rect") && ContainsSubstring("circle"));
  const std::string drawn = texts_of(svg);
  CHECK_THAT(drawn, ContainsSubstring("hand_left in world\n") &&
                        ContainsSubstring("300 points, seed 1\n") &&
                        ContainsSubstring("\narm_1\n"));
  // From the lookup that the command line prints.
  const json X = answered(d, {"lookup", "world", "hand_left"});
  char x[32];
  std::snprintf(x, sizeof x, "x = %.3f m", X.at("translation").at(0).get<double>());
  CHECK_THAT(drawn, ContainsSubstring(x));
  const std::string png = directory.path() + "/hand.png";
  CHECK(answered(d, {"plot", "camera", "hand_left", "--out", png}) ==
        json({{"file", png},
              {"from", "camera"},
              {"to", "hand_left"},
              {"frames", {"camera", "robot_2", "robot_1", "arm_1", "arm_left", "hand_left"}},
              {"stamp", nullptr},
              {"stamp_ns", nullptr}}));
  CHECK(is_png(png));
  const json sampled =
      answered(d, {"plot", "hand_left", "hand_left", "--out", svg, "--samples", "9"});
  CHECK(sampled.at("frames") == json({"hand_left"}));
  CHECK(sampled.at("samples") == 9);
  CHECK(sampled.at("seed") == 1);
  CHECK_THAT(texts_of(svg), ContainsSubstring("hand_left in hand_left\n"));
  CHECK(files_in(directory) == 2);
}

TEST_CASE("pictures: plot draws a path at an instant") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/a.svg";
  for (const auto& [stamp, x] : {std::pair("1000", "1"), {"1002", "3"}}) {
    (void)text(d, {"update", "arm_2", "--xyz", x, "0", "0", "--stamp", stamp});
  }
  const json middle = answered(d, {"plot", "arm_1", "arm_2", "--at", "1001", "--out", file});
  CHECK(middle.at("stamp_ns") == 1'001'000'000'000);
  CHECK_THAT(read(file),
             ContainsSubstring("x = 2.0000 m") && ContainsSubstring("1970-01-01 00:16:41.000 UTC"));
  const std::string before = read(file);
  CHECK(answered(d, {"plot", "arm_1", "arm_2", "--at", "1003", "--out", file}, 1)
            .at("error")
            .at("code") == "not_yet");
  CHECK(read(file) == before);
}

TEST_CASE("pictures: sampled points name what they ignore") {
  const testing::TestDomain domain;
  std::vector<Process> daemons;
  for (const char* name : {"base", "arm"}) {
    daemons.push_back(domain.serve(std::string(TFDUDE_EXAMPLES "/uncertainty/") + name + ".yaml"));
  }
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/arm.svg";
  CHECK(domain.cli({"plot", "world", "arm", "--out", file}).status == 0);
  CHECK_THAT(texts_of(file), !ContainsSubstring("independent"));
  CHECK(domain.cli({"plot", "world", "arm", "--out", file, "--samples", "5"}).status == 0);
  CHECK_THAT(texts_of(file), ContainsSubstring("take edges as independent"));
}

TEST_CASE("pictures: graph draws the forest as DOT and SVG and PNG") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string dot = directory.path() + "/all.dot";
  (void)text(d, {"update", "arm_2", "--xyz", "0", "0", "1", "--stamp", "-7200"});
  CHECK(text(d, {"graph", "--out", dot}) == "wrote " + dot + "\n");
  const std::string drawn = read(dot);
  CHECK_THAT(drawn, ContainsSubstring("↳ robot_1</TD>"));
  CHECK_THAT(drawn, ContainsSubstring(">±30 mm  ±0.01 rad<"));
  CHECK_THAT(drawn, ContainsSubstring("• arm_2</TD>") && ContainsSubstring(">2 h  ±1 mm<"));
  CHECK_THAT(drawn, ContainsSubstring("pid " + std::to_string(d.arms->pid())));
  const CliResult plain = run({"/usr/bin/env", "dot", "-Tplain", dot});
  CHECK(plain.status == 0);
  const auto lines = [&](const std::string& kind) {
    const std::regex line("(^|\n)" + kind + " ");
    return std::distance(std::sregex_iterator(plain.out.begin(), plain.out.end(), line), {});
  };
  // From robot_1 on there are two branches: the arms, and the rest of the base.
  CHECK(lines("node") == 3);
  CHECK(lines("edge") == 2);
  const std::string svg = directory.path() + "/all.svg";
  CHECK(answered(d, {"graph", "--out", svg}) ==
        json({{"file", svg}, {"frames", 9}, {"partitions", 2}}));
  CHECK_THAT(elements_of(svg), ContainsSubstring("svg g"));
  CHECK_THAT(texts_of(svg), ContainsSubstring("↳ hand_left\n"));
  CHECK(text(d, {"graph", "--out", dot, "--root", "arm_1", "--depth", "1"}) ==
        "wrote " + dot + "\n");
  CHECK_THAT(read(dot), ContainsSubstring("arm_left") && ContainsSubstring("+ 1 frame below") &&
                            !ContainsSubstring("world") && !ContainsSubstring("hand_left"));
  CHECK(answered(d, {"graph", "--out", dot, "--root", "nowhere"}, 1).at("error").at("code") ==
        "unknown_frame");
  const std::string png = directory.path() + "/all.png";
  (void)text(d, {"graph", "--out", png});
  CHECK(is_png(png));
  CHECK(files_in(directory) == 3);
}

TEST_CASE("pictures: the graph of a humanoid with fingers fits a screen, with all its joints") {
  std::string urdf = "<robot name='humanoid'><link name='base'/>";
  std::size_t links = 1;
  // Each hangs on the one before. @return the last one
  const auto chain = [&](std::string parent, const std::vector<std::string>& names) {
    for (const std::string& name : names) {
      urdf += "<link name='" + name + "_link'/><joint name='" + name +
              "_joint' type='continuous'><parent link='" + parent + "'/><child link='" + name +
              "_link'/></joint>";
      parent = name + "_link";
      ++links;
    }
    return parent;
  };
  const std::string torso = chain("base", {"waist_yaw", "waist_roll", "waist_pitch", "torso"});
  const std::string head = chain(torso, {"neck_yaw", "neck_pitch", "head"});
  for (const char* eye : {"camera_left", "camera_right", "depth_camera"}) chain(head, {eye});
  for (const std::string side : {"left_", "right_"}) {
    const auto named = [&](std::vector<std::string> names) {
      for (std::string& name : names) name.insert(0, side);
      return names;
    };
    chain("base",
          named({"hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch", "ankle_roll", "sole"}));
    const std::string hand =
        chain(torso, named({"shoulder_pitch", "shoulder_roll", "shoulder_yaw", "elbow",
                            "wrist_roll", "wrist_pitch", "wrist_yaw", "hand_base"}));
    for (const std::string finger : {"thumb", "index", "middle", "ring", "little"}) {
      chain(hand, named({finger + "_0", finger + "_1", finger + "_2", finger + "_tip"}));
    }
  }
  urdf += "</robot>";
  REQUIRE(links > 75);
  const testing::TestDomain domain;
  const TemporaryDirectory directory;
  testing::Process daemon = domain.start_daemon(
      {"--no-state", "--partition", "humanoid", "--urdf", directory.write("humanoid.urdf", urdf)});
  testing::await_ready(daemon);
  const std::string file = directory.path() + "/humanoid.svg";
  REQUIRE(domain.cli({"graph", "--out", file}).status == 0);
  const std::string svg = read(file);
  std::smatch size;
  REQUIRE(
      std::regex_search(svg, size, std::regex("<svg width=\"([0-9]+)pt\" height=\"([0-9]+)pt")));
  constexpr double kPixels = 96.0 / 72;  // per point
  CHECK(std::stod(size[1]) * kPixels <= 1600);
  CHECK(std::stod(size[2]) * kPixels <= 1200);
  CHECK_THAT(svg, ContainsSubstring("right_little_tip_joint") && !ContainsSubstring("below") &&
                      !ContainsSubstring("±0 mm"));
}

TEST_CASE("pictures: any name can be drawn") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/a.svg";
  const Arguments names = {"<a & \"b\\", "a --> b", "\\N \xEF\xBF\xBE", "漢 \xF0\x9F\xA4\x96"};
  std::string parent = "camera";
  for (const std::string& name : names) {
    (void)text(d, {"add", name, "--parent", parent, "--xyz", "0.1", "0", "0"});
    parent = name;
  }
  (void)text(d, {"plot", "camera", parent, "--out", file});
  CHECK_THAT(elements_of(file), ContainsSubstring("svg "));
  CHECK_THAT(texts_of(file), ContainsSubstring("&lt;a &amp; &quot;b\\\n"));
  (void)text(d, {"graph", "--out", file});
  CHECK_THAT(elements_of(file), ContainsSubstring("svg "));
  const std::string drawn = texts_of(file);
  CHECK_THAT(drawn, ContainsSubstring("&lt;a &amp; &quot;b\\\u200B\n"));
  CHECK_THAT(drawn, ContainsSubstring("\\\u200BN \xEF\xBF\xBD\n"));
}

TEST_CASE("pictures: their commands have help with an example") {
  const testing::TestDomain domain;
  for (const std::string command : {"plot", "graph"}) {
    CHECK_THAT(domain.cli({"--help"}).out, ContainsSubstring("\n  " + command + " "));
    CHECK_THAT(domain.cli({command, "--help"}).out,
               ContainsSubstring("Example: tfdude " + command + " "));
  }
}

TEST_CASE("pictures: wrong arguments are rejected and no file is written") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/a";
  for (const char* name : {"/a.jpg", "/a", "/a.svg.gz", "/svg"}) {
    const CliResult result =
        d.domain.cli({"plot", "world", "camera", "--out", directory.path() + name});
    CHECK(result.status == 2);
    CHECK_THAT(result.err, ContainsSubstring(".svg, .png"));
  }
  CHECK(d.domain.cli({"plot", "world", "camera", "--out", file + ".dot"}).status == 2);
  CHECK(d.domain.cli({"plot", "world", "camera"}).status == 2);
  const CliResult gif = d.domain.cli({"--json", "graph", "--out", file + ".gif"});
  CHECK(gif.status == 2);
  CHECK_THAT(gif.out, ContainsSubstring(".svg, .png, .dot") && ContainsSubstring("\"usage\""));
  for (const char* samples : {"0", "100001", "-1", "x"}) {
    CHECK(d.domain.cli({"plot", "world", "camera", "--out", file + ".svg", "--samples", samples})
              .status == 2);
  }
  CHECK(
      answered(d, {"plot", "world", "nowhere", "--out", file + ".svg"}, 1).at("error").at("code") ==
      "unknown_end");
  CHECK(d.domain.cli({"plot", "world", "camera", "--out", file + ".svg", "--at", "1x"}).status ==
        2);
  CHECK(files_in(directory) == 0);
}

TEST_CASE("pictures: a file that cannot be written is named and left unwritten") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string nowhere = directory.path() + "/none/a.svg";
  const CliResult lost = d.domain.cli({"plot", "world", "camera", "--out", nowhere});
  CHECK(lost.status == 1);
  CHECK_THAT(lost.err, ContainsSubstring("cannot write '" + nowhere + "': No such file"));
  const std::string taken = directory.path() + "/taken.dot";
  std::filesystem::create_directory(taken);
  const json error = answered(d, {"graph", "--out", taken}, 1).at("error");
  CHECK(error.at("code") == "invalid_input");
  CHECK_THAT(error.at("message").get<std::string>(), ContainsSubstring("Is a directory"));
  CHECK(files_in(directory) == 1);
}

TEST_CASE("pictures: a program that is missing or fails is named") {
  const ThesisDaemons d;
  const TemporaryDirectory directory;
  const TemporaryDirectory programs;
  const std::string file = directory.path() + "/a";
  const auto refused = [&](const Arguments& arguments) {
    const CliResult result = run_with_path(d, programs.path(), arguments);
    CHECK(result.status == 1);
    return result.err;
  };
  const Arguments plot{"plot", "world", "camera", "--out", file + ".png"};
  CHECK_THAT(refused(plot), ContainsSubstring("'rsvg-convert' of the package librsvg2-bin"));
  for (const char* ending : {".svg", ".png"}) {
    CHECK_THAT(refused({"graph", "--out", file + ending}),
               ContainsSubstring("'dot' of the package graphviz"));
  }
  CHECK(files_in(directory) == 0);
  const std::string broken = programs.write("dot", "#!/bin/sh\necho no fonts >&2\nexit 3\n");
  std::filesystem::permissions(broken, std::filesystem::perms::owner_all);
  CHECK_THAT(refused({"graph", "--out", file + ".svg"}),
             ContainsSubstring("'dot' failed: no fonts"));
  CHECK(files_in(directory) == 0);
  // These formats need no other program.
  CHECK(run_with_path(d, programs.path(), {"graph", "--out", file + ".dot"}).status == 0);
  CHECK(run_with_path(d, programs.path(), {"plot", "world", "camera", "--out", file + ".svg"})
            .status == 0);
  CHECK(files_in(directory) == 2);
}

TEST_CASE("pictures: an unreachable partition is grey and graph does not wait for it") {
  ThesisDaemons d;
  const TemporaryDirectory directory;
  const std::string file = directory.path() + "/a.dot";
  d.robot.kill();
  // Until the others know.
  REQUIRE(testing::eventually([&] {
    (void)d.domain.cli({"graph", "--out", file});
    return read(file).find("robot, not reachable") != std::string::npos;
  }));
  const std::string drawn = read(file);
  CHECK_THAT(drawn, ContainsSubstring("BGCOLOR=\"#eceef1\""));
  // Others know the frames of the partition that is lost.
  CHECK_THAT(drawn, ContainsSubstring("\"world\":out1:e -> \"robot_2\":in0:w [style=dashed]\n"));
  CHECK_THAT(drawn, ContainsSubstring("\"world\":out1:e -> \"arm_1\":in0:w\n"));
  CHECK_THAT(drawn, ContainsSubstring("↳ hand_left</TD>") && ContainsSubstring(">±2.53 mm"));
  const CliResult plot = d.domain.cli({"plot", "arm_1", "world", "--out", file + ".svg"});
  CHECK(plot.status == 3);
  CHECK(files_in(directory) == 1);
  d.arms->signal(SIGSTOP);
  const auto begin = testing::Clock::now();
  CHECK(d.domain.cli({"graph", "--out", file}).status != 2);
  CHECK(testing::Clock::now() - begin < std::chrono::seconds(20));
  d.arms->kill();
  const CliResult nobody = d.domain.cli({"graph", "--out", file});
  CHECK(nobody.status == 3);
  CHECK_THAT(nobody.err, ContainsSubstring("no partition answers"));
}

}  // namespace tfdude
