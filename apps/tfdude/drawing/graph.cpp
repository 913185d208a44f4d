#include "graph.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "../../rendering/format.hpp"
#include "plot_geometry.hpp"
#include "svg.hpp"

namespace tfdude::cli {
namespace {

constexpr double kNameSize = 9;    // [pt]
constexpr double kDetailSize = 8;  // [pt]
constexpr double kMostOfName = 150;
constexpr double kMostOfDetail = 165;

constexpr const char* kHead =
    "digraph frames {\n"
    "  graph [rankdir=LR, bgcolor=\"#ffffff\", nodesep=0.07, ranksep=0.3, pad=0.1,\n"
    "         fontname=\"Helvetica,Arial,sans-serif\", fontsize=9, fontcolor=\"#33414f\","
    " labelloc=b, labeljust=l]\n"
    "  node [shape=box, style=\"filled,rounded\", fontname=\"Helvetica,Arial,sans-serif\","
    " fontsize=9,\n"
    "        fontcolor=\"#1b2733\", height=0.2, margin=\"0.08,0.02\"]\n"
    "  edge [color=\"#7d8896\", arrowsize=0.5]\n";

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

// Shortens a long name, which would push the others apart.
std::string name_of(const std::string& id) { return elide(id, kNameSize, kMostOfName); }

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
  text +=
      R"(    <TR><TD COLSPAN="2" ALIGN="LEFT">↳ child of the frame above it, • without children)"
      R"(<BR ALIGN="LEFT"/>beside them: joint, age of the newest sample, )"
      R"(± largest standard deviation<BR ALIGN="LEFT"/></TD></TR>)";
  return text + "\n  </TABLE>>\n";
}

Colours look_of(const Frame& frame, const Looks& looks) {
  const auto found = looks.find(frame.partition);
  return found != looks.end() ? found->second : grey();
}

std::string detail_of(const Graph& graph, const Frame& frame) {
  const auto edge = graph.edges.find(frame.id);
  return edge == graph.edges.end()
             ? ""
             : elide(edge_text(edge->second, graph.angles), kDetailSize, kMostOfDetail);
}

// As text in an HTML-like label. There DOT would replace a backslash and an N by the name of the
// node, and knows no escape for it. So a space without width comes between.
std::string html_text(const std::string& text) {
  std::string out;
  for (const char c : xml_escape(text)) {
    out += c;
    if (c == '\\') out += "\u200B";
  }
  return out;
}

GraphMeasures measures_of(const Graph& graph) {
  GraphMeasures measures;
  measures.row_height = 12.2;
  measures.row_width = [&graph](const Frame& frame) {
    return text_width(name_of(frame.id), kNameSize) +
           text_width(detail_of(graph, frame), kDetailSize) + 16;
  };
  measures.indent = text_width("  ", kNameSize);
  measures.between = 8;
  measures.columns = 24;
  return measures;
}

// A line of a box: the frame, and what is known of the edge to it.
std::string row_text(const Graph& graph, const GraphRow& row, std::size_t number,
                     const Colours& look) {
  std::string before;
  for (std::size_t level = 1; level < std::min(row.level, kMostIndents); ++level) {
    before += "&#160;&#160;";
  }
  if (row.place == GraphRow::Place::kNext) before += "↳ ";
  if (row.place == GraphRow::Place::kLeaf) before += "• ";
  const std::string cell = R"(<TD ALIGN="LEFT" BGCOLOR=")" + look.fill + R"(" PORT=")";
  std::string detail = html_text(detail_of(graph, *row.frame));
  if (!detail.empty()) {
    detail.insert(0, "<FONT POINT-SIZE=\"8\" COLOR=\"#5b6776\">");
    detail += "</FONT>";
  }
  const std::string at = std::to_string(number) + "\">";
  return "    <TR>" + cell + "in" + at + before + html_text(name_of(row.frame->id)) + "</TD>" +
         cell + "out" + at + detail + "</TD></TR>\n";
}

std::string box_text(const Graph& graph, const GraphBox& box, const Looks& looks) {
  const Frame& first = *box.rows.front().frame;
  std::string text =
      "  " + dot_id(first.id) + " [shape=plain, style=\"\", label=<\n" +
      R"(  <TABLE BORDER="1" CELLBORDER="0" CELLSPACING="0" CELLPADDING="1" COLOR=")" +
      look_of(first, looks).line + "\">\n";
  for (std::size_t i = 0; i < box.rows.size(); ++i) {
    text += row_text(graph, box.rows[i], i, look_of(*box.rows[i].frame, looks));
  }
  if (box.folded > 0) {
    text += R"(    <TR><TD ALIGN="LEFT" COLSPAN="2" BGCOLOR="#ffffff"><I>+ )" +
            std::to_string(box.folded) + (box.folded == 1 ? " frame" : " frames") +
            " below</I></TD></TR>\n";
  }
  return text + "  </TABLE>>]\n";
}

// From the row of a frame to the box that begins below it.
std::string arrow(const GraphBox& from, const GraphBox& to, bool dashed) {
  std::size_t row = 0;
  for (std::size_t i = 0; i < from.rows.size(); ++i) {
    if (from.rows[i].frame == &from.last()) row = i;
  }
  return "  " + dot_id(from.rows.front().frame->id) + ":out" + std::to_string(row) + ":e -> " +
         dot_id(to.rows.front().frame->id) + ":in0:w" + (dashed ? " [style=dashed]" : "") + "\n";
}

std::string missing_node(const std::string& id) {
  return "  " + dot_id(id) + " [label=" + dot_label(name_of(id)) +
         ", style=\"dashed,rounded\", color=\"#aeb4bc\", fontcolor=\"#7d8896\"]\n";
}

}  // namespace

std::string edge_text(const EdgeLabel& edge, const AngleUnit& angles) {
  constexpr double kMetres = 1e-3;
  constexpr double kTurn = 0.1 / kDegrees;
  std::string text = edge.joint;
  const auto add = [&text](const std::string& more) { text += (text.empty() ? "" : "  ") + more; };
  if (edge.age) add(age_text(*edge.age));
  if (!edge.covariance) return text;
  if (!edge.covariance->complete()) {
    add("±?");
    return text;
  }
  const auto s = edge.covariance->of_specified().stddev();
  const double metres = *std::max_element(s.begin(), s.begin() + 3);
  const double turn = *std::max_element(s.begin() + 3, s.end());
  // A value read from decimal text may be a little smaller, due to rounding.
  constexpr double kAlmost = 1 - 1e-9;
  if (metres >= kMetres * kAlmost) add("±" + length_text(metres));
  if (turn >= kTurn * kAlmost) add("±" + angle_text(turn, 2, angles));
  return text;
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

std::string draw_graph(const Graph& graph, const GraphScope& scope) {
  const Looks looks = looks_of(graph.partitions);
  std::set<std::string> reachable;
  for (const PartitionInfo& partition : graph.partitions) {
    if (partition.reachable) reachable.insert(partition.name);
  }
  const auto boxes = boxes_of(graph.frames, scope, measures_of(graph));
  std::string text = kHead + legend(graph.partitions, looks);
  std::string arrows;
  std::set<std::string> missing;
  for (const GraphBox& box : boxes) {
    const Frame& first = *box.rows.front().frame;
    text += box_text(graph, box, looks);
    if (box.above) {
      arrows += arrow(boxes[*box.above], box, reachable.count(first.partition) == 0);
    } else if (!first.attached && !first.parent.empty()) {
      missing.insert(first.parent);
      arrows += "  " + dot_id(first.parent) + " -> " + dot_id(first.id) + ":in0:w [style=dashed]\n";
    }
  }
  for (const std::string& parent : missing) text += missing_node(parent);
  return text + arrows + "}\n";
}

}  // namespace tfdude::cli
