#include "math/square_root.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>

#include "support/catch.hpp"
#include "support/random.hpp"

namespace tfdude {
namespace {

using testing::Random;

Loading noisy(Random& random, const Loading& root) {
  // As after some hundred operations.
  constexpr double kNoise = 300 * std::numeric_limits<double>::epsilon();
  return root.unaryExpr([&](double x) { return x * (1 + random.normal() * kNoise); });
}

}  // namespace

// What an observed edge keeps, of a covariance of any rank in oblique directions: the rest of what
// its errors add is in the columns that it shares with others.
TEST_CASE("square root: a difference of the same few directions is not lost in their rounding") {
  Random random(0x5007);
  INFO("seed " << random.seed());
  for (int i = 0; i < 500; ++i) {
    const Eigen::Index rank = 1 + static_cast<Eigen::Index>(random.index(5));
    const Loading V = Loading::NullaryExpr(6, rank, [&] { return random.normal() * 1e-3; });
    // Own errors, and those of others in the same directions.
    const Eigen::MatrixXd shares =
        Eigen::MatrixXd::NullaryExpr(rank, 2, [&] { return 0.3 * random.normal(); });
    const Loading whole = joined(V, noisy(random, V * shares));
    const Eigen::MatrixXd sum = Eigen::MatrixXd::Identity(rank, rank) + shares * shares.transpose();
    const double left = 0.05;
    const Eigen::MatrixXd taken = Eigen::LLT<Eigen::MatrixXd>(sum).matrixL();
    const Loading D = noisy(random, V * taken * std::sqrt(1 - left));
    const Matrix6d expected = left * V * sum * V.transpose();
    const Loading root = root_of_difference(whole, D);
    const Twist deviation = expected.diagonal().cwiseSqrt();
    const Matrix6d off = root * root.transpose() - expected;
    CHECK((off.array() / (deviation * deviation.transpose()).array()).abs().maxCoeff() < 1e-6);
  }
}

}  // namespace tfdude
