#include "tfdude/math/belief.hpp"

#include <algorithm>
#include <cmath>

#include "tfdude/base/id.hpp"

#include "math/moments.hpp"
#include "math/semidefinite.hpp"
#include "math/shares.hpp"

namespace tfdude {
namespace {

using Shares = std::vector<Share>;

Eigen::Index columns(const Share& share) { return share.factor.cols(); }

void add_padded(Factor& sum, const Factor& more) {
  widen(sum, more.cols());
  sum.leftCols(more.cols()) += more;
}

template <class List>
auto of_same_source(List& shares, const Share& share) -> decltype(shares.data()) {
  const auto found = std::find_if(shares.begin(), shares.end(),
                                  [&](const Share& other) { return same_source(other, share); });
  return found == shares.end() ? nullptr : &*found;
}

Shares sum_of(Shares sum, const Shares& more) {
  for (const Share& share : more) {
    if (Share* same = of_same_source(sum, share)) {
      add_padded(same->factor, share.factor);
    } else {
      sum.push_back(share);
    }
  }
  return sum;
}

Shares product(const Matrix6d& matrix, Shares shares) {
  for (Share& share : shares) share.factor = (matrix * share.factor).eval();
  return shares;
}

// Σ ± F Fᵀ.
Matrix6d second_moment(const Shares& shares) {
  Matrix6d sum = Matrix6d::Zero();
  for (const Share& share : shares) {
    const Matrix6d one = share.factor * share.factor.transpose();
    sum += share.subtracts ? Matrix6d(-one) : one;
  }
  return sum;
}

// Σ ± F1 F2ᵀ over the sources of both.
Matrix6d joint_moment(const Shares& first, const Shares& second) {
  Matrix6d sum = Matrix6d::Zero();
  for (const Share& one : first) {
    const Share* other = of_same_source(second, one);
    if (other == nullptr) continue;
    const Eigen::Index common = std::min(columns(one), columns(*other));
    const Matrix6d both = one.factor.leftCols(common) * other->factor.leftCols(common).transpose();
    sum += one.subtracts ? Matrix6d(-both) : both;
  }
  return sum;
}

// What both have in the frame of the last: X_AC as if known exactly, and the two errors there.
struct Errors {
  Covariance own[2];
  Shares shares[2];
};

Covariance add_fourth(const Errors& e, Shares& shares) {
  const Matrix6d own_1 = e.own[0].matrix();
  const Matrix6d own_2 = e.own[1].matrix();
  const Matrix6d J_11 = own_1 + second_moment(e.shares[0]);
  const Matrix6d J_22 = own_2 + second_moment(e.shares[1]);
  const Matrix6d J_12 = joint_moment(e.shares[0], e.shares[1]);
  // The terms of third order, ([ξ1, [ξ1, ξ2]] + [ξ2, [ξ2, ξ1]]) / 12, have with any z the moment D1 E[ξ1 zᵀ] + D2 E[ξ2 zᵀ],
  // D the mean of their derivatives (Stein's lemma).
  const Matrix6d P_12 = product_of_adjoints(J_12);
  const Matrix6d P_21 = product_of_adjoints(J_12.transpose());
  const Matrix6d D_1 = (product_of_adjoints(J_22) + P_21 - 2.0 * P_12) / 12.0;
  const Matrix6d D_2 = (product_of_adjoints(J_11) + P_12 - 2.0 * P_21) / 12.0;
  const Matrix6d brackets = bracket_second_moment(J_11, J_22, J_12) / 4.0;
  shares = sum_of(product(Matrix6d::Identity() + D_1, e.shares[0]),
                  product(Matrix6d::Identity() + D_2, e.shares[1]));
  // Of what the shares have of it, their product has all but terms of sixth order.
  const Matrix6d cubic = D_1 * own_1 + D_2 * own_2;
  const Matrix6d series = own_1 + own_2 + brackets + cubic + cubic.transpose();
  if (is_semidefinite(series)) return Covariance::trusted(series);
  return Covariance::trusted(
      Matrix6d(series + D_1 * own_1 * D_1.transpose() + D_2 * own_2 * D_2.transpose()));
}

}  // namespace

bool is_observed(const Share& share) { return share.source.rfind(kObservedPrefix, 0) == 0; }

Belief inverse(const Belief& X_AB) {
  Belief X_BA;
  X_BA.pose = X_AB.pose.inverse();
  X_BA.own = X_AB.own.transported(X_AB.pose);
  if (X_AB.unknown) X_BA.unknown = X_AB.unknown->transported(X_AB.pose);
  if (!X_AB.shares.empty()) X_BA.shares = product(-adjoint(X_AB.pose), X_AB.shares);
  return X_BA;
}

Belief compose(const Belief& X_AB, const Belief& X_BC, Order order) {
  const Pose X_CB = X_BC.pose.inverse();
  Belief X_AC;
  X_AC.pose = X_AB.pose * X_BC.pose;
  Errors e{{X_AB.own.transported(X_CB), X_BC.own}, {{}, X_BC.shares}};
  if (!X_AB.shares.empty()) e.shares[0] = product(adjoint(X_CB), X_AB.shares);
  if (order == Order::kFourth) {
    X_AC.own = add_fourth(e, X_AC.shares);
  } else {
    X_AC.own = e.own[0] + e.own[1];
    X_AC.shares = sum_of(std::move(e.shares[0]), e.shares[1]);
  }
  if (X_AB.unknown) X_AC.unknown = X_AB.unknown->transported(X_CB);
  if (X_BC.unknown) {
    X_AC.unknown = X_AC.unknown ? bound(*X_AC.unknown, *X_BC.unknown) : *X_BC.unknown;
  }
  return X_AC;
}

Transform collapse(const Belief& X_AB) {
  Covariance known = X_AB.own;
  if (!X_AB.shares.empty()) {
    known =
        Covariance::trusted(nearest_semidefinite(X_AB.own.matrix() + second_moment(X_AB.shares)));
  }
  return {X_AB.pose, X_AB.unknown ? bound(known, *X_AB.unknown) : known};
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

Result<void> check_shares(const std::vector<Share>& shares) {
  if (shares.size() > kMaxShares) {
    return fail(Errc::kInvalidInput, std::to_string(shares.size()) + " sources, of at most " +
                                         std::to_string(kMaxShares));
  }
  for (const Share& share : shares) {
    if (auto ok = check_id(share.source, "source"); !ok) return ok;
    const std::string who = "source " + quote(share.source) + ": ";
    if (columns(share) < 1 || columns(share) > kMaxFactorColumns) {
      return fail(Errc::kInvalidInput, who + "a factor has 1 to " +
                                           std::to_string(kMaxFactorColumns) + " columns, not " +
                                           std::to_string(columns(share)));
    }
    if (!share.factor.allFinite() || share.factor.cwiseAbs().maxCoeff() > std::sqrt(kMaxVariance)) {
      return fail(Errc::kInvalidInput,
                  who + "an element of its factor is not a number, or beyond 1e9");
    }
    const auto same = [&](const Share& other) { return same_source(other, share); };
    if (std::count_if(shares.begin(), shares.end(), same) > 1) {
      return fail(Errc::kInvalidInput, who + "named twice");
    }
  }
  return {};
}

}  // namespace tfdude
