#include "../drawing/graph.hpp"

#include <algorithm>
#include <map>

#include "tfdude/base/id.hpp"

#include "../commands.hpp"
#include "../picture.hpp"

namespace tfdude::cli {
namespace {

// Collects the frames, and the edges of partitions that answer. A partition that does not answer is
// not asked again, and is drawn as unreachable.
Result<Graph> graph_of(Source source, const Common& common) {
  auto frames = source.frames();
  if (!frames) return tl::unexpected(std::move(frames.error()));
  auto partitions = source.partitions();
  if (!partitions) return tl::unexpected(std::move(partitions.error()));
  Graph graph{*std::move(frames), *std::move(partitions), {}, common.angles};
  std::map<std::string, PartitionInfo*> by_name;
  for (PartitionInfo& partition : graph.partitions) {
    by_name[partition.name] = &partition;
    if (!partition.reachable) continue;
    const auto histories = source.histories(partition.name);
    partition.reachable = histories.has_value();
    if (!histories) continue;
    const auto now = present(source, common, partition);
    for (const HistoryInfo& history : *histories) {
      if (now && history.newest) graph.edges[history.id].age = *now - *history.newest;
    }
    const auto joints = source.joints(partition.name);
    for (const JointInfo& joint : joints.value_or(std::vector<JointInfo>())) {
      graph.edges[joint.frame].joint = joint.name;
    }
  }
  std::map<std::string, PartitionInfo*> owners;  // by frame
  for (const Frame& frame : graph.frames) {
    const auto owner = by_name.find(frame.partition);
    if (owner != by_name.end()) owners[frame.id] = owner->second;
  }
  for (const Frame& frame : graph.frames) {
    const auto owner = by_name.find(frame.partition);
    if (!frame.attached || owner == by_name.end() || !owner->second->reachable) continue;
    const auto X_PC = source.lookup(frame.parent, frame.id);
    if (X_PC) {
      graph.edges[frame.id].covariance = X_PC->covariance;
    } else if (X_PC.error().code == Errc::kTimeout || X_PC.error().code == Errc::kUnreachable) {
      // The parent may be the frame that cannot be looked up.
      const auto above = owners.find(frame.parent);
      const bool by_owner = above == owners.end() || above->second->reachable;
      if (by_owner) owner->second->reachable = false;
    }
  }
  return graph;
}

struct GraphCommand final : Question {
  explicit GraphCommand(CLI::App& app) {
    add_out(app, out, {".svg", ".png", ".dot"});
    app.add_option("--root", scope.root, "draw this frame and all below it");
    app.add_option("--depth", scope.depth, "levels below a root; default: as many as fit a screen");
    add_recording(app);
    explain_angles(app);
  }

  int ask_source(Source source, const Common& common) const override {
    const auto drawn = graph_of(source, common);
    if (!drawn) return report_cause(source, drawn.error(), common);
    const Graph& graph = *drawn;
    if (graph.partitions.empty()) {
      return report_cause(source, {Errc::kUnknownPartition, "no partition"}, common);
    }
    const auto is_root = [&](const Frame& frame) { return frame.id == scope.root; };
    if (!scope.root.empty() && std::none_of(graph.frames.begin(), graph.frames.end(), is_root)) {
      return report_cause(source, {Errc::kUnknownFrame, "no frame " + quote(scope.root)}, common);
    }
    return answer_picture(
        source, common, out, draw_graph(graph, scope),
        {{".svg", {{"dot", "-Tsvg"}, "graphviz"}},
         {".png", {{"dot", "-Tpng", "-Gdpi=96"}, "graphviz"}}},
        {{"frames", graph.frames.size()}, {"partitions", graph.partitions.size()}});
  }

  std::string out;
  GraphScope scope;
};

}  // namespace

void add_graph(Commands& commands) {
  commands.add<GraphCommand>("graph", "draw all frames with their owners, ages, deviations",
                             "graph --out frames.svg");
}

}  // namespace tfdude::cli
