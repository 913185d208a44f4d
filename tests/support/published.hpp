#pragma once

#include <cmath>
#include <vector>

#include "tfdude/math/belief.hpp"
#include "tfdude/math/perturbation.hpp"

#include "support/random.hpp"
#include "support/sampling.hpp"

// The experiments of docs/accuracy.md: their parameters and samples. Both the tests and the
// program that computes the page's figures use this file, so they cannot differ.
//
// Barfoot & Furgale, "Associating uncertainty with three-dimensional poses for use in estimation
// problems", 2014, use the left perturbation X = Exp(ξ) · X̄. The samples use it, too, while the
// library gets its covariance by from_left_covariance(): so an error in this conversion would show.
namespace tfdude::testing {

[[nodiscard]] inline Twist twist(double x, double y, double z, double rx, double ry, double rz) {
  Twist xi;
  xi << x, y, z, rx, ry, rz;
  return xi;
}

[[nodiscard]] inline Covariance diagonal(const Twist& variances) {
  return Covariance::trusted(Matrix6d(variances.asDiagonal()));
}

/// A mean, and the covariance of its left perturbation.
struct LeftGaussian {
  Pose mean;
  Covariance covariance;

  [[nodiscard]] Belief belief() const {
    return {
        mean, from_left_covariance(mean, covariance).covariance.of_specified(), std::nullopt, {}};
  }
};

// ---- Two poses (section III of the paper)

struct TwoPoses {
  LeftGaussian first;
  LeftGaussian second;

  [[nodiscard]] Pose mean() const { return first.mean * second.mean; }
};

[[nodiscard]] inline TwoPoses two_poses(double alpha) {
  return {{exp(twist(0, 2, 0, M_PI / 6, 0, 0)), diagonal(alpha * twist(10, 5, 5, 0.5, 1, 0.5))},
          {exp(twist(0, 0, 2, 0, M_PI / 4, 0)), diagonal(alpha * twist(5, 10, 5, 0.5, 0.5, 1))}};
}

/// E[ξ ξᵀ] of ξ = Log(X1 X2 (X̄1 X̄2)⁻¹), where the errors of both have this correlation, axis by
/// axis, each in units of its own standard deviation. Only the difference from the linear part of ξ
/// is sampled, because the moment of that part is known. So chance affects only the difference
/// between the orders, not the whole covariance.
[[nodiscard]] inline Matrix6d sampled_product(const TwoPoses& poses, double correlation,
                                              Random& random, int samples) {
  const Gaussian unit(Eigen::MatrixXd::Identity(6, 6));
  const Twist size_1 = poses.first.covariance.matrix().diagonal().cwiseSqrt();
  const Twist size_2 = poses.second.covariance.matrix().diagonal().cwiseSqrt();
  const Matrix6d J_1 = size_1.asDiagonal();
  const Matrix6d J_2 = adjoint(poses.first.mean) * size_2.asDiagonal();
  const double rest = std::sqrt(1.0 - correlation * correlation);
  const Pose back = poses.mean().inverse();
  Matrix6d sum = Matrix6d::Zero();
  for (int i = 0; i < samples; ++i) {
    const Twist u = unit(random);
    const Twist v = correlation * u + rest * Twist(unit(random));
    const Pose X_1 = exp(size_1.cwiseProduct(u)) * poses.first.mean;
    const Pose X_2 = exp(size_2.cwiseProduct(v)) * poses.second.mean;
    const Twist xi = log(X_1 * X_2 * back);
    const Twist linear = J_1 * u + J_2 * v;
    sum += xi * xi.transpose() - linear * linear.transpose();
  }
  const Matrix6d cross = correlation * J_1 * J_2.transpose();
  return J_1 * J_1.transpose() + J_2 * J_2.transpose() + cross + cross.transpose() + sum / samples;
}

/// The covariance of the left perturbation of the product of both poses, with independent errors.
[[nodiscard]] inline Matrix6d composed(const TwoPoses& poses, Order order) {
  return left_covariance(collapse(compose(poses.first.belief(), poses.second.belief(), order)))
      .of_specified()
      .matrix();
}

// ---- The chain (section III of the paper, its second experiment): steps of 1 m along x, each with
// an error in yaw

inline constexpr int kChainSteps = 100;
inline constexpr double kChainYaw = 0.03;  // rad, standard deviation of a step

[[nodiscard]] inline LeftGaussian chain_step() {
  return {exp(twist(1, 0, 0, 0, 0, 0)), diagonal(twist(0, 0, 0, 0, 0, kChainYaw * kChainYaw))};
}

[[nodiscard]] inline Transform chain(int steps, Order order) {
  const Belief step = chain_step().belief();
  Belief X = step;
  for (int k = 1; k < steps; ++k) X = compose(X, step, order);
  return collapse(X);
}

[[nodiscard]] inline Pose sampled_chain(int steps, Random& random) {
  const Pose step = chain_step().mean;
  Pose X;
  for (int k = 0; k < steps; ++k) {
    X = X * exp(twist(0, 0, 0, 0, 0, kChainYaw * random.normal())) * step;
  }
  return X;
}

// ---- Three estimates of one pose (section IV of the paper)

[[nodiscard]] inline Pose fused_truth() { return exp(twist(1, 0, 0, 0, 0, M_PI / 6)); }

[[nodiscard]] inline std::vector<Covariance> fused_covariances(double alpha) {
  return {diagonal(alpha * twist(10, 5, 5, 0.5, 1, 0.5)),
          diagonal(alpha * twist(5, 15, 5, 0.5, 0.5, 1)),
          diagonal(alpha * twist(5, 5, 25, 1, 0.5, 0.5))};
}

/// One trial: estimates whose errors agree with their covariances.
[[nodiscard]] inline std::vector<Transform> drawn_estimates(double alpha, Random& random) {
  std::vector<Transform> estimates;
  for (const Covariance& sigma : fused_covariances(alpha)) {
    const Pose X = exp(Twist(Gaussian(sigma)(random))) * fused_truth();
    estimates.push_back(from_left_covariance(X, sigma));
  }
  return estimates;
}

/// (Log(X̄⁻¹ X))ᵀ Σ⁻¹ Log(X̄⁻¹ X): the squared distance of a pose from an estimate, in units of the
/// estimate's standard deviations.
[[nodiscard]] inline double squared_distance(const Transform& estimate, const Pose& X) {
  return squared_distance(Twist(log(estimate.pose.inverse() * X)),
                          estimate.covariance.of_specified().matrix());
}

// ---- Correlated errors, after the idea of Mangelson et al. 2020; the parameters are ours

/// Both poses as beliefs whose errors have this correlation, by a source that they share.
struct SharedPair {
  Belief first;
  Belief second;
};

[[nodiscard]] inline SharedPair shared_pair(const TwoPoses& poses, double correlation) {
  const double common = std::abs(correlation);
  const auto part = [&](const LeftGaussian& pose, double sign) {
    const Twist size = pose.covariance.matrix().diagonal().cwiseSqrt();
    const Matrix6d to_right = adjoint(pose.mean.inverse());
    const Loading loading = sign * std::sqrt(common) * to_right * Matrix6d(size.asDiagonal());
    const Matrix6d own = (1.0 - common) * pose.belief().own.matrix();
    return Belief{pose.mean, Covariance::trusted(own), std::nullopt, {{"common", false, loading}}};
  };
  return {part(poses.first, 1.0), part(poses.second, correlation < 0 ? -1.0 : 1.0)};
}

/// The same two poses; only their own covariances are known, not their correlation.
[[nodiscard]] inline SharedPair unknown_pair(const TwoPoses& poses) {
  const auto part = [](const LeftGaussian& pose) {
    return Belief{pose.mean, {}, pose.belief().own, {}};
  };
  return {part(poses.first), part(poses.second)};
}

/// A trajectory as in SLAM: A and B are poses on it in the world W, and B contains all errors of A.
struct Trajectory {
  Transform X_WA;
  Transform X_AB;   ///< the way between them, of independent error
  Matrix6d root_A;  ///< L Lᵀ is the covariance of A

  [[nodiscard]] Matrix6d seen_from_B() const { return adjoint(X_AB.pose.inverse()); }
  [[nodiscard]] Belief A() const {
    return {X_WA.pose, {}, std::nullopt, {{"up to A", false, Loading(root_A)}}};
  }
  [[nodiscard]] Belief B() const {
    return {X_WA.pose * X_AB.pose,
            X_AB.covariance.of_specified(),
            std::nullopt,
            {{"up to A", false, Loading(seen_from_B() * root_A)}}};
  }
};

/// A after so many steps of 1 m in a wide arc, B after ten more. Each step has a standard deviation
/// of 2 cm along each axis and 0.01 rad about each axis.
[[nodiscard]] inline Trajectory trajectory(int steps) {
  const Transform step{exp(twist(1, 0, 0, 0, 0, 0.02)),
                       diagonal(twist(4e-4, 4e-4, 4e-4, 1e-4, 1e-4, 1e-4))};
  Trajectory t;
  for (int k = 0; k < steps; ++k) t.X_WA = k == 0 ? step : compose(t.X_WA, step);
  for (int k = 0; k < 10; ++k) t.X_AB = k == 0 ? step : compose(t.X_AB, step);
  t.root_A = cholesky_root(t.X_WA.covariance.of_specified().matrix());
  return t;
}

/// E[ξ ξᵀ] of the right perturbation of X_AB, where the errors of A and B are jointly Gaussian in
/// their tangent spaces, as Mangelson et al. assume.
[[nodiscard]] inline Matrix6d sampled_way(const Trajectory& t, Random& random, int samples) {
  const Gaussian unit(Eigen::MatrixXd::Identity(6, 6));
  const Gaussian of_way(t.X_AB.covariance);
  const Matrix6d root_B = t.seen_from_B() * t.root_A;
  const Pose X_WB = t.X_WA.pose * t.X_AB.pose;
  const Pose back = t.X_AB.pose.inverse();
  return second_moment(samples, [&] {
    const Twist s = unit(random);
    const Twist e_B = root_B * s + Twist(of_way(random));
    const Pose X_A = t.X_WA.pose * exp(Twist(t.root_A * s));
    return log(back * (X_A.inverse() * (X_WB * exp(e_B))));
  });
}

}  // namespace tfdude::testing
