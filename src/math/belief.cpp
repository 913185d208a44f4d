#include "tfdude/math/belief.hpp"

#include <algorithm>
#include <cmath>

#include "tfdude/base/id.hpp"

#include "math/bound_weights.hpp"
#include "math/common_errors.hpp"
#include "math/instant_sources.hpp"
#include "math/kernel.hpp"
#include "math/semidefinite.hpp"
#include "math/square_root.hpp"

namespace tfdude {
namespace {

using CommonErrors = std::vector<CommonError>;

Eigen::Index columns(const CommonError& common_error) { return common_error.loading.cols(); }

void add_padded(Loading& sum, const Loading& more) {
  widen(sum, more.cols());
  sum.leftCols(more.cols()) += more;
}

CommonErrors product(const Matrix6d& matrix, CommonErrors common_errors) {
  for (CommonError& common_error : common_errors) {
    for (auto column : common_error.loading.colwise()) column = Twist(matrix * column);
  }
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
struct FactorErrors {
  const Covariance& own_1;
  const Covariance& own_2;
  CommonErrors common_errors_1;
  const CommonErrors& common_errors_2;
};

bool any_subtracts(const CommonErrors& common_errors) {
  return std::any_of(common_errors.begin(), common_errors.end(),
                     [](const CommonError& one) { return one.subtracts; });
}

// Of own parts and common errors.
Covariance whole(const Covariance& own, const CommonErrors& common_errors) {
  if (common_errors.empty()) return own;
  return own + Covariance::trusted(second_moment(common_errors));
}

// D of the error with that number.
Matrix6d derivative(const kernel::Fourth& terms, std::size_t i) {
  using Block = Eigen::Map<const Eigen::Matrix3d, 0, Eigen::OuterStride<4>>;
  Matrix6d D = Matrix6d::Zero();
  D.topLeftCorner<3, 3>() = Block(terms.M[i][0]);
  D.topRightCorner<3, 3>() = Block(terms.N[i][0]);
  D.bottomRightCorner<3, 3>() = Block(terms.M[i][0]);
  return D;
}

// @return the own part of the product
Covariance add_fourth(FactorErrors&& e, CommonErrors& common_errors) {
  const Covariance J_11 = whole(e.own_1, e.common_errors_1);
  const Covariance J_22 = whole(e.own_2, e.common_errors_2);
  Matrix6d J_12;
  Covariance::Upper series;
  kernel::Fourth terms{{e.own_1.upper().data(), e.own_2.upper().data()},
                       {J_11.upper().data(), J_22.upper().data()}};
  terms.sum = series.data();
  if (!e.common_errors_1.empty() && !e.common_errors_2.empty()) {
    J_12 = joint_moment(e.common_errors_1, e.common_errors_2);
    terms.joint = J_12.data();
  }
  kernel::functions().add_fourth(terms);
  const bool subtracts = any_subtracts(e.common_errors_1) || any_subtracts(e.common_errors_2);
  const auto carried = [&](std::size_t i, CommonErrors errors) {
    if (errors.empty()) return errors;
    return product(Matrix6d::Identity() + derivative(terms, i), std::move(errors));
  };
  // For the part due to the common errors, their product contains all but terms of sixth order.
  common_errors = carried(0, std::move(e.common_errors_1));
  add_errors(carried(1, e.common_errors_2), common_errors);
  const Covariance sum = Covariance::trusted(series);
  // Columns that subtract cancel own parts. So these must go the same way, with that term, too.
  if (!subtracts && is_semidefinite(sum)) return sum;
  const auto sixth = [&](std::size_t i, const Covariance& own) {
    const Matrix6d D = derivative(terms, i);
    return Covariance::trusted(Matrix6d(D * own.matrix() * D.transpose()));
  };
  return sum + sixth(0, e.own_1) + sixth(1, e.own_2);
}

// Of own parts and common errors of which some subtract.
Matrix6d difference(const Covariance& own, const CommonErrors& common_errors) {
  Matrix6d sum = own.matrix();
  Twist variances = sum.diagonal();
  for (const CommonError& one : common_errors) variances += one.loading.rowwise().squaredNorm();
  sum += second_moment(common_errors);
  if (is_clear_difference(Covariance::trusted(sum), variances)) return sum;
  Loading adds = root_of(own.matrix());
  Loading subtracts(6, 0);
  for (const CommonError& one : common_errors) {
    Loading& side = one.subtracts ? subtracts : adds;
    side = joined(side, one.loading);
  }
  const Loading root = root_of_difference(adds, subtracts);
  return root * root.transpose();
}

// Of translation, or of rotation.
double trace(const Covariance& S, std::size_t first) {
  double sum = 0;
  for (std::size_t i = first; i < first + 3; ++i) sum += S.upper()[upper_index(i, i)];
  return sum;
}

Matrix6d sum_of(const Covariance& own, const CommonErrors& common_errors) {
  if (any_subtracts(common_errors)) return difference(own, common_errors);
  return nearest_semidefinite(own.matrix() + second_moment(common_errors));
}

}  // namespace

void add_errors(const CommonErrors& more, CommonErrors& sum) {
  for (const CommonError& common_error : more) {
    if (CommonError* same = of_same_source(sum, common_error)) {
      add_padded(same->loading, common_error.loading);
    } else {
      sum.push_back(common_error);
    }
  }
}

bool is_observed(const CommonError& common_error) {
  return is_made(common_error.source) && !is_of_two_samples(common_error.source);
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
  const Covariance own_1 = X_AB.own.transported(X_CB);
  CommonErrors common_errors_1;
  if (!X_AB.common_errors.empty()) {
    common_errors_1 = product(adjoint(X_CB), X_AB.common_errors);
  }
  if (order == Order::kFourth) {
    X_AC.own = add_fourth({own_1, X_BC.own, std::move(common_errors_1), X_BC.common_errors},
                          X_AC.common_errors);
  } else {
    X_AC.own = own_1 + X_BC.own;
    X_AC.common_errors = std::move(common_errors_1);
    add_errors(X_BC.common_errors, X_AC.common_errors);
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
    const bool of_instants = has_instants(X_AB.common_errors);
    CommonErrors wider = of_instants ? X_AB.common_errors : CommonErrors();
    if (of_instants) allow_any_relation(wider);
    known = Covariance::trusted(sum_of(X_AB.own, of_instants ? wider : X_AB.common_errors));
  }
  StatedCovariance stated = X_AB.unknown ? bound(known, *X_AB.unknown) : known;
  stated.set_complete(!X_AB.unspecified);
  return {X_AB.pose, stated};
}

BoundWeights bound_weights(const Covariance& A, const Covariance& B) {
  double a = 0;
  double b = 0;
  for (const std::size_t first : {std::size_t{0}, std::size_t{3}}) {
    const double of_a = trace(A, first);
    const double of_b = trace(B, first);
    if (of_a + of_b <= 0) continue;
    a += of_a / (of_a + of_b);
    b += of_b / (of_a + of_b);
  }
  if (a <= 0 || b <= 0) return {1.0, 1.0};
  const double root = std::sqrt(b / a);
  return {1.0 + root, 1.0 + 1.0 / root};
}

std::vector<double> bound_weights(const std::vector<Covariance>& all) {
  std::vector<double> roots(all.size(), 0.0);
  for (const std::size_t first : {std::size_t{0}, std::size_t{3}}) {
    double sum = 0;
    for (const Covariance& one : all) sum += trace(one, first);
    if (sum <= 0) continue;
    for (std::size_t k = 0; k < all.size(); ++k) roots[k] += trace(all[k], first) / sum;
  }
  double sum = 0;
  for (double& one : roots) {
    one = std::sqrt(one);
    sum += one;
  }
  for (double& one : roots) one = one > 0 ? sum / one : 1.0;
  return roots;
}

Covariance bound(const Covariance& A, const Covariance& B) {
  const BoundWeights weights = bound_weights(A, B);
  Covariance::Upper sum{};
  for (std::size_t i = 0; i < sum.size(); ++i) {
    sum[i] = weights.of_A * A.upper()[i] + weights.of_B * B.upper()[i];
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
