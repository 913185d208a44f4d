#include "math/not_exact.hpp"

#include <algorithm>

#include "math/square_root.hpp"

namespace tfdude {
namespace {

// Of the deviations beside it, or of the path's. A ten millionth of their variances is far above
// rounding, also if many paths that share edges are measured often, and far below what anybody
// measures.
constexpr double kShare = 3e-4;
// Below that share of what cancels, a deviation may stand for zero...
constexpr double kExact = 3e-5;
// ...and if it is below that share of the deviations beside it.
constexpr double kAsExact = 1e-4;
// What is above this share of a floor is measured, and stays as it is...
constexpr double kMeasured = 0.03;
// ...or above so many times the least.
constexpr double kClear = 1e3;

// The least deviation of three axes that is not exact; zero: all are.
double least_beside(const Eigen::Ref<const Eigen::MatrixXd>& rows) {
  const Eigen::VectorXd deviations = rows.rowwise().norm();
  const double most = deviations.maxCoeff();
  double least = most;
  for (const double one : deviations) {
    if (one > kAsExact * most) least = std::min(least, one);
  }
  return least;
}

}  // namespace

Loading not_exact(const Loading& root, const JointPrior& prior, const std::vector<Matrix6d>& H,
                  bool of_all) {
  const Twist least = prior.least_on_path(H, of_all);
  const Twist size = prior.size_on_path(H);
  // Of one edge nothing cancels, unless its errors are those of others, too.
  const bool may_cancel = prior.is_tied() || !least.isZero(0);
  if (may_cancel && Factor(root, kExact * size).rank() < 6) {
    Twist floor = least;
    for (const Eigen::Index unit : {0, 3}) {
      // Of all three axes, as that of one shrinks with each measurement.
      const double beside =
          std::min(least_beside(root.middleRows(unit, 3)), size.segment<3>(unit).maxCoeff());
      for (Eigen::Index i = unit; i < unit + 3; ++i) floor[i] = std::max(floor[i], kShare * beside);
    }
    if (Factor(root, kMeasured * floor).rank() < 6)
      return compressed(joined(root, Matrix6d(floor.asDiagonal())));
  }
  if (Factor(root, kClear * least).rank() == 6) return root;
  return compressed(joined(root, Matrix6d(least.asDiagonal())));
}

}  // namespace tfdude
