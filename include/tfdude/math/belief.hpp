#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tfdude/base/export.hpp"
#include "tfdude/math/transform.hpp"

namespace tfdude {

/// How far covariance is propagated. As in Barfoot & Furgale 2014, the order is that of the
/// perturbation in the result's second moment.
enum class Order : std::uint8_t { kSecond = 2, kFourth = 4 };

/// 6xk: one column per dimension of an error source, with the perturbation for a unit deviation
/// there. Three rows [m], then three [rad].
using Loading = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Maximum number of columns of a loading.
inline constexpr Eigen::Index kMaxLoadingColumns = 36;

/// Maximum number of common errors per error.
inline constexpr std::size_t kMaxCommonErrors = 128;

/// The part of an error that comes from a shared source: F s, with the loading F and the source s
/// of k independent dimensions of variance one, as in factor analysis. If two loadings of a source
/// differ in columns, the missing columns are zero.
struct CommonError {
  std::string source;
  /// The part was removed by an observation: it is subtracted from what is computed from common
  /// errors. After an observation the error of the path is smaller than the errors of its edges
  /// make it, though each edge is hardly known better.
  bool subtracts = false;
  Loading loading;

  friend bool operator==(const CommonError& a, const CommonError& b) {
    return a.source == b.source && a.subtracts == b.subtracts &&
           a.loading.cols() == b.loading.cols() && a.loading == b.loading;
  }
};

/// Prefix of the names of sources created by observations (observation.hpp).
inline constexpr std::string_view kObservedPrefix = "observed:";

/// Whether the error's source was created by an observation.
[[nodiscard]] TFDUDE_EXPORT bool is_observed(const CommonError& common_error);

/// X_AB with the full description of its error e = η + Σ F s + u, X = X̄ · Exp(e). The segments of
/// a path exchange this, so that common errors are counted once.
struct Belief {
  Pose pose;
  Covariance own;                     ///< of η, which is independent of everything else
  std::optional<Covariance> unknown;  ///< of u, which may be correlated with anything; absent: none
  std::vector<CommonError> common_errors;  ///< each source at most once per sign
  bool unspecified = false;  ///< there are edges whose own part is not known, and not part of `own`
};

/// X_BA. Exact: Exp(e)⁻¹ = Exp(-e), transported to the other side.
[[nodiscard]] TFDUDE_EXPORT Belief inverse(const Belief& X_AB);

/// X_AC. Own parts add up as independent, common errors of one source column by column, and unknown
/// parts by bound().
///
/// To fourth order, the product of the two errors Exp(e1) Exp(e2) is taken from the
/// Baker-Campbell-Hausdorff series, as in Barfoot & Furgale 2014, Eqs. 53 to 56. Correlated errors
/// have the moments of a joint Gaussian (Isserlis, Stein), which that paper leaves out. The result
/// is the second moment about the product of the means. That product differs from the mean by terms
/// of second order if the errors are correlated, of fourth order if not. Unknown parts enter to
/// second order only.
/// For errors above half a radian the series may give no valid covariance; terms of sixth order are
/// then added. Beyond a radian it is no more accurate than second order; docs/accuracy.md has
/// figures.
/// In X_WA⁻¹ X_WB, where B's error was composed from A's, terms quadratic in A's common errors
/// count twice as own and do not cancel. Second order is right there, and fourth is too large.
[[nodiscard]] TFDUDE_EXPORT Belief compose(const Belief& X_AB, const Belief& X_BC, Order order);

/// The transform with one covariance for the whole belief. It is an upper bound if the belief has
/// unknown parts.
[[nodiscard]] TFDUDE_EXPORT Transform collapse(const Belief& X_AB);

/// An upper bound for the covariance of the sum of two errors with these covariances, whatever
/// their correlation: (1 + 1/ε) A + (1 + ε) B. ε minimizes the sum of the traces of translation and
/// rotation, each in units of A + B. The error of a product of two poses may exceed the bound by
/// terms of fourth order.
[[nodiscard]] TFDUDE_EXPORT Covariance bound(const Covariance& A, const Covariance& B);

/// @return kInvalidInput: more than kMaxCommonErrors; naming the source: a name that is empty or
///   longer than an id, no column, more than kMaxLoadingColumns, a number that is not finite or
///   exceeds the root of kMaxVariance, a duplicate source.
[[nodiscard]] TFDUDE_EXPORT Result<void> check_common_errors(
    const std::vector<CommonError>& common_errors);

}  // namespace tfdude
