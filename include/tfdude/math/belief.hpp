#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// How far covariance is propagated, in the counting of Barfoot & Furgale 2014: by order of the perturbation in the
/// result's second moment.
enum class Order : std::uint8_t { kSecond = 2, kFourth = 4 };

/// 6xk, a column for each dimension of an error source: the perturbation for a deviation of one there. Three rows [m],
/// three [rad].
using Loading = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// The most columns of a loading.
inline constexpr Eigen::Index kMaxLoadingColumns = 36;

/// The most common errors that one error has a part of.
inline constexpr std::size_t kMaxCommonErrors = 128;

/// The part of an error that comes from a source which others depend on, too: F s, with the loading F and the source s of k
/// independent dimensions of variance one, as in factor analysis. Where two loadings of a source differ in columns, the
/// missing ones are zero.
struct CommonError {
  std::string source;
  /// It was taken off by an observation: of what is computed from common errors, this one is subtracted. The error of a path
  /// that was observed is less than its edges' errors make it, each of which is hardly known better.
  bool subtracts = false;
  Loading loading;

  friend bool operator==(const CommonError& a, const CommonError& b) {
    return a.source == b.source && a.subtracts == b.subtracts &&
           a.loading.cols() == b.loading.cols() && a.loading == b.loading;
  }
};

/// How the names of sources begin that observations make (observation.hpp).
inline constexpr std::string_view kObservedPrefix = "observed:";

/// Whether an observation has made the error's source.
[[nodiscard]] TFDUDE_EXPORT bool is_observed(const CommonError& common_error);

/// X_AB with all that is known of its error e = η + Σ F s + u, X = X̄ · Exp(e): what a path's segments must tell each
/// other, so that what they have in common is counted once.
struct Belief {
  Pose pose;
  Covariance own;  ///< of η, which is independent of all else
  std::optional<Covariance>
      unknown;  ///< of u, which may be correlated with anything; absent: there is none
  std::vector<CommonError> common_errors;  ///< each source once for each sign
};

/// X_BA. Exact: Exp(e)⁻¹ = Exp(-e), seen from the other side.
[[nodiscard]] TFDUDE_EXPORT Belief inverse(const Belief& X_AB);

/// X_AC. Own parts add up independently, common errors of one source column by column, and unknown parts by bound().
///
/// To fourth order the two errors' product Exp(e1) Exp(e2) is taken from the series of Baker, Campbell and Hausdorff, as
/// in Barfoot & Furgale 2014, Eqs. 53 to 56, and their moments, where they are correlated, as those of a joint Gaussian
/// (Isserlis, Stein): what that paper leaves out. The answer is the second moment about the product of the means, which
/// differs from the mean by terms of second order if they are correlated, of fourth order if not. Unknown parts enter
/// to second order only.
/// Where that series gives no covariance, as it may for errors above half a radian, terms of sixth order are added. Beyond
/// a radian it is no nearer to the truth than second order; docs/uncertainty.md has figures.
/// Of X_WA⁻¹ X_WB where B's error was composed from A's, what is quadratic in A's common errors counts twice as own and
/// does not cancel: there second order is right, and fourth is too large.
[[nodiscard]] TFDUDE_EXPORT Belief compose(const Belief& X_AB, const Belief& X_BC, Order order);

/// The transform with one covariance that stands for all of the belief: a bound, where parts are unknown.
[[nodiscard]] TFDUDE_EXPORT Transform collapse(const Belief& X_AB);

/// No sum of two errors of these covariances has more than this, whatever their correlation (the product of two poses has,
/// by terms of fourth order): (1 + 1/ε) A + (1 + ε) B, with the ε that makes the sum of both traces, of translation and
/// of rotation, each in units of A + B, the smallest.
[[nodiscard]] TFDUDE_EXPORT Covariance bound(const Covariance& A, const Covariance& B);

/// @return kInvalidInput: more than kMaxCommonErrors; naming the source: an empty name, one longer than an id, no column,
///   more than kMaxLoadingColumns, a number that is not finite or beyond the root of kMaxVariance, one source twice.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_common_errors(
    const std::vector<CommonError>& common_errors);

}  // namespace tfdude
