#include "graph.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "format.hpp"
#include "plot_geometry.hpp"
#include "svg.hpp"

namespace tfdude::cli {
namespace {

constexpr const char* kHead =
    "digraph frames {\n"
    "  graph [rankdir=LR, bgcolor=\"#ffffff\", nodesep=0.14, ranksep=0.45, pad=0.25,\n"
    "         fontname=\"Helvetica,Arial,sans-serif\", fontsize=11, fontcolor=\"#33414f\","
    " labelloc=b, labeljust=l]\n"
    "  node [shape=box, style=\"filled,rounded\", fontname=\"Helvetica,Arial,sans-serif\","
    " fontsize=12,\n"
    "        fontcolor=\"#1b2733\", height=0.32, margin=\"0.12,0.04\"]\n"
    "  edge [color=\"#7d8896\", arrowsize=0.6, fontname=\"Helvetica,Arial,sans-serif\","
    " fontsize=10,\n"
    "        fontcolor=\"#5b6776\"]\n";

struct Colours {
  std::string fill;
  std::string line;
};

Colours grey() { return {"#eceef1", "#aeb4bc"}; }

// The colour with this hue, saturation and value, each in [0, 1].
std::string colour(double hue, double saturation, double value) {
  const auto channel = [&](double shift) {
    const double k = std::fmod(shift + hue * 6, 6.0);
    const double part = std::clamp(std::min(k, 4 - k), 0.0, 1.0);
    return static_cast<int>(std::lround(255 * value * (1 - saturation * part)));
  };
  return format("#%02x%02x%02x", channel(5), channel(3), channel(1));
}

// The golden ratio keeps each hue far from all earlier ones, however many there are.
Colours colours_of(std::size_t index) {
  constexpr double kGolden = 0.381966011250105;
  const double hue = std::fmod(0.58 + kGolden * static_cast<double>(index), 1.0);
  return {colour(hue, 0.16, 0.98), colour(hue, 0.6, 0.66)};
}

// Shortens a long name, which would push the other nodes apart. Graphviz shows the full name when
// the pointer rests on it.
std::string name_of(const std::string& id) { return dot_label(elide(id, 12, 220)); }

// The colours of each partition; a partition that is not in the map is drawn as unreachable.
using Looks = std::map<std::string, Colours>;

Looks looks_of(const std::vector<PartitionInfo>& partitions) {
  Looks looks;
  for (std::size_t i = 0; i < partitions.size(); ++i) {
    looks[partitions[i].name] = partitions[i].reachable ? colours_of(i) : grey();
  }
  return looks;
}

std::string age_text(std::chrono::nanoseconds age) {
  const double seconds = static_cast<double>(age.count()) * 1e-9;
  const double size = std::abs(seconds);
  if (size < 1) return format("%.0f ms", seconds * 1e3);
  if (size < 100) return format("%.1f s", seconds);
  if (size < 6000) return format("%.0f min", seconds / 60);
  return size < 360000 ? format("%.0f h", seconds / 3600) : format("%.0f days", seconds / 86400);
}

std::string legend_row(const PartitionInfo& partition, const Colours& look) {
  std::string text = R"(<TR><TD BGCOLOR=")" + look.fill + R"(" COLOR=")" + look.line +
                     R"(" BORDER="1" WIDTH="22"></TD><TD ALIGN="LEFT">)" +
                     xml_escape(partition.name);
  // Only the name is known of a partition that was lost before this process started.
  if (!partition.host.empty()) {
    text += "  on " + xml_escape(partition.host) + ", pid " + std::to_string(partition.pid);
  }
  return text + (partition.reachable ? "" : ", not reachable") + "</TD></TR>";
}

std::string legend(const std::vector<PartitionInfo>& partitions, const Looks& looks) {
  if (partitions.empty()) return "";
  std::string text = R"(  label=<<TABLE BORDER="0" CELLBORDER="0" CELLSPACING="5">)";
  text += "\n";
  for (const PartitionInfo& partition : partitions) {
    text += "    " + legend_row(partition, looks.at(partition.name)) + "\n";
  }
  return text + "  </TABLE>>\n";
}

std::string node(const Frame& frame, const Looks& looks) {
  const auto found = looks.find(frame.partition);
  const Colours look = found != looks.end() ? found->second : grey();
  return "  " + dot_id(frame.id) + " [label=" + name_of(frame.id) + ", fillcolor=\"" + look.fill +
         "\", color=\"" + look.line + "\"]\n";
}

std::string missing_node(const std::string& id) {
  return "  " + dot_id(id) + " [label=" + name_of(id) +
         ", style=\"dashed,rounded\", color=\"#aeb4bc\", fontcolor=\"#7d8896\"]\n";
}

std::string arrow(const Frame& frame, const std::string& beside, bool dashed) {
  std::string look = beside.empty() ? "" : "label=" + dot_label(" " + beside + " ");
  if (dashed) look += std::string(look.empty() ? "" : ", ") + "style=dashed";
  if (!look.empty()) look = " [" + look + "]";
  return "  " + dot_id(frame.parent) + " -> " + dot_id(frame.id) + look + "\n";
}

}  // namespace

std::string edge_text(const EdgeLabel& edge) {
  constexpr double kMetres = 1e-3;
  constexpr double kTurn = 0.1;  // [°]
  std::string text = edge.age ? age_text(*edge.age) : "";
  if (!edge.covariance) return text;
  if (!edge.covariance->complete()) return text + (text.empty() ? "" : "  ") + "±?";
  const auto s = edge.covariance->of_specified().stddev();
  const double metres = *std::max_element(s.begin(), s.begin() + 3);
  const double turn = *std::max_element(s.begin() + 3, s.end()) * kDegrees;
  // A value read from decimal text may be a little smaller, due to rounding.
  constexpr double kAlmost = 1 - 1e-9;
  if (metres < kMetres * kAlmost && turn < kTurn * kAlmost) return text;
  return text + (text.empty() ? "" : "  ") + "±" + length_text(metres) + " " + "±" +
         angle_text(turn, 2) + "°";
}

std::string dot_id(std::string_view id) {
  std::string out = "\"";
  for (const char c : id) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

std::string dot_label(std::string_view text) { return dot_id(xml_escape(text)); }

std::string draw_graph(const Graph& graph) {
  const Looks looks = looks_of(graph.partitions);
  std::set<std::string> reachable;
  for (const PartitionInfo& partition : graph.partitions) {
    if (partition.reachable) reachable.insert(partition.name);
  }
  std::string text = kHead + legend(graph.partitions, looks);
  std::string arrows;
  std::set<std::string> missing;
  for (const Frame& frame : graph.frames) {
    text += node(frame, looks);
    if (frame.parent.empty()) continue;
    if (!frame.attached) missing.insert(frame.parent);
    const auto edge = graph.edges.find(frame.id);
    arrows += arrow(frame, edge != graph.edges.end() ? edge_text(edge->second) : "",
                    !frame.attached || reachable.count(frame.partition) == 0);
  }
  for (const std::string& parent : missing) text += missing_node(parent);
  return text + arrows + "}\n";
}

}  // namespace tfdude::cli
