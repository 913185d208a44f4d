#include "plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "tfdude/math/perturbation.hpp"

#include "../../rendering/format.hpp"
#include "../../rendering/text.hpp"
#include "plot_names.hpp"
#include "svg.hpp"

namespace tfdude::cli {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// The layout [px]. The width is that of a page, so that text is not scaled there.
constexpr double kWidth = 900;
constexpr double kLeft = 62;
constexpr double kRight = 14;
constexpr double kGap = 66;
constexpr double kPanel = (kWidth - kLeft - kRight - 2 * kGap) / 3;
constexpr double kHeader = 96;
constexpr double kRow = kPanel + 70;  // with the heading and the axes' names
constexpr double kFooter = 34;
constexpr double kLine = 18;
constexpr int kTicks = 6;

constexpr double kOuter = 3;  // standard deviations of the outer ellipse

constexpr const char* kStyle =
    "text { font-family: 'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', sans-serif;"
    " font-size: 11.5px; fill: #5b6776; }\n"
    ".page { fill: #ffffff; }\n"
    ".panel { fill: #f7f8fa; }\n"
    ".grid { stroke: #e3e7ec; stroke-width: 1; }\n"
    ".zero { stroke: #c3cad3; stroke-width: 1; }\n"
    ".edge { fill: none; stroke: #aeb7c2; stroke-width: 1; }\n"
    ".title { font-size: 20px; font-weight: bold; fill: #1b2733; }\n"
    ".value { font-size: 14px; fill: #1b2733; }\n"
    ".heading { font-size: 12.5px; font-weight: bold; fill: #33414f; }\n"
    ".middle { text-anchor: middle; }\n"
    ".end { text-anchor: end; }\n"
    ".zoom { fill: none; stroke: #7d8896; stroke-width: 1; stroke-dasharray: 3 3; }\n"
    ".chain { fill: none; stroke: #66727f; stroke-width: 1.4; stroke-linejoin: round; }\n"
    ".frame { fill: #ffffff; stroke: #46525e; stroke-width: 1.4; }\n"
    ".name { fill: #2d3945; stroke: #f7f8fa; stroke-width: 3; stroke-linejoin: round;"
    " paint-order: stroke; }\n"
    ".inner { fill: #2f6fb3; fill-opacity: 0.16; stroke: #2f6fb3; stroke-width: 1.6;"
    " stroke-linejoin: round; }\n"
    ".ring { fill: none; stroke: #1f5a99; stroke-width: 1.8; stroke-linejoin: round; }\n"
    ".outer { fill: none; stroke: #2f6fb3; stroke-width: 1.2; stroke-linejoin: round; }\n"
    ".mean { stroke: #123a66; stroke-width: 1.6; }\n"
    ".few, .some, .many { stroke: #d9822b; stroke-linecap: round; }\n"
    ".few { stroke-width: 3; stroke-opacity: 0.7; }\n"
    ".some { stroke-width: 2.2; stroke-opacity: 0.45; }\n"
    ".many { stroke-width: 1.6; stroke-opacity: 0.22; }\n";

constexpr const char* kAxes[] = {"x", "y", "z"};
struct Plane {
  int across;
  int up;
};
constexpr std::array<Plane, 3> kPlanes = {{{0, 1}, {0, 2}, {1, 2}}};

Vector2d seen_in(const Plane& plane, const Vector3d& p) { return {p[plane.across], p[plane.up]}; }

// All that is drawn, computed from the plot.
struct Scene {
  const Plot& plot;
  std::vector<Vector3d> chain;
  std::vector<Vector3d> points;  // relative to the mean
  Vector3d mean;
  Eigen::Matrix3d covariance;
  Vector3d center;  // of the panels in the upper row
  double reach;     // from the middle of a panel to its side, in the upper row [m]
  double spread;    // the same in the lower row [m]; 0 if nothing is uncertain
};

// A square region of a coordinate plane of A, and its place in the picture.
struct Panel {
  Box box;
  Plane plane;
  Vector2d center;
  double reach;

  [[nodiscard]] Point at(const Vector2d& p) const {
    const double scale = kPanel / (2 * reach);
    return {box.x + kPanel / 2 + (p.x() - center.x()) * scale,
            box.y + kPanel / 2 - (p.y() - center.y()) * scale};
  }
};

// The 99.7 % quantile of the points' distances: a few outliers would make all else small.
double reach_of(const std::vector<Vector3d>& points) {
  if (points.empty()) return 0;
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Vector3d& p : points) distances.push_back(p.cwiseAbs().maxCoeff());
  const auto most =
      distances.begin() + static_cast<std::ptrdiff_t>(997 * (points.size() - 1) / 1000);
  std::nth_element(distances.begin(), most, distances.end());
  return *most;
}

Scene scene_of(const Plot& plot) {
  Scene scene{plot, chain_of(plot.steps), {}, plot.X_AB.pose.translation(), {}, {}, 0, 0};
  scene.covariance = ros_covariance(plot.X_AB).of_specified().matrix().topLeftCorner<3, 3>();
  const Vector3d outer = kOuter * scene.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  Vector3d low = scene.mean - outer;
  Vector3d high = scene.mean + outer;
  for (const Vector3d& p : scene.chain) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  scene.center = (low + high) / 2;
  scene.reach = 1.3 * (high - low).maxCoeff() / 2;
  if (!(scene.reach > 0)) scene.reach = 1.2;  // [m], arbitrary
  scene.points = sample_ends(plot.steps, plot.samples, kSampleSeed);
  for (Vector3d& p : scene.points) p -= scene.mean;
  scene.spread = std::max(1.2 * outer.maxCoeff(), 1.1 * reach_of(scene.points));
  if (scene.spread < 1e-12 * scene.reach) scene.spread = 0;  // a rounding error
  return scene;
}

// A coordinate with its deviation, with decimals down to a tenth of the deviation.
// @param least  the deviation is only that of some edges
std::string position_text(double metres, double stddev, const Unit& unit, bool least) {
  constexpr int kExactly = 4;
  const double tenth = 1 - std::log10(stddev / unit.metres);
  const int decimals = stddev > 0 ? std::clamp(static_cast<int>(std::ceil(tenth)), 0, 9) : kExactly;
  const std::string value = number_text(metres / unit.metres, decimals) + " " + unit.name + " ± ";
  if (stddev > 0) return value + (least ? "more than " : "") + length_text(stddev);
  return value + (least ? "?" : "0");
}

void draw_header(Svg& svg, const Scene& scene) {
  const Plot& plot = scene.plot;
  const std::string stamp =
      plot.X_AB.stamp ? to_string(*plot.X_AB.stamp) : "static: holds for all times";
  svg.text({kWidth - kRight, 34}, stamp, "end");
  const double room = kWidth - kLeft - kRight - text_width(stamp, kLabelSize) - 20;
  const double each = (room - text_width(" in ", 20)) / 2;
  const std::string& from = plot.frames.front();
  const std::string& to = plot.frames.back();
  // Each name has half of the room; what one does not need is left for the other.
  const double rest = std::max(each, 2 * each - text_width(from, 20));
  const std::string shown = elide(to, 20, rest);
  svg.text({kLeft, 34},
           shown + " in " + elide(from, 20, 2 * each - std::min(2 * each, text_width(shown, 20))),
           "title");
  const auto s = stddev_in_parent(plot.X_AB);
  const double largest = *std::max_element(s.begin(), s.begin() + 3);
  const Unit unit = text_unit_for(std::max(scene.mean.cwiseAbs().maxCoeff(), largest));
  const bool least = !plot.X_AB.covariance.complete();
  for (int axis = 0; axis < 3; ++axis) {
    svg.text({kLeft + axis * (kPanel + kGap), 60},
             kAxes[axis] + (" = " + position_text(scene.mean[axis],
                                                  s[static_cast<std::size_t>(axis)], unit, least)),
             "value");
  }
  svg.text({kLeft, 80},
           std::string("rotation ± ") + (least ? "more than " : "") +
               angle_text(s[3], 3, plot.angles) + ", " + angle_text(s[4], 3, plot.angles) + ", " +
               angle_text(s[5], 3, plot.angles) + " about the axes of " +
               elide(to, kLabelSize, 130) +
               "; ± is one standard deviation, of x, y and z along the "
               "axes of " +
               elide(from, kLabelSize, 130),
           "");
}

// Draws the background, the grid, and the numbers and names of the axes.
// @param prefix  precedes the names
void draw_axes(Svg& svg, const Panel& panel, const char* prefix) {
  svg.rect(panel.box, "panel");
  const Unit unit = unit_for(panel.reach);
  const double bottom = panel.box.bottom();
  double widest = 0;
  for (const int axis : {0, 1}) {
    const double low = (panel.center[axis] - panel.reach) / unit.metres;
    const double high = (panel.center[axis] + panel.reach) / unit.metres;
    const Ticks ticks = ticks_within(low, high, kTicks);
    for (const double value : ticks.values) {
      Vector2d p = panel.center;
      p[axis] = value * unit.metres;
      const Point at = panel.at(p);
      const char* look = value == 0 ? "zero" : "grid";
      const std::string label = tick_label(value, ticks.step);
      if (axis == 0) {
        svg.line({at.x, panel.box.y}, {at.x, bottom}, look);
        svg.text({at.x, bottom + 16}, label, "middle");
      } else {
        svg.line({panel.box.x, at.y}, {panel.box.right(), at.y}, look);
        svg.text({panel.box.x - 6, at.y + 4}, label, "end");
        widest = std::max(widest, text_width(label, kLabelSize));
      }
    }
  }
  const auto name = [&](int axis) {
    return prefix + std::string(kAxes[axis]) + " [" + unit.name + "]";
  };
  svg.text({panel.box.x + kPanel / 2, bottom + 33}, name(panel.plane.across), "middle");
  svg.text_up({panel.box.x - std::min(widest, 38.0) - 14, panel.box.y + kPanel / 2},
              name(panel.plane.up), "middle");
}

void draw_mean(Svg& svg, Point at) {
  constexpr double kArm = 5;
  svg.line({at.x - kArm, at.y}, {at.x + kArm, at.y}, "mean");
  svg.line({at.x, at.y - kArm}, {at.x, at.y + kArm}, "mean");
}

void draw_ellipses(Svg& svg, const Panel& panel, const Scene& scene, const Vector2d& mean,
                   bool hollow) {
  Eigen::Matrix2d covariance;
  const auto [across, up] = panel.plane;
  covariance << scene.covariance(across, across), scene.covariance(across, up),
      scene.covariance(up, across), scene.covariance(up, up);
  const Ellipse ellipse = ellipse_of(covariance);
  if (!(ellipse.major > 0)) return;
  for (const double deviations : {1.0, kOuter}) {
    std::vector<Point> outline;
    for (const Vector2d& p : outline_of(ellipse, deviations)) outline.push_back(panel.at(mean + p));
    svg.curve(outline, true, deviations > 1 ? "outer" : hollow ? "ring" : "inner");
  }
}

void draw_whole(Svg& svg, const Panel& panel, const Scene& scene) {
  draw_axes(svg, panel, "");
  const Vector2d mean = seen_in(panel.plane, scene.mean);
  double side = kPanel * scene.spread / scene.reach;
  if (side < 14 || side > 0.8 * kPanel) side = 0;  // too small to see, or most of the panel
  const Point at = panel.at(mean);
  if (side > 0) svg.rect({at.x - side / 2, at.y - side / 2, side, side}, "zoom");
  draw_ellipses(svg, panel, scene, mean, false);
  constexpr double kRadius = 4;
  std::vector<Point> path;
  std::vector<Dot> dots;
  for (const Vector3d& p : scene.chain) {
    path.push_back(panel.at(seen_in(panel.plane, p)));
    dots.push_back({path.back(), kRadius});
  }
  dots.back().radius = std::max(kRadius, side / 2);
  svg.curve(path, false, "chain");
  for (const Point& p : path) svg.circle(p, 2.6, "frame");
  draw_mean(svg, at);
  draw_names(svg, panel.box, scene.plot.frames, dots);
  svg.rect(panel.box, "edge");
}

// Spreads the points over several strokes: where translucent strokes overlap, the colour is darker,
// so dense regions stand out.
void draw_points(Svg& svg, const Panel& panel, const std::vector<Vector3d>& points) {
  constexpr std::size_t kStrokes = 12;
  const char* look = points.size() <= 500 ? "few" : points.size() <= 5000 ? "some" : "many";
  std::array<std::vector<Point>, kStrokes> strokes;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point at = panel.at(seen_in(panel.plane, points[i]));
    if (panel.box.contains({at.x, at.y, 0, 0})) strokes[i % kStrokes].push_back(at);
  }
  for (const auto& stroke : strokes) svg.dots(stroke, look);
}

void draw_zoomed(Svg& svg, const Panel& panel, const Scene& scene) {
  draw_axes(svg, panel, "Δ");
  draw_points(svg, panel, scene.points);
  draw_ellipses(svg, panel, scene, Vector2d::Zero(), !scene.points.empty());
  draw_mean(svg, panel.at(Vector2d::Zero()));
  svg.rect(panel.box, "edge");
}

void draw_legend(Svg& svg, const Scene& scene, double y) {
  double x = kLeft;
  const auto entry = [&](const std::string& text, auto draw) {
    draw(Point{x + 8, y - 4});
    svg.text({x + 22, y}, text, "");
    x += 22 + text_width(text, kLabelSize) + 14;
  };
  entry("mean", [&](Point at) { draw_mean(svg, at); });
  entry("frames of the path", [&](Point at) {
    svg.line({at.x - 9, at.y}, {at.x + 9, at.y}, "chain");
    svg.circle(at, 2.6, "frame");
  });
  if (scene.spread == 0) return;
  // The part of a Gaussian in two dimensions that lies within.
  entry("1σ: 39 %", [&](Point at) { svg.rect({at.x - 8, at.y - 5, 16, 10}, "inner"); });
  entry("3σ: 98.9 %", [&](Point at) { svg.rect({at.x - 8, at.y - 5, 16, 10}, "outer"); });
  if (scene.points.empty()) return;
  entry(format("%d points, seed %llu", scene.plot.samples,
               static_cast<unsigned long long>(kSampleSeed)),
        [&](Point at) {
          svg.dots({{at.x - 4, at.y + 2}, {at.x, at.y - 3}, {at.x + 4, at.y + 1}}, "few");
        });
}

void draw_row(Svg& svg, const Scene& scene, bool zoomed, double top) {
  svg.text({kLeft, top + 16},
           zoomed ? "about the mean, at the scale of its uncertainty" : "the whole path",
           "heading");
  double x = kLeft;
  for (const Plane& plane : kPlanes) {
    const Box box{x, top + 26, kPanel, kPanel};
    if (zoomed) {
      draw_zoomed(svg, {box, plane, Vector2d::Zero(), scene.spread}, scene);
    } else {
      draw_whole(svg, {box, plane, seen_in(plane, scene.center), scene.reach}, scene);
    }
    x += kPanel + kGap;
  }
}

// Notes on edges that are left out, or else that the points ignore correlation, if that makes a
// difference.
std::vector<std::string> notes_of(const Plot& plot) {
  const Basis& basis = plot.X_AB.basis;
  std::vector<std::string> notes;
  if (!plot.X_AB.covariance.complete()) {
    notes.push_back("± and ellipses are those of the other edges: " +
                    unspecified_text(basis.unspecified));
    if (!plot.assumed.empty()) notes.push_back(assumed_text(plot.assumed));
  } else if (plot.samples > 0 && (basis.bound || !basis.sources.empty())) {
    notes.push_back(
        std::string("The points take edges as independent; the ellipses do not, since ") +
        (basis.bound ? "the correlation of some is unknown." : "some share sources."));
  }
  return notes;
}

}  // namespace

std::string draw_plot(const Plot& plot) {
  const Scene scene = scene_of(plot);
  const bool zoomed = scene.spread > 0;
  const std::vector<std::string> notes = notes_of(plot);
  const double legend = kHeader + (zoomed ? 2 : 1) * kRow + 14;
  const double height = legend + kFooter - 14 + kLine * static_cast<double>(notes.size());
  Svg svg(kWidth, height, plot.frames.back() + " in " + plot.frames.front(), kStyle);
  svg.rect({0, 0, kWidth, height}, "page");
  draw_header(svg, scene);
  draw_row(svg, scene, false, kHeader);
  if (zoomed) draw_row(svg, scene, true, kHeader + kRow);
  draw_legend(svg, scene, legend);
  double line = legend;
  for (const std::string& note : notes) {
    svg.text({kLeft, line += kLine}, elide(note, kLabelSize, kWidth - kLeft - kRight), "");
  }
  return svg.finish();
}

}  // namespace tfdude::cli
