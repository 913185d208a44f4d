#include "tree.hpp"

#include <algorithm>
#include <map>

#include "../../rendering/screen.hpp"
#include "../../rendering/terminal.hpp"
#include "../commands.hpp"
#include "../structure.hpp"

namespace tfdude::cli {
namespace {

// A frame to draw, and the prefixes of its line and of its children's lines.
struct Line {
  const Frame* frame;
  std::string before;
  std::string before_children;
};

std::string label(const Frame& frame, const std::vector<std::string>& unreachable) {
  const bool lost = std::count(unreachable.begin(), unreachable.end(), frame.partition) > 0;
  std::string text = frame.id + "  " +
                     (lost ? painted(Look::kBad, "[" + frame.partition + ", unreachable]")
                           : painted_by_name(frame.partition, "[" + frame.partition + "]"));
  if (!frame.parent.empty() && !frame.attached) {
    text += painted(Look::kWarning, "  (waits for '" + frame.parent + "')");
  }
  return text + "\n";
}

}  // namespace

std::string draw_tree(const std::vector<Frame>& frames,
                      const std::vector<std::string>& unreachable) {
  std::map<std::string, std::vector<const Frame*>> children;
  std::vector<Line> to_draw;  // a stack: the next frame is the last one
  for (const Frame& frame : frames) {
    if (frame.attached) {
      children[frame.parent].push_back(&frame);
    } else {
      to_draw.push_back({&frame, "", ""});
    }
  }
  std::reverse(to_draw.begin(), to_draw.end());
  std::string text;
  while (!to_draw.empty()) {
    const Line line = std::move(to_draw.back());
    to_draw.pop_back();
    text += line.before + label(*line.frame, unreachable);
    const auto found = children.find(line.frame->id);
    if (found == children.end()) continue;
    const auto& below = found->second;
    for (auto child = below.rbegin(); child != below.rend(); ++child) {
      const bool last = child == below.rbegin();
      to_draw.push_back({*child, line.before_children + (last ? "└─ " : "├─ "),
                         line.before_children + (last ? "   " : "│  ")});
    }
  }
  return text;
}

namespace {

struct Tree final : Question {
  explicit Tree(CLI::App& app) {
    add_recording(app);
    add_watch(app, *this, watch)->excludes(app.get_option("--recording"));
  }

  int ask_source(Source source, const Common& common) const override {
    const auto all = Structure::of(source);
    if (!all) return report(all.error(), common);
    const int status = check_partitions(source, common, !all->frames.empty());
    if (status != kDone) return status;
    return all->print(common, draw_tree(all->frames, all->absent_names()));
  }

  int ask(Client& client, const Common& common) const override {
    if (!watch) return ask_source(client, common);
    Screen screen;
    do {
      const auto all = Structure::of(client);
      if (!all) return report(all.error(), common);
      const std::string tree = draw_tree(all->frames, all->absent_names());
      if (common.json) {
        (void)all->print(common, tree);
      } else {
        screen.redraw(tree.empty() ? nobody_answers(common) + "\n" : tree + all->warnings());
      }
    } while (!interrupted_within(1.0 / kRedrawRate));
    return kDone;
  }

  bool watch = false;
};

}  // namespace

void add_tree(Commands& commands) {
  commands.add<Tree>("tree", "draw all frames with their owners", "tree");
}

}  // namespace tfdude::cli
