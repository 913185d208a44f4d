#include "math/moments.hpp"

namespace tfdude {
namespace {

using Matrix3d = Eigen::Matrix3d;

Matrix3d rho_rho(const Matrix6d& m) { return m.topLeftCorner<3, 3>(); }
Matrix3d rho_theta(const Matrix6d& m) { return m.topRightCorner<3, 3>(); }
Matrix3d theta_rho(const Matrix6d& m) { return m.bottomLeftCorner<3, 3>(); }
Matrix3d theta_theta(const Matrix6d& m) { return m.bottomRightCorner<3, 3>(); }

// E[u× v×] for E[u vᵀ] = N.
Matrix3d product_of_crosses(const Matrix3d& N) {
  return N.transpose() - N.trace() * Matrix3d::Identity();
}

// E[u × v] for E[u vᵀ] = N.
Eigen::Vector3d mean_cross(const Matrix3d& N) {
  return {N(1, 2) - N(2, 1), N(2, 0) - N(0, 2), N(0, 1) - N(1, 0)};
}

// E[(a × u) (b × v)ᵀ] for (a, b) independent of (u, v), with E[a bᵀ] = N and E[u vᵀ] = M: the
// tensor cross product of both matrices, ε_pij ε_qkl N_ik M_jl.
Matrix3d cross(const Matrix3d& N, const Matrix3d& M) {
  Matrix3d product;
  for (int p = 0; p < 3; ++p) {
    for (int q = 0; q < 3; ++q) {
      const int i = (p + 1) % 3;
      const int j = (p + 2) % 3;
      const int k = (q + 1) % 3;
      const int l = (q + 2) % 3;
      product(p, q) = N(i, k) * M(j, l) - N(i, l) * M(j, k) - N(j, k) * M(i, l) + N(j, l) * M(i, k);
    }
  }
  return product;
}

}  // namespace

Matrix6d product_of_adjoints(const Matrix6d& J_ij) {
  Matrix6d product = Matrix6d::Zero();
  product.topLeftCorner<3, 3>() = product_of_crosses(theta_theta(J_ij));
  product.bottomRightCorner<3, 3>() = product.topLeftCorner<3, 3>();
  product.topRightCorner<3, 3>() =
      product_of_crosses(theta_rho(J_ij)) + product_of_crosses(rho_theta(J_ij));
  return product;
}

Twist mean_bracket(const Matrix6d& J_12) {
  Twist mean;
  mean << mean_cross(theta_rho(J_12)) + mean_cross(rho_theta(J_12)), mean_cross(theta_theta(J_12));
  return mean;
}

// Since [a, u] = (θa × ρu + ρa × θu, θa × θu).
Matrix6d bracket_moment(const Matrix6d& N, const Matrix6d& M) {
  Matrix6d moment;
  moment.topLeftCorner<3, 3>() =
      cross(theta_theta(N), rho_rho(M)) + cross(theta_rho(N), rho_theta(M)) +
      cross(rho_theta(N), theta_rho(M)) + cross(rho_rho(N), theta_theta(M));
  moment.topRightCorner<3, 3>() =
      cross(theta_theta(N), rho_theta(M)) + cross(rho_theta(N), theta_theta(M));
  moment.bottomLeftCorner<3, 3>() =
      cross(theta_theta(N), theta_rho(M)) + cross(theta_rho(N), theta_theta(M));
  moment.bottomRightCorner<3, 3>() = cross(theta_theta(N), theta_theta(M));
  return moment;
}

Matrix6d bracket_second_moment(const Matrix6d& J_11, const Matrix6d& J_22, const Matrix6d& J_12) {
  Matrix6d moment = bracket_moment(J_11, J_22);
  if (J_12.isZero(0)) return moment;
  const Twist mean = mean_bracket(J_12);
  moment += mean * mean.transpose();
  // Pairs ξ1 of the first bracket with ξ2 of the second, and vice versa: [v, b] = -[b, v].
  moment -= bracket_moment(J_12, J_12.transpose());
  return moment;
}

}  // namespace tfdude
