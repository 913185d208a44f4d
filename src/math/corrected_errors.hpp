#pragma once

#include <string>
#include <vector>

#include "math/path_minimum.hpp"

namespace tfdude {

/// The error of an uncertain edge after an observation.
struct CorrectedError {
  Matrix6d own;
  std::vector<CommonError> common_errors;
  bool forgotten = false;  ///< how it was correlated with the others
  bool depends = false;    ///< it was, so much that it cannot count as independent
};

/// The joint covariance after a measurement, P - P Hᵀ S⁻¹ H P, as own parts and common
/// errors; one entry per uncertain edge of the prior.
///
/// Let N = own Hᵀ, C = Σ H F, S₀ = H own Hᵀ + R and K = P Hᵀ S⁻¹. A Schmidt-Kalman update turns
/// loadings into F' = F - K C. The rest of the joint covariance is own - N S₀⁻¹ Nᵀ + (K S₀ - N)
/// S₀⁻¹ (K S₀ - N)ᵀ. This gives two common errors of the new source: one that subtracts and, if
/// there were common errors, one that adds. Common errors from earlier observations are merged into
/// them. If fewer columns say the same (low_rank.hpp), those are taken.
///
/// If one edge makes nearly all of the path's error, and the measurement is a hundred thousand
/// times as precise, that difference would lose its digits. This edge is then tied to the others as
/// in determined_errors(), with its gain instead of G.
/// @param found  with this prior and R
/// @param R  a root of the measurement's covariance
/// @param merge  false: other edges depend on the sources of earlier observations, which are kept
[[nodiscard]] std::vector<CorrectedError> corrected_errors(const JointPrior& prior,
                                                           const PathMinimum& found,
                                                           const Loading& R,
                                                           const std::string& source, bool merge);

/// The same for a path with an edge u of which nothing was known, the limit of no prior
/// information: the other edges keep their errors, and that of u is G (v - Σ H e), with G = H_u⁻¹,
/// the error v of the measurement, and the errors e of the others. Let B be a root of Σ H own Hᵀ
/// and W B = 1. Then columns N Wᵀ of the others, with -G B of u, correlate them with u, and the
/// same columns of the others, subtracted, keep these independent of each other.
/// @param prior  of the other edges
/// @param u  the edge's index in the path
/// @return one entry per uncertain edge of the prior, then that of u
[[nodiscard]] std::vector<CorrectedError> determined_errors(const JointPrior& prior, std::size_t u,
                                                            const LinearPath& linear,
                                                            const Loading& R,
                                                            const std::string& source, bool merge);

}  // namespace tfdude
