#include "math/joint_update.hpp"

#include <algorithm>
#include <utility>

#include "math/decompositions.hpp"
#include "math/square_root.hpp"

namespace tfdude {
namespace {

using Matrix = Eigen::MatrixXd;

constexpr Eigen::Index kRows = 6;

// Columns with six rows of what is measured above those of all blocks.
struct Array {
  Matrix top;    // 6 x k
  Matrix below;  // 6n x k
};

// Reflections 1 - V T Vᵀ of columns, after which those beyond the first few have nothing on top
// (LAPACK's larft).
struct Reflections {
  Matrix V;
  Matrix T;

  explicit Reflections(const Matrix& top) {
    const auto qr = qr_of(top.transpose());
    const Eigen::Index count = std::min(top.rows(), top.cols());
    V = qr.matrixQR().leftCols(count).triangularView<Eigen::UnitLower>();
    T = Matrix::Zero(count, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const double tau = qr.hCoeffs()[i];
      T(i, i) = tau;
      T.col(i).head(i) = -tau * (T.topLeftCorner(i, i) * (V.leftCols(i).transpose() * V.col(i)));
    }
  }
};

// Turns the columns of both so that `more` has nothing on top.
void turn(Array& seen, Array& more) {
  const Eigen::Index moved = std::min(kRows - seen.top.cols(), more.top.cols());
  if (moved > 0) {
    const auto move = [&](Matrix& to, Matrix& from) {
      to.conservativeResize(Eigen::NoChange, to.cols() + moved);
      to.rightCols(moved) = from.leftCols(moved);
      from = from.rightCols(from.cols() - moved).eval();
    };
    move(seen.top, more.top);
    move(seen.below, more.below);
  }
  const Eigen::Index first = seen.top.cols();
  const Eigen::Index rest = more.top.cols();
  Matrix top(kRows, first + rest);
  top << seen.top, more.top;
  const Reflections Q(top);
  const auto V_seen = Q.V.topRows(first);
  const auto V_more = Q.V.bottomRows(rest);
  const auto reflect = [&](Matrix& a, Matrix& b) {
    const Matrix along = (a * V_seen + b * V_more) * Q.T;
    a.noalias() -= along * V_seen.transpose();
    b.noalias() -= along * V_more.transpose();
  };
  reflect(seen.top, more.top);
  reflect(seen.below, more.below);
}

// The block whose own part stays one: that on which most columns depend, as it has been measured
// with the most others. It will be again, and may have a new own part by then.
std::vector<std::size_t> measured_blocks(const std::vector<Loading>& own_roots, const Matrix& F,
                                         const std::vector<Matrix6d>& H) {
  std::vector<std::pair<Eigen::Index, std::size_t>> found;
  for (std::size_t i = 0; i < own_roots.size(); ++i) {
    if (own_roots[i].cols() == 0 || H[i].isZero(0)) continue;
    const auto rows = F.middleRows(kRows * static_cast<Eigen::Index>(i), kRows);
    Eigen::Index columns = 0;
    for (const auto& column : rows.colwise()) columns += column.isZero(0) ? 0 : 1;
    found.emplace_back(-columns, i);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& one, const auto& other) { return one.first < other.first; });
  std::vector<std::size_t> blocks;
  blocks.reserve(found.size());
  for (const auto& one : found) blocks.push_back(one.second);
  return blocks;
}

}  // namespace

MeasuredJoint measured_joint(const std::vector<Loading>& own_roots, Matrix F,
                             const std::vector<Matrix6d>& H, const Loading& R) {
  const auto row = [](std::size_t i) { return kRows * static_cast<Eigen::Index>(i); };
  const Eigen::Index rows = row(own_roots.size());
  MeasuredJoint found;
  for (const Loading& root : own_roots) found.own.push_back(square_of(root));
  Array seen{R, Matrix::Zero(rows, R.cols())};
  std::vector<Matrix> added;
  bool first = true;
  for (const std::size_t i : measured_blocks(own_roots, F, H)) {
    Array own{H[i] * own_roots[i], Matrix::Zero(rows, own_roots[i].cols())};
    own.below.middleRows(row(i), kRows) = own_roots[i];
    turn(seen, own);
    found.own[i].setZero();
    if (first) {
      // Nothing of another block has been turned into it.
      const auto rest = own.below.middleRows(row(i), kRows);
      found.own[i] = rest * rest.transpose();
    } else {
      added.push_back(std::move(own.below));
    }
    first = false;
  }
  Array shared{Matrix::Zero(kRows, F.cols()), std::move(F)};
  for (std::size_t i = 0; i < H.size(); ++i) {
    if (!H[i].isZero(0)) shared.top += H[i] * shared.below.middleRows(row(i), kRows);
  }
  turn(seen, shared);
  Eigen::Index columns = shared.below.cols();
  found.F = std::move(shared.below);
  for (const Matrix& one : added) {
    found.F.conservativeResize(Eigen::NoChange, columns + one.cols());
    found.F.rightCols(one.cols()) = one;
    columns += one.cols();
  }
  found.seen.resize(kRows + rows, seen.top.cols());
  found.seen << seen.top, seen.below;
  return found;
}

}  // namespace tfdude
