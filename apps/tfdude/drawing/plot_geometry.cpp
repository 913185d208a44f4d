#include "plot_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "../../rendering/format.hpp"

namespace tfdude::cli {
namespace {

constexpr double kPi = 3.141592653589793;

Pose pose_of(const Step& step, const Pose& X_PC) { return step.up ? X_PC.inverse() : X_PC; }

// Returns a root with root rootᵀ = covariance, by Cholesky decomposition with pivots, which also
// works if the covariance is singular. It is written out because Eigen's solvers take the compiler
// many seconds. Each axis is first scaled by its own deviation: otherwise an axis with large
// numbers would cost the others their precision.
Matrix6d root_of(const Covariance& covariance) {
  const auto stddev = covariance.stddev();
  Matrix6d rest = covariance.matrix();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const double scale =
          stddev[static_cast<std::size_t>(i)] * stddev[static_cast<std::size_t>(j)];
      rest(i, j) = scale > 0 ? rest(i, j) / scale : 0.0;
    }
  }
  Matrix6d root = Matrix6d::Zero();
  for (int column = 0; column < 6; ++column) {
    int pivot = 0;
    for (int i = 1; i < 6; ++i) {
      if (rest(i, i) > rest(pivot, pivot)) pivot = i;
    }
    constexpr double kRounding = 1e-14;
    if (rest(pivot, pivot) <= kRounding) break;
    const double length = std::sqrt(rest(pivot, pivot));
    for (int i = 0; i < 6; ++i) root(i, column) = rest(i, pivot) / length;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) rest(i, j) -= root(i, column) * root(j, column);
    }
  }
  for (int i = 0; i < 6; ++i) root.row(i) *= stddev[static_cast<std::size_t>(i)];
  return root;
}

}  // namespace

Ellipse ellipse_of(const Eigen::Matrix2d& covariance) {
  // The eigenvalues are mean ± radius.
  const double mean = (covariance(0, 0) + covariance(1, 1)) / 2;
  const double half = (covariance(0, 0) - covariance(1, 1)) / 2;
  const double radius = std::hypot(half, covariance(0, 1));
  const double largest = mean + radius;
  // mean - radius would lose all digits if one axis is much longer.
  const double determinant =
      covariance(0, 0) * covariance(1, 1) - covariance(0, 1) * covariance(0, 1);
  const double smallest = largest > 0 ? determinant / largest : 0.0;
  return {std::sqrt(std::max(largest, 0.0)), std::sqrt(std::max(smallest, 0.0)),
          std::atan2(covariance(0, 1), half) / 2};
}

std::vector<Eigen::Vector2d> outline_of(const Ellipse& ellipse, double deviations) {
  constexpr int kPoints = 96;
  std::vector<Eigen::Vector2d> points;
  for (int i = 0; i < kPoints; ++i) {
    const double turn = 2 * kPi * i / kPoints;
    const Eigen::Vector2d p(ellipse.major * std::cos(turn), ellipse.minor * std::sin(turn));
    points.emplace_back(deviations * (Eigen::Rotation2Dd(ellipse.angle) * p));
  }
  return points;
}

Unit unit_for(double metres) {
  constexpr Unit kUnits[] = {{"Mm", 1e6},  {"km", 1e3},  {"m", 1},
                             {"cm", 1e-2}, {"mm", 1e-3}, {"µm", 1e-6}};
  constexpr double kFrom[] = {2e6, 2e3, 0.5, 0.05, 5e-4, 5e-7};
  for (std::size_t i = 0; i < std::size(kUnits); ++i) {
    if (metres >= kFrom[i]) return kUnits[i];
  }
  return {"nm", 1e-9};
}

Unit text_unit_for(double metres) {
  if (metres == 0) return {"m", 1};
  const Unit unit = unit_for(metres);
  return unit.metres == 0.01 ? Unit{"mm", 1e-3} : unit;
}

std::string number_text(double value, int decimals) {
  std::string text = format("%.*f", decimals, std::abs(value));
  const bool zero = text.find_first_not_of("0.") == std::string::npos;
  return value < 0 && !zero ? "−" + text : text;
}

std::string length_text(double metres) {
  if (metres == 0) return "0 mm";
  const Unit unit = text_unit_for(metres);
  const double value = metres / unit.metres;
  std::string text = format("%.*f", value >= 99.95 ? 0 : value >= 9.995 ? 1 : 2, value);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text + " " + unit.name;
}

Ticks ticks_within(double low, double high, int most) {
  double step = std::pow(10.0, std::floor(std::log10((high - low) / most)));
  // A range of n steps may contain n + 1 ticks.
  const auto count = [&](double each) {
    return std::floor(high / each) - std::ceil(low / each) + 1;
  };
  const double power = step;
  for (const double factor : {1.0, 2.0, 5.0, 10.0, 20.0}) {
    step = factor * power;
    if (count(step) <= most) break;
  }
  Ticks ticks{step, {}};
  const auto last = static_cast<long>(std::floor(high / step));
  for (auto k = static_cast<long>(std::ceil(low / step)); k <= last; ++k) {
    ticks.values.push_back(static_cast<double>(k) * step);
  }
  return ticks;
}

std::string tick_label(double value, double step) {
  return number_text(value, std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9))));
}

std::vector<Eigen::Vector3d> chain_of(const std::vector<Step>& steps) {
  Pose X;
  std::vector<Eigen::Vector3d> chain{X.translation()};
  for (const Step& step : steps) {
    X = X * pose_of(step, step.X_PC.pose);
    chain.push_back(X.translation());
  }
  return chain;
}

std::vector<Eigen::Vector3d> sample_ends(const std::vector<Step>& steps, int count,
                                         std::uint64_t seed) {
  std::vector<Matrix6d> roots;
  roots.reserve(steps.size());
  for (const Step& step : steps) roots.push_back(root_of(step.X_PC.covariance.of_specified()));
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> ends;
  for (int i = 0; i < count; ++i) {
    Pose X;
    for (std::size_t k = 0; k < steps.size(); ++k) {
      const Twist unit = Twist::NullaryExpr([&] { return normal(engine); });
      X = X * pose_of(steps[k], steps[k].X_PC.pose * exp(roots[k] * unit));
    }
    ends.push_back(X.translation());
  }
  return ends;
}

}  // namespace tfdude::cli
