#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/client/client.hpp"

#include "../../rendering/angles.hpp"
#include "graph_layout.hpp"

// Draws the whole forest: from its data to text for Graphviz.
namespace tfdude::cli {

/// The edge from a frame's parent to the frame, as far as it is known.
struct EdgeLabel {
  std::optional<StatedCovariance> covariance;
  std::optional<std::chrono::nanoseconds> age;  ///< of its newest sample
  std::string joint{};                          ///< that moves it; empty: none
};

struct Graph {
  std::vector<Frame> frames;
  std::vector<PartitionInfo> partitions;
  std::map<std::string, EdgeLabel> edges;  ///< by the child's id
  AngleUnit angles = kRadian;
};

/// The label of an edge: the joint that moves it, the age of its newest sample, and its largest
/// standard deviations of position, if at least a millimetre, and of rotation, if at least a tenth
/// of a degree; "±?" if they are unspecified.
[[nodiscard]] std::string edge_text(const EdgeLabel& edge, const AngleUnit& angles);

/// A name in quotes, as DOT reads it.
[[nodiscard]] std::string dot_id(std::string_view id);
/// As dot_id(), for a label: there DOT interprets entities and escapes.
[[nodiscard]] std::string dot_label(std::string_view text);

/// The picture in DOT; equal graphs give equal text.
[[nodiscard]] std::string draw_graph(const Graph& graph, const GraphScope& scope = {});

}  // namespace tfdude::cli
