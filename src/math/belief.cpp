#include "tfdude/math/belief.hpp"

#include <algorithm>
#include <cmath>

#include "tfdude/base/id.hpp"

#include "math/common_errors.hpp"
#include "math/moments.hpp"
#include "math/semidefinite.hpp"

namespace tfdude {
namespace {

using CommonErrors = std::vector<CommonError>;

Eigen::Index columns(const CommonError& common_error) { return common_error.loading.cols(); }

void add_padded(Loading& sum, const Loading& more) {
  widen(sum, more.cols());
  sum.leftCols(more.cols()) += more;
}

template <class List>
auto of_same_source(List& common_errors, const CommonError& common_error)
    -> decltype(common_errors.data()) {
  const auto found =
      std::find_if(common_errors.begin(), common_errors.end(),
                   [&](const CommonError& other) { return same_source(other, common_error); });
  return found == common_errors.end() ? nullptr : &*found;
}

CommonErrors sum_of(CommonErrors sum, const CommonErrors& more) {
  for (const CommonError& common_error : more) {
    if (CommonError* same = of_same_source(sum, common_error)) {
      add_padded(same->loading, common_error.loading);
    } else {
      sum.push_back(common_error);
    }
  }
  return sum;
}

CommonErrors product(const Matrix6d& matrix, CommonErrors common_errors) {
  for (CommonError& common_error : common_errors)
    common_error.loading = (matrix * common_error.loading).eval();
  return common_errors;
}

// Σ ± F Fᵀ.
Matrix6d second_moment(const CommonErrors& common_errors) {
  Matrix6d sum = Matrix6d::Zero();
  for (const CommonError& common_error : common_errors) {
    const Matrix6d one = common_error.loading * common_error.loading.transpose();
    sum += common_error.subtracts ? Matrix6d(-one) : one;
  }
  return sum;
}

// Σ ± F1 F2ᵀ over the sources of both.
Matrix6d joint_moment(const CommonErrors& first, const CommonErrors& second) {
  Matrix6d sum = Matrix6d::Zero();
  for (const CommonError& one : first) {
    const CommonError* other = of_same_source(second, one);
    if (other == nullptr) continue;
    const Eigen::Index common = std::min(columns(one), columns(*other));
    const Matrix6d both =
        one.loading.leftCols(common) * other->loading.leftCols(common).transpose();
    sum += one.subtracts ? Matrix6d(-both) : both;
  }
  return sum;
}

// Both errors of a product, transported to the last frame: X_AC as if known exactly, and the two
// errors there.
struct Errors {
  Covariance own[2];
  CommonErrors common_errors[2];
};

Covariance add_fourth(const Errors& e, CommonErrors& common_errors) {
  const Matrix6d own_1 = e.own[0].matrix();
  const Matrix6d own_2 = e.own[1].matrix();
  const Matrix6d J_11 = own_1 + second_moment(e.common_errors[0]);
  const Matrix6d J_22 = own_2 + second_moment(e.common_errors[1]);
  const Matrix6d J_12 = joint_moment(e.common_errors[0], e.common_errors[1]);
  // The terms of third order are ([ξ1, [ξ1, ξ2]] + [ξ2, [ξ2, ξ1]]) / 12. Their moment with any z is
  // D1 E[ξ1 zᵀ] + D2 E[ξ2 zᵀ], with D the mean of their derivatives (Stein's lemma).
  const Matrix6d P_12 = product_of_adjoints(J_12);
  const Matrix6d P_21 = product_of_adjoints(J_12.transpose());
  const Matrix6d D_1 = (product_of_adjoints(J_22) + P_21 - 2.0 * P_12) / 12.0;
  const Matrix6d D_2 = (product_of_adjoints(J_11) + P_12 - 2.0 * P_21) / 12.0;
  const Matrix6d brackets = bracket_second_moment(J_11, J_22, J_12) / 4.0;
  common_errors = sum_of(product(Matrix6d::Identity() + D_1, e.common_errors[0]),
                         product(Matrix6d::Identity() + D_2, e.common_errors[1]));
  // For the part due to the common errors, their product contains all but terms of sixth order.
  const Matrix6d cubic = D_1 * own_1 + D_2 * own_2;
  const Matrix6d series = own_1 + own_2 + brackets + cubic + cubic.transpose();
  if (is_semidefinite(series)) return Covariance::trusted(series);
  return Covariance::trusted(
      Matrix6d(series + D_1 * own_1 * D_1.transpose() + D_2 * own_2 * D_2.transpose()));
}

}  // namespace

bool is_observed(const CommonError& common_error) {
  return common_error.source.rfind(kObservedPrefix, 0) == 0;
}

Belief inverse(const Belief& X_AB) {
  Belief X_BA;
  X_BA.pose = X_AB.pose.inverse();
  X_BA.own = X_AB.own.transported(X_AB.pose);
  if (X_AB.unknown) X_BA.unknown = X_AB.unknown->transported(X_AB.pose);
  if (!X_AB.common_errors.empty())
    X_BA.common_errors = product(-adjoint(X_AB.pose), X_AB.common_errors);
  X_BA.unspecified = X_AB.unspecified;
  return X_BA;
}

Belief compose(const Belief& X_AB, const Belief& X_BC, Order order) {
  const Pose X_CB = X_BC.pose.inverse();
  Belief X_AC;
  X_AC.pose = X_AB.pose * X_BC.pose;
  Errors e{{X_AB.own.transported(X_CB), X_BC.own}, {{}, X_BC.common_errors}};
  if (!X_AB.common_errors.empty()) e.common_errors[0] = product(adjoint(X_CB), X_AB.common_errors);
  if (order == Order::kFourth) {
    X_AC.own = add_fourth(e, X_AC.common_errors);
  } else {
    X_AC.own = e.own[0] + e.own[1];
    X_AC.common_errors = sum_of(std::move(e.common_errors[0]), e.common_errors[1]);
  }
  if (X_AB.unknown) X_AC.unknown = X_AB.unknown->transported(X_CB);
  if (X_BC.unknown) {
    X_AC.unknown = X_AC.unknown ? bound(*X_AC.unknown, *X_BC.unknown) : *X_BC.unknown;
  }
  X_AC.unspecified = X_AB.unspecified || X_BC.unspecified;
  return X_AC;
}

Transform collapse(const Belief& X_AB) {
  Covariance known = X_AB.own;
  if (!X_AB.common_errors.empty()) {
    known = Covariance::trusted(
        nearest_semidefinite(X_AB.own.matrix() + second_moment(X_AB.common_errors)));
  }
  StatedCovariance stated = X_AB.unknown ? bound(known, *X_AB.unknown) : known;
  stated.set_complete(!X_AB.unspecified);
  return {X_AB.pose, stated};
}

Covariance bound(const Covariance& A, const Covariance& B) {
  const auto trace = [](const Covariance& S, std::size_t first) {
    double sum = 0;
    for (std::size_t i = first; i < first + 3; ++i) sum += S.upper()[upper_index(i, i)];
    return sum;
  };
  double a = 0;
  double b = 0;
  for (const std::size_t first : {std::size_t{0}, std::size_t{3}}) {
    const double of_a = trace(A, first);
    const double of_b = trace(B, first);
    if (of_a + of_b <= 0) continue;
    a += of_a / (of_a + of_b);
    b += of_b / (of_a + of_b);
  }
  if (a <= 0 || b <= 0) return A + B;
  const double root = std::sqrt(b / a);
  Covariance::Upper sum{};
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum[i] = (1.0 + root) * A.upper()[i] + (1.0 + 1.0 / root) * B.upper()[i];
  }
  return Covariance::trusted(sum);
}

Result<void> check_common_errors(const std::vector<CommonError>& common_errors) {
  if (common_errors.size() > kMaxCommonErrors) {
    return fail(Errc::kInvalidInput, std::to_string(common_errors.size()) +
                                         " sources, of at most " +
                                         std::to_string(kMaxCommonErrors));
  }
  for (const CommonError& common_error : common_errors) {
    if (auto ok = check_id(common_error.source, "source"); !ok) return ok;
    const std::string who = "source " + quote(common_error.source) + ": ";
    if (columns(common_error) < 1 || columns(common_error) > kMaxLoadingColumns) {
      return fail(Errc::kInvalidInput, who + "a loading has 1 to " +
                                           std::to_string(kMaxLoadingColumns) + " columns, not " +
                                           std::to_string(columns(common_error)));
    }
    if (!common_error.loading.allFinite() ||
        common_error.loading.cwiseAbs().maxCoeff() > std::sqrt(kMaxVariance)) {
      return fail(Errc::kInvalidInput,
                  who + "an element of its loading is not a number, or beyond 1e9");
    }
    const auto same = [&](const CommonError& other) { return same_source(other, common_error); };
    if (std::count_if(common_errors.begin(), common_errors.end(), same) > 1) {
      return fail(Errc::kInvalidInput, who + "named twice");
    }
  }
  return {};
}

}  // namespace tfdude
