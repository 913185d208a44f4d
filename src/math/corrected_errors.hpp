#pragma once

#include <string>
#include <vector>

#include "math/joint_prior.hpp"

namespace tfdude {

/// What an uncertain edge's error is after an observation.
struct CorrectedError {
  Matrix6d own;
  std::vector<CommonError> common_errors;
};

/// The joint covariance after a measurement of error R, P - P Hᵀ S⁻¹ H P, in the form of own parts and common errors; by
/// uncertain edge of the prior.
///
/// With N = own Hᵀ, C = Σ H F, S₀ = H own Hᵀ + R and K = P Hᵀ S⁻¹, what a Schmidt-Kalman update leaves of loadings is
/// F' = F - K C, and the rest of the joint covariance is own - N S₀⁻¹ Nᵀ + (K S₀ - N) S₀⁻¹ (K S₀ - N)ᵀ: two common errors
/// of the new source, one that subtracts and, where there were common errors, one that adds. Those of sources that earlier
/// observations have made become one with them.
[[nodiscard]] std::vector<CorrectedError> corrected_errors(const JointPrior& prior,
                                                           const std::vector<Matrix6d>& H,
                                                           const Matrix6d& R,
                                                           const std::string& source);

}  // namespace tfdude
