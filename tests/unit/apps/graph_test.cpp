#include "tfdude/drawing/graph.hpp"

#include <algorithm>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "support/catch.hpp"

namespace tfdude::cli {
namespace {

using testing::ContainsSubstring;

constexpr double kTurn = 0.017453292519943295;  // a degree
const Time kNow = time_of(1'700'000'000'000'000'000);

PartitionInfo partition(const std::string& name, bool reachable) {
  PartitionInfo info;
  info.name = name;
  info.host = "tower";
  info.pid = 42;
  info.reachable = reachable;
  return info;
}

EdgeLabel label(double metres, double degrees) {
  return {*Covariance::from_stddev({0, metres, 0, 0, 0, degrees * kTurn}), std::nullopt};
}

Graph example() {
  Graph graph;
  graph.frames = {{"arm", "base", "arms", true},
                  {"base", "world", "robot", true},
                  {"lost", "gone", "robot", false},
                  {"world", "", "robot", false}};
  graph.partitions = {partition("arms", true), partition("robot", true)};
  graph.edges["arm"] = label(0.003, 0.4);
  graph.edges["arm"].age = std::chrono::milliseconds(12);
  return graph;
}

// The line that begins so, whole.
std::string line(const std::string& dot, const std::string& begin) {
  const auto at = dot.find("\n  " + begin);
  if (at == std::string::npos) return "";
  return dot.substr(at + 3, dot.find('\n', at + 1) - at - 3);
}

// The row of a frame in its box.
std::string row(const std::string& dot, const std::string& id) {
  const std::regex expected("    <TR>.*PORT=\"in[0-9]+\">[^<]*" + id + "</TD>.*</TR>\n");
  std::smatch found;
  return std::regex_search(dot, found, expected) ? found[0] : std::string();
}

std::string fill(const std::string& row) {
  std::smatch found;
  return std::regex_search(row, found, std::regex("BGCOLOR=\"(#[0-9a-f]{6})\"")) ? found[1]
                                                                                 : std::string();
}

TEST_CASE("the label of an edge has its age and its large deviations") {
  EdgeLabel edge = label(0.003, 0.4);
  CHECK(edge_text(edge, kDegree) == "±3 mm  ±0.4°");
  edge.age = std::chrono::milliseconds(12);
  CHECK(edge_text(edge, kDegree) == "12 ms  ±3 mm  ±0.4°");
  edge.joint = "elbow";
  CHECK(edge_text(edge, kDegree) == "elbow  12 ms  ±3 mm  ±0.4°");
  edge.joint.clear();
  CHECK(edge_text(label(0.001, 0), kDegree) == "±1 mm");
  CHECK(edge_text(label(0, 0.1), kDegree) == "±0.1°");
  CHECK(edge_text(label(0, 0.1), kRadian) == "±0.0017 rad");
  // The deviations of unmeasured joints.
  CHECK(edge_text(label(0, 103.923), kDegree) == "±104°");
  CHECK(edge_text(label(0, 99.7), kDegree) == "±100°");
  CHECK(edge_text(label(0.0009, 0.09), kDegree).empty());
  CHECK(edge_text(EdgeLabel{}, kDegree).empty());
  EdgeLabel unspecified{StatedCovariance::unspecified(), edge.age};
  CHECK(edge_text(unspecified, kDegree) == "12 ms  ±?");
  edge = label(0, 0);
  for (const auto& [seconds, text] : {std::pair(-0.5, "-500 ms"),
                                      {3.44, "3.4 s"},
                                      {600.0, "10 min"},
                                      {7200.0, "2 h"},
                                      {8.64e5, "10 days"}}) {
    edge.age = std::chrono::nanoseconds(static_cast<std::int64_t>(seconds * 1e9));
    CHECK(edge_text(edge, kDegree) == text);
  }
}

TEST_CASE("names are escaped for DOT") {
  CHECK(dot_id("a\"b\\c") == "\"a\\\"b\\\\c\"");
  CHECK(dot_id("<b>&amp;") == "\"<b>&amp;\"");
  // \N would be the node's name, &amp; an ampersand.
  CHECK(dot_label("\\N & <i>\"") == "\"\\\\N &amp; &lt;i&gt;&quot;\"");
}

TEST_CASE("a forest is drawn with its owners and edges and missing parents") {
  const std::string dot = draw_graph(example());
  CHECK(dot.rfind("digraph frames {\n", 0) == 0);
  // A chain is one box, whose rows have the edges to them.
  CHECK_THAT(row(dot, "arm"), ContainsSubstring(">12 ms  ±3 mm  ±0.007 rad</FONT>"));
  CHECK_THAT(row(dot, "base"), ContainsSubstring(">↳ base</TD>"));
  CHECK_THAT(row(dot, "arm"), ContainsSubstring(">&#160;&#160;↳ arm</TD>"));
  CHECK(line(dot, "\"world\" -> ").empty());
  CHECK(line(dot, "\"gone\" -> ") == "\"gone\" -> \"lost\":in0:w [style=dashed]");
  CHECK_THAT(line(dot, "\"gone\" ["), ContainsSubstring("dashed"));
  CHECK_THAT(dot, ContainsSubstring("arms  on tower, pid 42") && !ContainsSubstring("reachable"));
  const std::string arm = fill(row(dot, "arm"));
  CHECK(arm.size() == 7);
  CHECK(arm != fill(row(dot, "base")));
  CHECK(fill(row(dot, "world")) == fill(row(dot, "base")));
  CHECK_THAT(dot, ContainsSubstring("<TR><TD BGCOLOR=\"" + arm + "\""));
}

TEST_CASE("children are indented below their parents, and a legend says what the signs mean") {
  Graph graph;
  graph.frames = {{"base", "odom", "robot", true},  {"cup", "map", "robot", true},
                  {"hand", "base", "robot", true},  {"lidar", "base", "robot", true},
                  {"map", "", "robot", false},      {"odom", "map", "robot", true},
                  {"finger", "hand", "robot", true}};
  graph.partitions = {partition("robot", true)};
  const std::string dot = draw_graph(graph);
  const auto begins = [&](const std::string& id, const std::string& text) {
    INFO(row(dot, id));
    CHECK_THAT(row(dot, id), ContainsSubstring("\">" + text + id + "</TD>"));
  };
  begins("map", "");
  begins("cup", "• ");
  begins("odom", "↳ ");
  begins("base", "&#160;&#160;↳ ");
  begins("lidar", "&#160;&#160;&#160;&#160;• ");
  begins("hand", "&#160;&#160;&#160;&#160;↳ ");
  CHECK_THAT(dot, ContainsSubstring("↳ child of the frame above it") &&
                      ContainsSubstring("± largest standard deviation"));
}

TEST_CASE("an unreachable partition is grey and its arrows are dashed") {
  Graph graph = example();
  graph.frames.insert(graph.frames.begin(), {{"leg", "base", "robot", true},
                                             {"foot", "leg", "robot", true},
                                             {"hand", "arm", "arms", true}});
  const std::string before = draw_graph(graph);
  CHECK(line(before, "\"world\":out1:e -> \"arm\"") == "\"world\":out1:e -> \"arm\":in0:w");
  graph.partitions[0].reachable = false;
  graph.edges.clear();
  const std::string dot = draw_graph(graph);
  CHECK(fill(row(dot, "arm")) == "#eceef1");
  CHECK(line(dot, "\"world\":out1:e -> \"arm\"") ==
        "\"world\":out1:e -> \"arm\":in0:w [style=dashed]");
  CHECK(line(dot, "\"world\":out1:e -> \"leg\"") == "\"world\":out1:e -> \"leg\":in0:w");
  CHECK_THAT(dot, ContainsSubstring("arms  on tower, pid 42, not reachable"));
  // The others keep their colours.
  CHECK(fill(row(dot, "base")) == fill(row(before, "base")));
  graph.partitions.erase(graph.partitions.begin());
  CHECK(fill(row(draw_graph(graph), "arm")) == "#eceef1");
}

TEST_CASE("each partition has its own colour") {
  Graph graph;
  for (int i = 0; i < 40; ++i) {
    const std::string name = "p" + std::to_string(i);
    graph.partitions.push_back(partition(name, true));
    graph.frames.push_back({"f" + std::to_string(i), "", name, false});
  }
  const std::string dot = draw_graph(graph);
  std::set<std::string> colours;
  for (const Frame& frame : graph.frames) colours.insert(fill(row(dot, frame.id)));
  CHECK(colours.size() == 40);
  CHECK(colours.count("") == 0);
}

TEST_CASE("an empty forest is drawn") {
  CHECK_THAT(draw_graph({}), !ContainsSubstring("label=<") && ContainsSubstring("}\n"));
}

TEST_CASE("a long name is shortened only in the picture") {
  Graph graph;
  graph.frames = {{std::string(255, 'w'), "", "p", false}};
  const std::string dot = draw_graph(graph);
  const std::string shown = row(dot, "w");
  CHECK_THAT(shown, ContainsSubstring("…"));
  CHECK(std::count(shown.begin(), shown.end(), 'w') < 30);
  CHECK(line(dot, "\"w").rfind("\"" + std::string(255, 'w') + "\" [", 0) == 0);
}

}  // namespace
}  // namespace tfdude::cli
