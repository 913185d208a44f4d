#include "math/symmetric_eigen.hpp"

#include <Eigen/Eigenvalues>

namespace tfdude {

SymmetricEigen symmetric_eigen(const Matrix6d& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace tfdude
