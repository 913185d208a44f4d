#include "tfdude/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include <Eigen/Eigenvalues>

#include "tfdude/math/perturbation.hpp"

#include "support/catch.hpp"
#include "support/random.hpp"

namespace tfdude::cli {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
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
  Transform X;
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

// ---- ellipses

TEST_CASE("an ellipse has the axes and the extent of its covariance") {
  Random random(31);
  INFO("seed " << random.seed());
  for (int i = 0; i < 200; ++i) {
    Matrix2d root;
    root << random.normal(), random.normal(), random.normal(), random.normal();
    root *= std::pow(10.0, random.uniform(-9, 9));
    const Matrix2d covariance = root * root.transpose();
    const Ellipse ellipse = ellipse_of(covariance);
    CHECK(ellipse.major >= ellipse.minor);
    const Vector2d major(std::cos(ellipse.angle), std::sin(ellipse.angle));
    const Vector2d minor(-major.y(), major.x());
    const double size = covariance.norm();
    const double major2 = ellipse.major * ellipse.major;
    CHECK((covariance * major - major2 * major).norm() <= 1e-9 * size);
    CHECK((covariance * minor - ellipse.minor * ellipse.minor * minor).norm() <= 1e-9 * size);
    // Along any direction it reaches as far as the deviation there, times three.
    const double turn = random.uniform(0, 6.28);
    const Vector2d u(std::cos(turn), std::sin(turn));
    double reach = 0;
    for (const Vector2d& p : outline_of(ellipse, 3)) reach = std::max(reach, p.dot(u));
    const double expected = 3 * std::sqrt(u.dot(covariance * u));
    CHECK(reach <= expected * (1 + 1e-9));
    CHECK(reach >= expected * 0.998);  // between two of its points
  }
}

TEST_CASE("a flat ellipse is a line, one of nothing a point") {
  Matrix2d covariance;
  covariance << 4, 4, 4, 4;
  double furthest = 0;
  for (const Vector2d& p : outline_of(ellipse_of(covariance), 1)) {
    CHECK(std::abs(p.x() - p.y()) < 1e-6);
    furthest = std::max(furthest, p.norm());
  }
  CHECK(furthest == Approx(std::sqrt(8)));
  const Ellipse none = ellipse_of(Matrix2d::Zero());
  CHECK(none.major == 0);
  CHECK(none.minor == 0);
}

// ---- axes

TEST_CASE("ticks are round numbers") {
  CHECK(ticks_within(-1.05, 3.05, 6).values == std::vector<double>{-1, 0, 1, 2, 3});
  CHECK(ticks_within(0, 1, 6).step == Approx(0.2));
  CHECK(ticks_within(0, 1, 11).step == Approx(0.1));
  CHECK(ticks_within(-30, 30, 6).values == std::vector<double>{-20, 0, 20});
  CHECK(ticks_within(400, 2100, 6).values == std::vector<double>{500, 1000, 1500, 2000});
}

TEST_CASE("ticks of any range are within it, few, and multiples of 1, 2 or 5") {
  Random random(32);
  INFO("seed " << random.seed());
  for (int i = 0; i < 2000; ++i) {
    const double size = std::pow(10.0, random.uniform(-8, 8));
    const double low = random.uniform(-2, 2) * size;
    const double high = low + random.uniform(0.5, 3) * size;
    const Ticks ticks = ticks_within(low, high, 6);
    INFO(low << " to " << high);
    CHECK(ticks.values.size() <= 6);
    CHECK(ticks.values.size() >= 2);
    const double digit = ticks.step / std::pow(10.0, std::floor(std::log10(ticks.step) + 1e-9));
    CHECK((std::abs(digit - 1) < 1e-9 || std::abs(digit - 2) < 1e-9 || std::abs(digit - 5) < 1e-9));
    for (const double value : ticks.values) {
      CHECK(value >= low - 1e-9 * size);
      CHECK(value <= high + 1e-9 * size);
      CHECK(std::abs(std::remainder(value, ticks.step)) < 1e-9 * ticks.step);
    }
  }
}

TEST_CASE("numbers on an axis have the decimals of its step") {
  CHECK(tick_label(0, 0.5) == "0.0");
  CHECK(tick_label(-1.5, 0.5) == "−1.5");
  CHECK(tick_label(20, 10) == "20");
  CHECK(tick_label(0.06, 0.02) == "0.06");
  CHECK(tick_label(-0.3, 0.1) == "−0.3");
  CHECK(number_text(-0.0004, 2) == "0.00");
}

TEST_CASE("units make numbers easy to read") {
  CHECK(std::string(unit_for(3e8).name) == "Mm");
  CHECK(std::string(unit_for(4e3).name) == "km");
  CHECK(std::string(unit_for(2).name) == "m");
  CHECK(std::string(unit_for(0.1).name) == "cm");
  CHECK(std::string(unit_for(0.02).name) == "mm");
  CHECK(std::string(unit_for(2e-5).name) == "µm");
  CHECK(std::string(unit_for(2e-8).name) == "nm");
  CHECK(length_text(0.0312) == "31.2 mm");
  CHECK(length_text(0.1) == "100 mm");
  CHECK(length_text(0.00099999) == "1 mm");
  CHECK(length_text(1.5) == "1.5 m");
  CHECK(length_text(0) == "0 mm");
}

// ---- the path

TEST_CASE("a chain goes up and down the edges of its path") {
  Random random(33);
  INFO("seed " << random.seed());
  const Step up{random.transform(), true};
  const Step down{random.transform(), false};
  const auto chain = chain_of({up, down, down});
  REQUIRE(chain.size() == 4);
  CHECK(chain[0].norm() == 0);
  // The parent, seen from the child.
  CHECK((up.X_PC.pose * chain[1]).norm() < 1e-12);
  const Pose X = up.X_PC.pose.inverse() * down.X_PC.pose;
  CHECK((chain[2] - X.translation()).norm() < 1e-12);
  CHECK((chain[3] - X * down.X_PC.pose.translation()).norm() < 1e-12);
  CHECK(chain_of({}).size() == 1);
}

TEST_CASE("points are spread as small covariances say") {
  Random random(34);
  INFO("seed " << random.seed());
  constexpr int kPoints = 20000;
  std::vector<Step> steps;
  for (const bool up : {true, true, false, false}) {
    steps.push_back({random.transform(1, 1e-4, 1e-4), up});
  }
  const Plot plot = plot_of(steps);
  const Eigen::Matrix3d expected = ros_covariance(plot.X_AB).matrix().topLeftCorner<3, 3>();
  Vector3d mean = Vector3d::Zero();
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const Vector3d& p : sample_ends(steps, kPoints, random.seed())) {
    const Vector3d d = p - plot.X_AB.pose.translation();
    mean += d / kPoints;
    moment += d * d.transpose() / kPoints;
  }
  for (int i = 0; i < 3; ++i) {
    CHECK(std::abs(mean[i]) < 5 * std::sqrt(expected(i, i) / kPoints));
    for (int j = i; j < 3; ++j) {
      const double both = expected(i, i) * expected(j, j) + expected(i, j) * expected(i, j);
      CHECK(std::abs(moment(i, j) - expected(i, j)) < 5 * std::sqrt(both / kPoints));
    }
  }
}

TEST_CASE("points of an uncertain turn lie on its circle, not on the tangent") {
  const std::vector<Step> steps{{at(0, 0, 0, {0, 0, 0, 0, 0, 1}), false}, {at(2, 0, 0), false}};
  double lowest = 2;
  for (const Vector3d& p : sample_ends(steps, 500, 1)) {
    CHECK(p.norm() == Approx(2));
    CHECK(p.z() == 0);
    lowest = std::min(lowest, p.x());
  }
  CHECK(lowest < 0);
}

TEST_CASE("the same seed gives the same points") {
  Random random(35);
  const std::vector<Step> steps{{random.transform(), false}};
  const auto first = sample_ends(steps, 5, 7);
  CHECK(first.size() == 5);
  CHECK(first == sample_ends(steps, 5, 7));
  CHECK(first != sample_ends(steps, 5, 8));
}

// ---- the picture

TEST_CASE("a picture shows the path, and its end once more") {
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

TEST_CASE("each panel shows its plane of A, upright and to one scale") {
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

TEST_CASE("deviations are along the axes of A, though errors are along those of B") {
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

TEST_CASE("where nothing is uncertain there is nothing to magnify") {
  for (const auto& steps : {std::vector<Step>{}, {{at(1, 2, 3), false}}}) {
    Plot plot = plot_of(steps);
    plot.samples = 10;
    const std::string svg = draw_plot(plot);
    CHECK(count(svg, "class=\"panel\"") == 3);
    CHECK_THAT(svg, !ContainsSubstring("Δ") && !ContainsSubstring("class=\"inner\"") &&
                        !ContainsSubstring("nan"));
  }
}

TEST_CASE("a picture says of when it is, and what its points do not know") {
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

TEST_CASE("names are escaped and cut to the room there is") {
  Plot plot = plot_of({{at(1, 0, 0, {0.01, 0.01, 0.01, 0, 0, 0}), false}});
  plot.frames = {"<A&\"B\">", std::string(255, 'w')};
  const std::string svg = draw_plot(plot);
  CHECK_THAT(svg, !ContainsSubstring("<A&") && ContainsSubstring("&lt;A&amp;&quot;B&quot;&gt;"));
  // In full only where it is not drawn.
  CHECK(count(svg, std::string(255, 'w')) == 1);
}

TEST_CASE("nothing is drawn beyond the page, at any scale") {
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

TEST_CASE("no name lies over another, or beyond its panel") {
  Random random(37);
  INFO("seed " << random.seed());
  std::vector<Step> steps;
  for (int i = 0; i < 40; ++i) steps.push_back({random.transform(0.3), false});
  const std::string svg = draw_plot(plot_of(steps));
  CHECK(count(svg, ">a0<") == 3);
  CHECK(count(svg, ">a40<") == 3);
  const std::regex name("class=\"name( [a-z]+)?\" x=\"([0-9.]+)\" y=\"([0-9.]+)\">(a[0-9]+)<");
  std::vector<std::array<double, 4>> boxes;  // left, right, top, bottom
  for (std::sregex_iterator it(svg.begin(), svg.end(), name), end; it != end; ++it) {
    const double width = 6.0 * static_cast<double>((*it)[4].length());
    const double before = (*it)[1] == " end" ? 1 : (*it)[1] == " middle" ? 0.5 : 0;
    const double left = std::stod((*it)[2]) - before * width;
    const double y = std::stod((*it)[3]);
    boxes.push_back({left, left + width, y - 9, y + 2});
  }
  CHECK(boxes.size() > 12);
  const auto panels = panels_of(svg);
  for (const auto& box : boxes) {
    CHECK(std::any_of(panels.begin(), panels.end(), [&](const Rect& panel) {
      return panel.contains(box[0], box[2]) && panel.contains(box[1], box[3]);
    }));
  }
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const bool apart = boxes[i][0] >= boxes[k][1] || boxes[k][0] >= boxes[i][1] ||
                         boxes[i][2] >= boxes[k][3] || boxes[k][2] >= boxes[i][3];
      CHECK(apart);
    }
  }
}

}  // namespace
}  // namespace tfdude::cli
