#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <map>
#include <system_error>
#include <unistd.h>

#include "tfdude/base/id.hpp"

#include "commands.hpp"
#include "graph.hpp"
#include "plot.hpp"
#include "program.hpp"
#include "svg.hpp"
#include "time_render.hpp"

// Commands that draw.
namespace tfdude::cli {
namespace {

std::string reason() { return std::generic_category().message(errno); }

// Writes under another name and renames, so that the file is complete or does not change.
Result<void> write_file(const std::string& file, const std::string& bytes) {
  const std::string beside = file + "." + std::to_string(getpid()) + ".tmp";
  const auto failed = [&] {
    return fail(Errc::kInvalidInput, "cannot write " + quote(file) + ": " + reason());
  };
  const Descriptor out(open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (out.get() < 0) return failed();
  if (out.write_all(bytes) && rename(beside.c_str(), file.c_str()) == 0) return {};
  const auto error = failed();
  unlink(beside.c_str());
  return error;
}

bool ends_with(const std::string& text, std::string_view end) {
  return text.size() > end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// Writes the picture to its file, and prints the answer.
int finish(Source source, const Arguments& arguments, const Result<std::string>& picture,
           nlohmann::json json) {
  if (!picture) return refuse(source, picture.error(), arguments);
  const auto written = write_file(arguments.out, *picture);
  if (!written) return refuse(source, written.error(), arguments);
  json["file"] = arguments.out;
  return answer(arguments, json, "wrote " + printable(arguments.out) + "\n");
}

// The frames from a frame up to its root, both included.
std::vector<const Frame*> ancestors(const std::map<std::string, const Frame*>& frames,
                                    const std::string& id) {
  std::vector<const Frame*> way;
  for (auto found = frames.find(id); found != frames.end();
       found = frames.find(found->second->parent)) {
    way.push_back(found->second);
    if (!found->second->attached) break;
  }
  return way;
}

// The frames from A to B and the edges between them, each looked up at the stamp of X_AB.
Result<Plot> plot_of(Source source, const Arguments& arguments, const StampedTransform& X_AB) {
  const auto all = source.frames();
  if (!all) return tl::unexpected(all.error());
  std::map<std::string, const Frame*> by_id;
  for (const Frame& frame : *all) by_id.emplace(frame.id, &frame);
  auto up = ancestors(by_id, arguments.id);
  auto down = ancestors(by_id, arguments.other);
  if (up.empty() || down.empty() || up.back() != down.back()) {
    return fail(Errc::kNotOwner, "the frames between " + quote(arguments.id) + " and " +
                                     quote(arguments.other) + " change too often to be drawn");
  }
  while (up.size() > 1 && down.size() > 1 && up[up.size() - 2] == down[down.size() - 2]) {
    up.pop_back();
    down.pop_back();
  }
  // Now the common ancestor is the last of both lists; it is kept in one.
  down.pop_back();
  std::reverse(down.begin(), down.end());
  Plot plot{X_AB, {}, {}, arguments.samples, arguments.angles};
  Query query;
  query.at = X_AB.stamp;
  const auto add = [&](const Frame& child, bool upwards) -> Result<void> {
    const auto X_PC = source.lookup(child.parent, child.id, query);
    if (!X_PC) return tl::unexpected(X_PC.error());
    plot.steps.push_back({{X_PC->pose, X_PC->covariance}, upwards});
    return {};
  };
  for (std::size_t i = 0; i < up.size(); ++i) {
    plot.frames.push_back(up[i]->id);
    if (i + 1 == up.size()) break;
    if (const auto added = add(*up[i], true); !added) return tl::unexpected(added.error());
  }
  for (const Frame* frame : down) {
    plot.frames.push_back(frame->id);
    if (const auto added = add(*frame, false); !added) return tl::unexpected(added.error());
  }
  return plot;
}

// Collects the frames, and the edges of partitions that answer. A partition that does not answer is
// not asked again, and is drawn as unreachable.
Result<Graph> graph_of(Source source, const Arguments& arguments) {
  auto frames = source.frames();
  if (!frames) return tl::unexpected(std::move(frames.error()));
  auto partitions = source.partitions();
  if (!partitions) return tl::unexpected(std::move(partitions.error()));
  Graph graph{*std::move(frames), *std::move(partitions), {}, arguments.angles};
  std::map<std::string, PartitionInfo*> by_name;
  for (PartitionInfo& partition : graph.partitions) {
    by_name[partition.name] = &partition;
    if (!partition.reachable) continue;
    const auto histories = source.histories(partition.name);
    partition.reachable = histories.has_value();
    if (!histories) continue;
    const auto now = present(source, arguments, partition);
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

}  // namespace

int run_plot(Source source, const Arguments& arguments) {
  Query query;
  const auto at = optional_stamp(source, arguments.stamp);
  if (!at) return report(at.error(), arguments);
  query.at = *at;
  const auto X_AB = source.lookup(arguments.id, arguments.other, query);
  if (!X_AB) return refuse(source, X_AB.error(), arguments);
  const auto plot = plot_of(source, arguments, *X_AB);
  if (!plot) return refuse(source, plot.error(), arguments);
  nlohmann::json json{{"from", arguments.id}, {"to", arguments.other}, {"frames", plot->frames}};
  if (plot->samples > 0) {
    json["samples"] = plot->samples;
    json["seed"] = kSampleSeed;
  }
  add_stamp(json, X_AB->stamp);
  Result<std::string> picture = draw_plot(*plot);
  if (ends_with(arguments.out, ".png")) {
    // Doubles the resolution, for screens with high density.
    picture =
        run_program({{"rsvg-convert", "--zoom", "2", "--unlimited"}, "librsvg2-bin"}, *picture);
  }
  return finish(source, arguments, picture, json);
}

int run_graph(Source source, const Arguments& arguments) {
  const auto drawn = graph_of(source, arguments);
  if (!drawn) return refuse(source, drawn.error(), arguments);
  const Graph& graph = *drawn;
  if (graph.partitions.empty()) {
    return refuse(source, {Errc::kUnknownPartition, "no partition"}, arguments);
  }
  nlohmann::json json{{"frames", graph.frames.size()}, {"partitions", graph.partitions.size()}};
  if (const std::string& root = arguments.id; !root.empty()) {
    const auto is_root = [&](const Frame& frame) { return frame.id == root; };
    if (std::none_of(graph.frames.begin(), graph.frames.end(), is_root)) {
      return refuse(source, {Errc::kUnknownFrame, "no frame " + quote(root)}, arguments);
    }
  }
  Result<std::string> picture = draw_graph(graph, {arguments.id, arguments.depth});
  if (ends_with(arguments.out, ".svg")) {
    picture = run_program({{"dot", "-Tsvg"}, "graphviz"}, *picture).map(xml_allowed);
  } else if (ends_with(arguments.out, ".png")) {
    picture = run_program({{"dot", "-Tpng", "-Gdpi=96"}, "graphviz"}, *picture);
  }
  return finish(source, arguments, picture, json);
}

}  // namespace tfdude::cli
