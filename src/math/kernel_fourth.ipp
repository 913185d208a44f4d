// Included at the end of kernel_body.ipp: what fourth order adds to the covariance of a product.

// A 3x3 matrix in columns.
struct Mat {
  V4 column[3];
};
inline Mat operator+(const Mat& a, const Mat& b) {
  return {{a.column[0] + b.column[0], a.column[1] + b.column[1], a.column[2] + b.column[2]}};
}
inline Mat operator*(double k, const Mat& a) {
  return {{k * a.column[0], k * a.column[1], k * a.column[2]}};
}

inline Mat operator*(const Mat& a, const Mat& b) {
  const Numbers m(b.column);
  Mat product;
  for (int j = 0; j < 3; ++j) {
    product.column[j] = combine(a.column, m.of[j][0], m.of[j][1], m.of[j][2]);
  }
  return product;
}

inline Mat transposed(const Mat& a) {
  const Numbers m(a.column);
  Mat turned;
  for (int j = 0; j < 3; ++j) turned.column[j] = V4{m.of[0][j], m.of[1][j], m.of[2][j]};
  return turned;
}

// E[ξi ξjᵀ] of ξ = (ρ, θ), in blocks.
struct Moment {
  Mat rho_rho, rho_theta, theta_rho, theta_theta;
};
inline Moment operator+(const Moment& a, const Moment& b) {
  return {a.rho_rho + b.rho_rho, a.rho_theta + b.rho_theta, a.theta_rho + b.theta_rho,
          a.theta_theta + b.theta_theta};
}
inline Moment operator*(double k, const Moment& a) {
  return {k * a.rho_rho, k * a.rho_theta, k * a.theta_rho, k * a.theta_theta};
}
inline Moment transposed(const Moment& a) {
  return {transposed(a.rho_rho), transposed(a.theta_rho), transposed(a.rho_theta),
          transposed(a.theta_theta)};
}

inline Moment moment_of_upper(const double* u) {
  Moment J;
  J.rho_rho = {{V4{u[0], u[1], u[2]}, V4{u[1], u[6], u[7]}, V4{u[2], u[7], u[11]}}};
  for (int j = 0; j < 3; ++j) J.rho_theta.column[j] = V4{u[3 + j], u[8 + j], u[12 + j]};
  J.theta_rho = {{V4{u[3], u[4], u[5]}, V4{u[8], u[9], u[10]}, V4{u[12], u[13], u[14]}}};
  J.theta_theta = {{V4{u[15], u[16], u[17]}, V4{u[16], u[18], u[19]}, V4{u[17], u[19], u[20]}}};
  return J;
}

inline Moment moment_of_columns(const double* m) {
  Moment J;
  for (int j = 0; j < 3; ++j) {
    const double* left = m + 6 * j;
    const double* right = left + 18;
    J.rho_rho.column[j] = V4{left[0], left[1], left[2]};
    J.theta_rho.column[j] = V4{left[3], left[4], left[5]};
    J.rho_theta.column[j] = V4{right[0], right[1], right[2]};
    J.theta_theta.column[j] = V4{right[3], right[4], right[5]};
  }
  return J;
}

// E[u× v×] for E[u vᵀ] = N.
inline Mat product_of_crosses(const Mat& N) {
  const double trace = N.column[0][0] + N.column[1][1] + N.column[2][2];
  return transposed(N) + -trace * Mat{{V4{1, 0, 0, 0}, V4{0, 1, 0, 0}, V4{0, 0, 1, 0}}};
}

// [M, N; 0, M], the form of E[ad(ξi) ad(ξj)].
struct Form {
  Mat M, N;
};

inline Form product_of_adjoints(const Moment& J) {
  return {product_of_crosses(J.theta_theta), product_of_crosses(J.theta_rho + J.rho_theta)};
}

inline Moment operator*(const Form& D, const Moment& J) {
  return {D.M * J.rho_rho + D.N * J.theta_rho, D.M * J.rho_theta + D.N * J.theta_theta,
          D.M * J.theta_rho, D.M * J.theta_theta};
}

// E[(a × u) (b × v)ᵀ] for (a, b) independent of (u, v), with E[a bᵀ] = N and E[u vᵀ] = M: the
// tensor cross product of both matrices, whose columns are N_k × M_l - N_l × M_k. Without the last
// turn of the lanes.
inline Mat half_crossed(const Mat& N, const Mat& M) {
  Mat product;
  for (int q = 0; q < 3; ++q) {
    const int k = (q + 1) % 3;
    const int l = (q + 2) % 3;
    product.column[q] =
        N.column[k] * turn_lanes(M.column[l]) - turn_lanes(N.column[k]) * M.column[l] -
        N.column[l] * turn_lanes(M.column[k]) + turn_lanes(N.column[l]) * M.column[k];
  }
  return product;
}
inline Mat turned(const Mat& a) {
  return {{turn_lanes(a.column[0]), turn_lanes(a.column[1]), turn_lanes(a.column[2])}};
}

// E[[a, u] [b, v]ᵀ] for (a, b) independent of (u, v), with E[a bᵀ] = N and E[u vᵀ] = M, since
// [a, u] = (θa × ρu + ρa × θu, θa × θu). It is symmetric for all pairs used here; its lower left
// block is left out.
inline Moment bracket_moment(const Moment& N, const Moment& M) {
  return {
      turned(half_crossed(N.theta_theta, M.rho_rho) + half_crossed(N.theta_rho, M.rho_theta) +
             half_crossed(N.rho_theta, M.theta_rho) + half_crossed(N.rho_rho, M.theta_theta)),
      turned(half_crossed(N.theta_theta, M.rho_theta) + half_crossed(N.rho_theta, M.theta_theta)),
      Mat{}, turned(half_crossed(N.theta_theta, M.theta_theta))};
}

// E[u × v] for E[u vᵀ] = N, as numbers.
inline V4 mean_cross(const Mat& N) {
  const Numbers n(N.column);
  return V4{n.of[2][1] - n.of[1][2], n.of[0][2] - n.of[2][0], n.of[1][0] - n.of[0][1]};
}

inline Mat outer(V4 a, V4 b) { return {{a * b[0], a * b[1], a * b[2]}}; }

// E[[ξ1, ξ2] [ξ1, ξ2]ᵀ] by Isserlis' theorem, less the part for independent ones: the part of the
// mean, and the pairing of ξ1 of the first bracket with ξ2 of the second: [v, b] = -[b, v].
inline Moment correlated_brackets(const Moment& J_12, const Moment& J_21) {
  const V4 rho = mean_cross(J_12.theta_rho + J_12.rho_theta);
  const V4 theta = mean_cross(J_12.theta_theta);
  const Moment mean{outer(rho, rho), outer(rho, theta), Mat{}, outer(theta, theta)};
  return mean + -1.0 * bracket_moment(J_12, J_21);
}

inline void store(double columns[3][4], const Mat& a) {
  for (int j = 0; j < 3; ++j) store(columns[j], a.column[j]);
}

// The terms of third order are ([ξ1, [ξ1, ξ2]] + [ξ2, [ξ2, ξ1]]) / 12. Their moment with any z is
// D1 E[ξ1 zᵀ] + D2 E[ξ2 zᵀ], with D the mean of their derivatives (Stein's lemma).
void add_fourth(Fourth& terms) {
  const Moment own_1 = moment_of_upper(terms.own[0]);
  const Moment own_2 = moment_of_upper(terms.own[1]);
  const Moment J_11 = moment_of_upper(terms.all[0]);
  const Moment J_22 = moment_of_upper(terms.all[1]);
  Moment brackets = bracket_moment(J_11, J_22);
  Moment at_1 = J_22;
  Moment at_2 = J_11;
  if (terms.joint != nullptr) {
    const Moment J_12 = moment_of_columns(terms.joint);
    const Moment J_21 = transposed(J_12);
    brackets = brackets + correlated_brackets(J_12, J_21);
    at_1 = at_1 + J_21 + -2.0 * J_12;
    at_2 = at_2 + J_12 + -2.0 * J_21;
  }
  const Form D_1 = product_of_adjoints((1.0 / 12) * at_1);
  const Form D_2 = product_of_adjoints((1.0 / 12) * at_2);
  store(terms.M[0], D_1.M);
  store(terms.N[0], D_1.N);
  store(terms.M[1], D_2.M);
  store(terms.N[1], D_2.N);
  // What is added to its transpose.
  const Moment half = D_1 * own_1 + D_2 * own_2;
  const Moment whole = own_1 + own_2 + 0.25 * brackets;
  Blocks sum;
  store(sum.P, half.rho_rho + 0.5 * whole.rho_rho);
  store(sum.C, whole.rho_theta + half.rho_theta + transposed(half.theta_rho));
  store(sum.Q, whole.theta_theta + half.theta_theta + transposed(half.theta_theta));
  store_upper(sum, terms.sum);
}
