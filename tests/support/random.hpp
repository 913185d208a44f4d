#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "tfdude/math/transform.hpp"

namespace tfdude::testing {

/// The seed of a test: its own, or that of the environment variable TFDUDE_SEED, for a search or a
/// replay.
[[nodiscard]] inline std::uint64_t seed_or(std::uint64_t fallback) {
  const char* text = std::getenv("TFDUDE_SEED");
  return text == nullptr || *text == '\0' ? fallback : std::strtoull(text, nullptr, 0);
}

/// Random values of a fixed sequence. A test prints the seed with INFO("seed " << random.seed()).
class Random {
 public:
  explicit Random(std::uint64_t seed) : seed_(seed_or(seed)), engine_(seed_) {}

  [[nodiscard]] std::uint64_t seed() const { return seed_; }
  [[nodiscard]] std::mt19937_64& engine() { return engine_; }

  [[nodiscard]] double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  [[nodiscard]] double normal() { return normal_(engine_); }

  /// Uniform in [0, count).
  [[nodiscard]] std::size_t index(std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(engine_);
  }

  [[nodiscard]] Eigen::Vector3d vector(double reach) {
    const double x = uniform(-reach, reach);
    const double y = uniform(-reach, reach);
    return {x, y, uniform(-reach, reach)};
  }

  /// Uniform on the unit sphere.
  [[nodiscard]] Eigen::Vector3d direction() {
    const double x = normal();
    const double y = normal();
    return Eigen::Vector3d(x, y, normal()).normalized();
  }

  /// Uniform over all rotations; each translation component within `reach` [m].
  [[nodiscard]] Pose pose(double reach = 2.0) {
    const double a = normal();
    const double b = normal();
    const double c = normal();
    const Eigen::Quaterniond q(normal(), a, b, c);
    return Pose::trusted(q.normalized(), vector(reach));
  }

  /// A rotation by exactly `angle` [rad] about a random axis, and a random translation part.
  [[nodiscard]] Twist twist(double angle, double reach = 2.0) {
    Twist xi;
    xi << vector(reach), angle * direction();
    return xi;
  }

  /// Full rank, every element correlated; standard deviations of about `metres` and `radians`.
  [[nodiscard]] Covariance covariance(double metres = 0.01, double radians = 0.01) {
    Matrix6d A;
    std::generate_n(A.data(), A.size(), [this] { return normal(); });
    Twist scale;
    scale << Eigen::Vector3d::Constant(metres), Eigen::Vector3d::Constant(radians);
    const Matrix6d unit = A * A.transpose() / 6.0 + 0.05 * Matrix6d::Identity();
    return Covariance::trusted(Matrix6d(scale.asDiagonal() * unit * scale.asDiagonal()));
  }

  /// A loading of a common error; standard deviations of about `size` [m, rad].
  [[nodiscard]] Eigen::Matrix<double, 6, Eigen::Dynamic> loading(Eigen::Index columns,
                                                                 double size = 0.01) {
    Eigen::Matrix<double, 6, Eigen::Dynamic> F(6, columns);
    std::generate_n(F.data(), F.size(), [&] { return size * normal(); });
    return F;
  }

  [[nodiscard]] Transform transform(double reach = 2.0, double metres = 0.01,
                                    double radians = 0.01) {
    const Pose X = pose(reach);
    return {X, covariance(metres, radians)};
  }

 private:
  std::uint64_t seed_;
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace tfdude::testing
