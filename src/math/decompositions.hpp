#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include "tfdude/math/pose.hpp"

// Of matrices. In a file of their own, as the compiler needs seconds for each wherever it is used.
namespace tfdude {

/// By Householder's reflections.
[[nodiscard]] Eigen::HouseholderQR<Eigen::MatrixXd> qr_of(const Eigen::MatrixXd& A);

/// The first columns of Q, as many as A has rows or columns, whichever are fewer.
[[nodiscard]] Eigen::MatrixXd thin_q(const Eigen::HouseholderQR<Eigen::MatrixXd>& qr);

/// Eigenvalues, ascending, and vectors of a symmetric matrix; it must not be empty.
[[nodiscard]] Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_of(
    const Eigen::MatrixXd& symmetric);

/// Those of A diag(d) Aᵀ.
[[nodiscard]] Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_of(const Eigen::MatrixXd& A,
                                                                      const Eigen::VectorXd& d);

/// Of a matrix that has one.
[[nodiscard]] Matrix6d inverse_of(const Matrix6d& A);

}  // namespace tfdude
