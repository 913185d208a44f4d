#include <cmath>
#include <functional>
#include <sstream>
#include <string>

#include "tfdude/math/transform.hpp"

#include "math/path_accumulation.hpp"
#include "support/catch.hpp"
#include "support/random.hpp"
#include "support/sampling.hpp"

namespace tfdude {
namespace {

using testing::Random;

constexpr int kSamples = 100'000;

// Samples X̄ · Exp(ξ) with ξ ~ N(0, Σ).
class Sampler {
 public:
  explicit Sampler(const Transform& X)
      : mean_(X.pose), root_(testing::cholesky_root(X.covariance.of_specified().matrix())) {}

  Pose operator()(Random& random) const {
    Twist unit;
    for (int i = 0; i < 6; ++i) unit[i] = random.normal();
    return mean_ * exp(root_ * unit);
  }

 private:
  Pose mean_;
  Matrix6d root_;
};

// E[ξ ξᵀ] of the right perturbation ξ = log(X̄⁻¹ X) over the samples. Its mean is zero in first
// order, and the mean's own second-order part belongs to the allowance below.
Matrix6d sample_covariance(const Pose& mean, const std::function<Pose()>& sample) {
  const Pose mean_inverse = mean.inverse();
  Matrix6d sum = Matrix6d::Zero();
  for (int i = 0; i < kSamples; ++i) {
    const Twist xi = log(mean_inverse * sample());
    sum += xi * xi.transpose();
  }
  return sum / kSamples;
}

// Empty if the sample covariance S agrees with the propagated Σ in every element, otherwise the
// first element that does not. Two reasons for a difference are allowed:
//  - Chance. For a Gaussian, Var(ξi ξj) = σii σjj + σij² (Isserlis), so the mean of N samples has
//    the standard error √((σii σjj + σij²) / N). Five of them are allowed; chance exceeds that in
//    one case of 1.7 million.
//  - Second order. log(Exp(a) Exp(b)) = a + b + ½[a, b] + ⅟₁₂[a, [a, b]] + ..., and
//    |[a, b]| ≤ 2|a||b|, where a and b are both expressed in the result's frame. The neglected
//    ¼ E[[a, b][a, b]ᵀ] and the mixed third-order terms, 2 · ⅟₁₂ · 2 · 2 for each of a and b, stay
//    below 3 tr(Σa) tr(Σb) in all elements.
std::string disagreement(const Matrix6d& S, const Matrix6d& sigma, double second_order) {
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      const double variance = sigma(i, i) * sigma(j, j) + sigma(i, j) * sigma(i, j);
      const double bound = 5.0 * std::sqrt(variance / kSamples) + second_order;
      const double difference = std::abs(S(i, j) - sigma(i, j));
      if (difference <= bound) continue;
      std::ostringstream out;
      out << "[" << i << "][" << j << "]: sampled " << S(i, j) << ", propagated " << sigma(i, j)
          << ", bound " << bound;
      return out.str();
    }
  }
  return "";
}

// Σ of the part of a result that comes from one argument, both in the result's frame.
double allowance(const Matrix6d& from_a, const Matrix6d& from_b) {
  return 3.0 * from_a.trace() * from_b.trace();
}

// The allowance must not hide what the test is for.
void require_small(double second_order, const Matrix6d& sigma) {
  REQUIRE(second_order < 0.1 * sigma.diagonal().minCoeff() / std::sqrt(kSamples));
}

TEST_CASE("sampled products have the composed covariance") {
  Random random(301);
  INFO("seed " << random.seed());
  const Transform X_AB = random.transform(1.0, 3e-4, 3e-4);
  const Transform X_BC = random.transform(1.0, 3e-4, 3e-4);
  const Transform X_AC = compose(X_AB, X_BC);
  const Sampler sample_AB(X_AB);
  const Sampler sample_BC(X_BC);
  const Matrix6d S = sample_covariance(X_AC.pose, [&] {
    const Pose sampled_AB = sample_AB(random);
    return sampled_AB * sample_BC(random);
  });
  const Matrix6d sigma = X_AC.covariance.of_specified().matrix();
  const Matrix6d from_BC = X_BC.covariance.of_specified().matrix();
  const double second_order = allowance(sigma - from_BC, from_BC);
  require_small(second_order, sigma);
  CHECK(disagreement(S, sigma, second_order) == "");

  // The same check turns down what a wrong propagation would have given.
  const Matrix6d untransported = X_AB.covariance.of_specified().matrix() + from_BC;
  CHECK(disagreement(S, untransported, second_order) != "");
  const Matrix6d wrong_way =
      X_AB.covariance.transported(X_BC.pose).of_specified().matrix() + from_BC;
  CHECK(disagreement(S, wrong_way, second_order) != "");
  const Matrix6d left = X_AB.covariance.of_specified().matrix() +
                        X_BC.covariance.transported(X_AB.pose).of_specified().matrix();
  CHECK(disagreement(S, left, second_order) != "");
  CHECK(disagreement(S, 1.05 * sigma, second_order) != "");
}

TEST_CASE("sampled inverses have the inverted covariance") {
  Random random(302);
  INFO("seed " << random.seed());
  const Transform X_AB = random.transform(1.0, 1e-2, 1e-2);
  const Transform X_BA = inverse(X_AB);
  const Sampler sample_AB(X_AB);
  const Matrix6d S = sample_covariance(X_BA.pose, [&] { return sample_AB(random).inverse(); });
  // Exact: (X̄ Exp(ξ))⁻¹ = X̄⁻¹ Exp(-Ad(X̄) ξ), nothing to allow for.
  CHECK(disagreement(S, X_BA.covariance.of_specified().matrix(), 0.0) == "");

  CHECK(disagreement(S, X_AB.covariance.of_specified().matrix(), 0.0) != "");
  CHECK(disagreement(S, X_AB.covariance.transported(X_BA.pose).of_specified().matrix(), 0.0) != "");
}

TEST_CASE("sampled differences have the covariance of between") {
  Random random(303);
  INFO("seed " << random.seed());
  const Transform X_WA = random.transform(1.0, 3e-4, 3e-4);
  const Transform X_WB = random.transform(1.0, 3e-4, 3e-4);
  const Transform X_AB = between(X_WA, X_WB);
  const Sampler sample_WA(X_WA);
  const Sampler sample_WB(X_WB);
  const Matrix6d S = sample_covariance(X_AB.pose, [&] {
    const Pose sampled_WA = sample_WA(random);
    return sampled_WA.inverse() * sample_WB(random);
  });
  const Matrix6d sigma = X_AB.covariance.of_specified().matrix();
  const Matrix6d from_WB = X_WB.covariance.of_specified().matrix();
  const double second_order = allowance(sigma - from_WB, from_WB);
  require_small(second_order, sigma);
  CHECK(disagreement(S, sigma, second_order) == "");

  CHECK(disagreement(S, X_WA.covariance.of_specified().matrix() + from_WB, second_order) != "");
  const Matrix6d wrong_way =
      X_WA.covariance.transported(X_AB.pose).of_specified().matrix() + from_WB;
  CHECK(disagreement(S, wrong_way, second_order) != "");
  CHECK(disagreement(S, sigma - 2.0 * from_WB, second_order) != "");
}

TEST_CASE("sampled paths have the joined covariance") {
  // A and B are two and one edges below H: X_AB = (X_HP X_PA)⁻¹ X_HB, all three edges independent.
  Random random(304);
  INFO("seed " << random.seed());
  const Transform X_HP = random.transform(1.0, 1e-4, 1e-4);
  const Transform X_PA = random.transform(1.0, 1e-4, 1e-4);
  const Transform X_HB = random.transform(1.0, 1e-4, 1e-4);
  PathAccumulation<Transform> from_a;
  from_a.up(X_PA);
  from_a.up(X_HP);
  PathAccumulation<Transform> from_b;
  from_b.up(X_HB);
  const Transform X_AB = join(std::move(from_a), std::move(from_b));
  const Sampler sample_HP(X_HP);
  const Sampler sample_PA(X_PA);
  const Sampler sample_HB(X_HB);
  const Matrix6d S = sample_covariance(X_AB.pose, [&] {
    const Pose sampled_HP = sample_HP(random);
    const Pose sampled_HA = sampled_HP * sample_PA(random);
    return sampled_HA.inverse() * sample_HB(random);
  });
  const Matrix6d sigma = X_AB.covariance.of_specified().matrix();
  // Three parts: no pair of them exceeds the product of the whole with itself.
  const double second_order = allowance(sigma, sigma);
  require_small(second_order, sigma);
  CHECK(disagreement(S, sigma, second_order) == "");
  CHECK(disagreement(S, sigma - X_HB.covariance.of_specified().matrix(), second_order) != "");
}

}  // namespace
}  // namespace tfdude
