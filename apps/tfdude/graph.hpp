#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/client/client.hpp"

// The whole forest as a picture: what is known in, text for Graphviz out.
namespace tfdude::cli {

/// What is known of the edge from a frame's parent to the frame.
struct EdgeLabel {
  std::optional<Covariance> covariance;
  std::optional<Time> newest;  ///< of its samples
};

struct Graph {
  std::vector<Frame> frames;
  std::vector<PartitionInfo> partitions;
  std::map<std::string, EdgeLabel> edges;  ///< by the child's id
  Time now;
};

/// What stands beside an edge: the age of its newest sample, and its largest standard deviations from a millimetre or a tenth
/// of a degree on.
[[nodiscard]] std::string edge_text(const EdgeLabel& edge, Time now);

/// A name in quotes, as DOT reads it.
[[nodiscard]] std::string dot_id(std::string_view id);
/// The same of text that is shown, where DOT reads entities and escapes.
[[nodiscard]] std::string dot_label(std::string_view text);

/// The picture in DOT; the same for the same graph.
[[nodiscard]] std::string draw_graph(const Graph& graph);

}  // namespace tfdude::cli
