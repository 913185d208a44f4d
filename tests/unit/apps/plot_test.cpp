#include "tfdude/drawing/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace tfdude::cli {
namespace {

using Eigen::Vector2d;
using testing::Approx;
using testing::ContainsSubstring;
using testing::Random;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

// A path of frames a0, a1 ... and what a lookup along it answers.
Plot plot_of(const std::vector<Step>& steps) {
  Plot plot;
  plot.steps = steps;
  plot.frames.push_back("a0");
  Transform X = Transform::exact({});
  for (const Step& step : steps) {
    X = compose(X, step.up ? inverse(step.X_PC) : step.X_PC);
    plot.frames.push_back("a" + std::to_string(plot.frames.size()));
  }
  plot.X_AB = {X, std::nullopt, {}};
  return plot;
}

struct Rect {
  double left, top, right, bottom;

  [[nodiscard]] bool contains(double x, double y) const {
    return x >= left && x <= right && y >= top && y <= bottom;
  }
};

std::vector<Rect> panels_of(const std::string& svg) {
  const std::regex rect("class=\"panel\" x=\"(.*?)\" y=\"(.*?)\" width=\"(.*?)\" height=\"(.*?)\"");
  std::vector<Rect> panels;
  for (std::sregex_iterator it(svg.begin(), svg.end(), rect), end; it != end; ++it) {
    const double x = std::stod((*it)[1]);
    const double y = std::stod((*it)[2]);
    panels.push_back({x, y, x + std::stod((*it)[3]), y + std::stod((*it)[4])});
  }
  return panels;
}

Transform at(double x, double y, double z, const std::array<double, 6>& stddev = {}) {
  return {*Pose::create(Eigen::Quaterniond::Identity(), {x, y, z}),
          *Covariance::from_stddev(stddev)};
}

TEST_CASE("a plot shows the path in three panels and its end magnified") {
  const std::string svg =
      draw_plot(plot_of({{at(1, 0, 0, {0.01, 0.02, 0, 0, 0, 0}), false}, {at(1, 1, 0), false}}));
  CHECK(count(svg, "class=\"panel\"") == 6);
  CHECK(count(svg, "class=\"inner\"") == 7);  // one in the legend
  CHECK(count(svg, "class=\"frame\"") == 10);
  CHECK_THAT(svg, ContainsSubstring(">a2 in a0</text>"));
  CHECK_THAT(svg, ContainsSubstring("x = 2.000 m ± 10 mm"));
  CHECK_THAT(svg, ContainsSubstring("y = 1.000 m ± 20 mm"));
  CHECK_THAT(svg, ContainsSubstring("z = 0.0000 m ± 0<"));
  CHECK_THAT(svg, ContainsSubstring("Δx [") && ContainsSubstring(">x [m]<"));
  CHECK_THAT(svg, ContainsSubstring("static: holds for all times"));
  CHECK_THAT(svg, !ContainsSubstring("points"));
}

TEST_CASE("each panel shows its plane of A upright and to the same scale") {
  const std::string svg = draw_plot(plot_of({{at(1, 2, 4), false}}));
  const std::regex circle("class=\"frame\" cx=\"(.*?)\" cy=\"(.*?)\"");
  std::vector<Vector2d> dots;
  for (std::sregex_iterator it(svg.begin(), svg.end(), circle), end; it != end; ++it) {
    dots.emplace_back(std::stod((*it)[1]), std::stod((*it)[2]));
  }
  const auto panels = panels_of(svg);
  REQUIRE(panels.size() == 3);
  REQUIRE(dots.size() == 7);  // one in the legend
  // Four metres and the margins on either side of them.
  const double scale = (panels[0].right - panels[0].left) / (4 * 1.3);
  const Vector2d moves[] = {{1, -2}, {1, -4}, {2, -4}};
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK((dots[2 * i + 1] - dots[2 * i] - scale * moves[i]).norm() < 0.05);
    const Vector2d middle = (dots[2 * i] + dots[2 * i + 1]) / 2;
    CHECK(middle.x() == Approx((panels[i].left + panels[i].right) / 2).margin(0.05));
    CHECK(middle.y() == Approx((panels[i].top + panels[i].bottom) / 2).margin(0.05));
  }
}

TEST_CASE("deviations are along the axes of A although errors are along those of B") {
  Transform X = at(0, 0, 0, {0.01, 0.03, 0.002, 0, 0, 0});
  X.pose = *Pose::create(from_rpy(0, 0, 1.5707963267948966), {2, 1, 0.5});
  const std::string svg = draw_plot(plot_of({{X, false}}));
  CHECK_THAT(svg, ContainsSubstring("x = 2.000 m ± 30 mm"));
  CHECK_THAT(svg, ContainsSubstring("y = 1.000 m ± 10 mm"));
  CHECK_THAT(svg, ContainsSubstring("z = 0.5000 m ± 2 mm"));
  // The outline of three deviations in the lower xy panel: as wide as it is high, three times.
  const std::regex outer("class=\"outer\" d=\"([^\"]*)\"");
  std::vector<std::string> outlines;
  for (std::sregex_iterator it(svg.begin(), svg.end(), outer), end; it != end; ++it) {
    outlines.push_back((*it)[1]);
  }
  REQUIRE(outlines.size() == 6);
  const std::regex pair("[ML](-?[0-9.]+) (-?[0-9.]+)");
  Vector2d low(1e9, 1e9);
  Vector2d high(-1e9, -1e9);
  for (std::sregex_iterator it(outlines[3].begin(), outlines[3].end(), pair), end; it != end;
       ++it) {
    const Vector2d p(std::stod((*it)[1]), std::stod((*it)[2]));
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  CHECK((high - low).x() == Approx(3 * (high - low).y()).epsilon(0.01));
  const Rect panel = panels_of(svg).at(3);
  CHECK((high - low).x() == Approx((panel.right - panel.left) / 1.2).epsilon(0.01));
}

TEST_CASE("points beyond a panel are not drawn") {
  Plot plot = plot_of({{at(1, 0, 0, {0.01, 0.01, 0.01, 0, 0, 0}), false}});
  plot.samples = 20000;
  const std::string svg = draw_plot(plot);
  const auto panels = panels_of(svg);
  const std::regex dot("M([0-9.-]+) ([0-9.-]+)h0");
  int dots = 0;
  int outside = 0;
  for (std::sregex_iterator it(svg.begin(), svg.end(), dot), end; it != end; ++it, ++dots) {
    const double x = std::stod((*it)[1]);
    const double y = std::stod((*it)[2]);
    const bool within = std::any_of(panels.begin(), panels.end(),
                                    [&](const Rect& panel) { return panel.contains(x, y); });
    outside += within ? 0 : 1;
  }
  CHECK(outside == 3);  // those of the legend
  CHECK(dots > 3 * 19900);
  CHECK(dots < 3 * 20000);
}

TEST_CASE("nothing is magnified if nothing is uncertain") {
  for (const auto& steps : {std::vector<Step>{}, {{at(1, 2, 3), false}}}) {
    Plot plot = plot_of(steps);
    plot.samples = 10;
    const std::string svg = draw_plot(plot);
    CHECK(count(svg, "class=\"panel\"") == 3);
    CHECK_THAT(svg, !ContainsSubstring("Δ") && !ContainsSubstring("class=\"inner\"") &&
                        !ContainsSubstring("nan"));
  }
}

TEST_CASE("a plot has its stamp and says which correlation its points ignore") {
  Plot plot = plot_of({{at(1, 0, 0, {0.01, 0.01, 0.01, 0, 0, 0}), false}});
  plot.X_AB.stamp = time_of(1'700'000'000'250'000'000);
  plot.X_AB.basis.bound = true;
  CHECK_THAT(draw_plot(plot),
             ContainsSubstring("2023-11-14 22:13:20.250 UTC") && !ContainsSubstring("independent"));
  plot.samples = 40;
  CHECK_THAT(draw_plot(plot), ContainsSubstring("independent") && ContainsSubstring("unknown") &&
                                  ContainsSubstring("40 points, seed 1"));
  plot.X_AB.basis = {Order::kSecond, false, {"calibration"}};
  CHECK_THAT(draw_plot(plot), ContainsSubstring("some share sources"));
  plot.X_AB.basis = {};
  CHECK_THAT(draw_plot(plot), !ContainsSubstring("independent"));
}

TEST_CASE("a plot says which edges have no uncertainty") {
  Plot plot = plot_of({{at(1, 0, 0, {0.01, 0.01, 0.01, 0, 0, 0}), false}});
  plot.X_AB.covariance.set_complete(false);
  plot.X_AB.basis.unspecified = {"odom"};
  CHECK_THAT(draw_plot(plot), ContainsSubstring("the other edges: unspecified for odom") &&
                                  ContainsSubstring("± more than 10 mm"));
  plot = plot_of({{at(1, 0, 0), false}});
  plot.X_AB.covariance = StatedCovariance::unspecified();
  plot.X_AB.basis.unspecified = {"odom"};
  CHECK_THAT(draw_plot(plot), ContainsSubstring("± ?") && !ContainsSubstring("± 0"));
}

TEST_CASE("names are escaped and shortened") {
  Plot plot = plot_of({{at(1, 0, 0, {0.01, 0.01, 0.01, 0, 0, 0}), false}});
  plot.frames = {"<A&\"B\">", std::string(255, 'w')};
  const std::string svg = draw_plot(plot);
  CHECK_THAT(svg, !ContainsSubstring("<A&") && ContainsSubstring("&lt;A&amp;&quot;B&quot;&gt;"));
  // The full name is only where it is not drawn.
  CHECK(count(svg, std::string(255, 'w')) == 1);
}

TEST_CASE("nothing is drawn beyond the page at any scale") {
  Random random(36);
  INFO("seed " << random.seed());
  const std::regex pair("[ML](-?[0-9.]+) (-?[0-9.]+)");
  for (int i = 0; i < 40; ++i) {
    std::vector<Step> steps;
    const double size = std::pow(10.0, random.uniform(-7, 7));
    const double doubt = size * std::pow(10.0, random.uniform(-6, 1));
    for (std::size_t k = random.index(6) + 1; k > 0; --k) {
      steps.push_back(
          {random.transform(size, doubt, random.uniform(0, 0.1)), random.index(2) == 0});
    }
    Plot plot = plot_of(steps);
    plot.samples = 30;
    const std::string svg = draw_plot(plot);
    CHECK_THAT(svg, !ContainsSubstring("nan") && !ContainsSubstring("inf"));
    int pairs = 0;
    bool within = true;
    for (std::sregex_iterator p(svg.begin(), svg.end(), pair), end; p != end; ++p, ++pairs) {
      const double x = std::stod((*p)[1]);
      const double y = std::stod((*p)[2]);
      within = within && x >= 0 && x <= 900 && y >= 0 && y <= 760;
    }
    CHECK(within);
    CHECK(pairs > 100);
  }
}

TEST_CASE("a name does not overlap the path") {
  const std::string svg = draw_plot(plot_of({{at(1, 0, 0), false}, {at(1, 0, 0), false}}));
  const std::regex above("class=\"name middle\"[^>]*>a1<");
  CHECK(std::distance(std::sregex_iterator(svg.begin(), svg.end(), above), {}) ==
        3);  // from the side, all dots are one
}

TEST_CASE("no name overlaps another or leaves its panel") {
  Random random(37);
  INFO("seed " << random.seed());
  const std::regex name("class=\"name( [a-z]+)?\" x=\"([0-9.]+)\" y=\"([0-9.]+)\">(f[0-9]+)<");
  std::size_t names = 0;
  for (int round = 0; round < 20; ++round) {
    Plot plot;
    for (int i = 0; i < 12; ++i) plot.steps.push_back({random.transform(0.3), false});
    plot = plot_of(plot.steps);
    // As long as may be without being cut.
    for (std::size_t i = 0; i < plot.frames.size(); ++i) {
      plot.frames[i] = "f0000000000" + std::to_string(10 + i);
    }
    const std::string svg = draw_plot(plot);
    std::vector<Rect> boxes;
    for (std::sregex_iterator it(svg.begin(), svg.end(), name), end; it != end; ++it) {
      const double width = 6.0 * static_cast<double>((*it)[4].length());
      const double before = (*it)[1] == " end" ? 1 : (*it)[1] == " middle" ? 0.5 : 0;
      const double left = std::stod((*it)[2]) - before * width;
      const double y = std::stod((*it)[3]);
      boxes.push_back({left, y - 9, left + width, y + 2});
    }
    const auto panels = panels_of(svg);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      const Rect& box = boxes[i];
      CHECK(std::any_of(panels.begin(), panels.end(), [&](const Rect& panel) {
        return panel.contains(box.left, box.top) && panel.contains(box.right, box.bottom);
      }));
      for (std::size_t k = 0; k < i; ++k) {
        const Rect& other = boxes[k];
        const bool apart = box.left >= other.right || other.left >= box.right ||
                           box.top >= other.bottom || other.top >= box.bottom;
        CHECK(apart);
      }
    }
    names += boxes.size();
  }
  CHECK(names > 20 * 3 * 4);
}

}  // namespace
}  // namespace tfdude::cli
