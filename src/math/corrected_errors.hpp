#pragma once

#include <string>
#include <vector>

#include "math/joint_prior.hpp"

namespace tfdude {

/// The error of an uncertain edge after an observation.
struct CorrectedError {
  Matrix6d own;
  std::vector<CommonError> common_errors;
  bool forgotten = false;  ///< how it was correlated with the others
};

/// The joint covariance after a measurement with error R, P - P Hᵀ S⁻¹ H P, as own parts and common
/// errors; one entry per uncertain edge of the prior.
///
/// Let N = own Hᵀ, C = Σ H F, S₀ = H own Hᵀ + R and K = P Hᵀ S⁻¹. A Schmidt-Kalman update turns
/// loadings into F' = F - K C. The rest of the joint covariance is own - N S₀⁻¹ Nᵀ + (K S₀ - N)
/// S₀⁻¹ (K S₀ - N)ᵀ. This gives two common errors of the new source: one that subtracts and, if
/// there were common errors, one that adds. Common errors from earlier observations are merged into
/// them. If fewer columns say the same (low_rank.hpp), those are taken.
[[nodiscard]] std::vector<CorrectedError> corrected_errors(const JointPrior& prior,
                                                           const std::vector<Matrix6d>& H,
                                                           const Matrix6d& R,
                                                           const std::string& source);

}  // namespace tfdude
