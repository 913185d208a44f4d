#include "../drawing/plot.hpp"

#include <algorithm>
#include <map>

#include "tfdude/base/id.hpp"

#include "../../rendering/json.hpp"
#include "../commands.hpp"
#include "../path.hpp"
#include "../picture.hpp"

namespace tfdude::cli {
namespace {

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
Result<Plot> plot_of(Source source, const Path& path, const StampedTransform& X_AB) {
  const auto all = source.frames();
  if (!all) return tl::unexpected(all.error());
  std::map<std::string, const Frame*> by_id;
  for (const Frame& frame : *all) by_id.emplace(frame.id, &frame);
  auto up = ancestors(by_id, path.a);
  auto down = ancestors(by_id, path.b);
  if (up.empty() || down.empty() || up.back() != down.back()) {
    return fail(Errc::kNotOwner, "the frames between " + quote(path.a) + " and " + quote(path.b) +
                                     " change too often to be drawn");
  }
  while (up.size() > 1 && down.size() > 1 && up[up.size() - 2] == down[down.size() - 2]) {
    up.pop_back();
    down.pop_back();
  }
  // Now the common ancestor is the last of both lists; it is kept in one.
  down.pop_back();
  std::reverse(down.begin(), down.end());
  Plot plot;
  plot.X_AB = X_AB;
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

struct PlotCommand final : Question {
  explicit PlotCommand(CLI::App& app) {
    path.add_ends(app);
    add_out(app, out, {".svg", ".png"});
    app.add_option("--samples", samples, "number of points to sample from the edges' errors")
        ->check(CLI::Range(1, 100000));
    add_instant(app, at);
    add_recording(app);
    explain_angles(app);
  }

  int ask_source(Source source, const Common& common) const override {
    Query query;
    const auto instant = optional_stamp(source, at);
    if (!instant) return report(instant.error(), common);
    query.at = *instant;
    const auto X_AB = source.lookup(path.a, path.b, query);
    if (!X_AB) return report_cause(source, X_AB.error(), common);
    auto plot = plot_of(source, path, *X_AB);
    if (!plot) return report_cause(source, plot.error(), common);
    plot->samples = samples;
    plot->angles = common.angles;
    plot->assumed = assumed_joints(source, path.a, path.b, X_AB->basis.unspecified);
    nlohmann::json json{{"from", path.a}, {"to", path.b}, {"frames", plot->frames}};
    if (!plot->assumed.empty()) json["unsampled_joints"] = plot->assumed;
    if (samples > 0) {
      json["samples"] = samples;
      json["seed"] = kSampleSeed;
    }
    add_stamp(json, X_AB->stamp);
    // Doubles the resolution, for screens with high density.
    return answer_picture(
        source, common, out, draw_plot(*plot),
        {{".png", {{"rsvg-convert", "--zoom", "2", "--unlimited"}, "librsvg2-bin"}}},
        std::move(json));
  }

  Path path;
  std::string out;
  int samples = 0;
};

}  // namespace

void add_plot(Commands& commands) {
  commands.add<PlotCommand>("plot", "draw where B is in A, with its uncertainty",
                            "plot world hand_left --out hand.svg --samples 2000");
}

}  // namespace tfdude::cli
