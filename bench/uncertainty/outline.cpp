#include "uncertainty/outline.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace bench {
namespace {

using tfdude::Pose;
using tfdude::Transform;
using tfdude::Twist;

constexpr int kAround = 240;     // points of an ellipse
constexpr int kRows = 300;       // of an outline, each with a point on both sides
constexpr int kAcross = 1400;    // places to check in a row
constexpr int kHeadings = 200;   // headings to check for a place
constexpr double kFarX = 70.0;   // m: how far from the mean to look for an outline
constexpr double kBeyond = 1.2;  // times the distance that follows from the standard deviation of y

Eigen::Vector2d place(const Pose& mean, double x, double y, double yaw) {
  Twist xi;
  xi << x, y, 0, 0, 0, yaw;
  return (mean * tfdude::exp(xi)).translation().head<2>();
}

// Whether there is a heading for which a pose at `p`, relative to the mean, lies within.
class Within {
 public:
  Within(const Eigen::Matrix3d& sigma, double sigmas)
      : information_(sigma.inverse()), sigmas_(sigmas), most_(sigmas * std::sqrt(sigma(2, 2))) {}

  bool operator()(const Eigen::Vector2d& p) const {
    for (int i = 0; i <= kHeadings; ++i) {
      const double yaw = most_ * (2.0 * i / kHeadings - 1.0);
      // p = V ρ with V = [a, -b; b, a], the position of Exp(ρ, yaw).
      const double a = std::abs(yaw) < 1e-9 ? 1.0 : std::sin(yaw) / yaw;
      const double b = std::abs(yaw) < 1e-9 ? 0.0 : (1.0 - std::cos(yaw)) / yaw;
      const Eigen::Vector3d xi((a * p.x() + b * p.y()) / (a * a + b * b),
                               (a * p.y() - b * p.x()) / (a * a + b * b), yaw);
      if (xi.dot(information_ * xi) <= sigmas_ * sigmas_) return true;
    }
    return false;
  }

 private:
  Eigen::Matrix3d information_;
  double sigmas_;
  double most_;  // yaw
};

}  // namespace

Eigen::Matrix3d planar(const tfdude::Covariance& covariance) {
  const tfdude::Matrix6d m = covariance.matrix();
  const std::array<int, 3> axes{0, 1, 5};
  return Eigen::Matrix3d::NullaryExpr([&](Eigen::Index i, Eigen::Index j) {
    return m(axes[static_cast<std::size_t>(i)], axes[static_cast<std::size_t>(j)]);
  });
}

Outline mapped_ellipse(const Transform& X, double sigmas) {
  const Eigen::Matrix2d root =
      planar(X.covariance.of_specified()).bottomRightCorner<2, 2>().llt().matrixL();
  Outline outline;
  for (int i = 0; i <= kAround; ++i) {
    const double angle = 2.0 * M_PI * i / kAround;
    const Eigen::Vector2d xi = sigmas * root * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    const Eigen::Vector2d p = place(X.pose, 0, xi[0], xi[1]);
    outline.push_back({p.x(), p.y()});
  }
  return outline;
}

Outline mapped_ellipsoid(const Transform& X, double sigmas) {
  const Eigen::Matrix3d sigma = planar(X.covariance.of_specified());
  const Within within(sigma, sigmas);
  const Eigen::Vector2d mean = X.pose.translation().head<2>();
  const double far_y = kBeyond * sigmas * std::sqrt(sigma(1, 1));
  Outline left;
  Outline right;
  for (int row = 0; row <= kRows; ++row) {
    const double y = far_y * (2.0 * row / kRows - 1.0);
    int first = -1;
    int last = -1;
    for (int column = 0; column <= kAcross; ++column) {
      if (!within({kFarX * (2.0 * column / kAcross - 1.0), y})) continue;
      if (first < 0) first = column;
      last = column;
    }
    if (first < 0) continue;
    const auto at = [&](double column) {
      return mean.x() + kFarX * (2.0 * column / kAcross - 1.0);
    };
    left.push_back({at(first - 0.5), mean.y() + y});
    right.push_back({at(last + 0.5), mean.y() + y});
  }
  Outline outline = left;
  outline.insert(outline.end(), right.rbegin(), right.rend());
  if (!left.empty()) outline.push_back(left.front());
  return outline;
}

Outline ellipse(const Eigen::Vector2d& mean, const Eigen::Matrix2d& covariance, double sigmas) {
  const Eigen::Matrix2d root = covariance.llt().matrixL();
  Outline outline;
  for (int i = 0; i <= kAround; ++i) {
    const double angle = 2.0 * M_PI * i / kAround;
    const Eigen::Vector2d p =
        mean + sigmas * root * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    outline.push_back({p.x(), p.y()});
  }
  return outline;
}

}  // namespace bench
