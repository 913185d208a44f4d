// Included by kernel.cpp once per instruction set. GCC lowers the vectors below to the instructions
// available when it parses a function, so one body cannot be inlined into both.

// Σ_k m_k x_k, the columns of m weighted by a column of numbers.
inline V4 combine(const V4* m, double x0, double x1, double x2) {
  return m[0] * x0 + m[1] * x1 + m[2] * x2;
}

inline V4 turn_lanes(V4 a) { return __builtin_shufflevector(a, a, 1, 2, 0, 3); }

inline V4 cross(V4 a, V4 b) { return turn_lanes(a * turn_lanes(b) - turn_lanes(a) * b); }

inline V4 load(const double* column) { return *reinterpret_cast<const V4*>(column); }

inline void store(double* column, V4 value) { *reinterpret_cast<V4*>(column) = value; }

inline void add(double* column, V4 value) { store(column, load(column) + value); }

// Numbers of the columns of a 3x3 matrix, through memory: loads that broadcast a number to all
// lanes are free, shuffles are not.
struct Numbers {
  alignas(32) double of[3][4];

  explicit Numbers(const V4* m) {
    for (int k = 0; k < 3; ++k) store(of[k], m[k]);
  }
  // m times row j, transposed.
  V4 times_row(const V4* m, int j) const { return combine(m, of[0][j], of[1][j], of[2][j]); }
};

// Products of a matrix with the blocks of a covariance; of P and Q also with the upper triangle
// that has half the diagonal, whose sum with its transpose is the block.
inline void times_half_P(const V4* m, const double* u, V4* product) {
  product[0] = m[0] * (0.5 * u[0]);
  product[1] = m[0] * u[1] + m[1] * (0.5 * u[6]);
  product[2] = combine(m, u[2], u[7], 0.5 * u[11]);
}
inline void times_half_Q(const V4* m, const double* u, V4* product) {
  product[0] = m[0] * (0.5 * u[15]);
  product[1] = m[0] * u[16] + m[1] * (0.5 * u[18]);
  product[2] = combine(m, u[17], u[19], 0.5 * u[20]);
}
inline void times_C(const V4* m, const double* u, V4* product) {
  for (int j = 0; j < 3; ++j) product[j] = combine(m, u[3 + j], u[8 + j], u[12 + j]);
}
inline void times_Q(const V4* m, const double* u, V4* product) {
  product[0] = combine(m, u[15], u[16], u[17]);
  product[1] = combine(m, u[16], u[18], u[19]);
  product[2] = combine(m, u[17], u[19], u[20]);
}

// A pose in columns.
struct Motion {
  V4 R[3];
  V4 t;
};

inline Motion load(const Columns& X) {
  return {{load(X.R[0]), load(X.R[1]), load(X.R[2])}, load(X.t)};
}

inline void store(Columns& columns, const Motion& X) {
  for (int k = 0; k < 3; ++k) store(columns.R[k], X.R[k]);
  store(columns.t, X.t);
}

// sum += Ad(X) Σ Ad(X)ᵀ. After the rotation of its blocks, C becomes C + [t]×Q, and P becomes
// P + M + Mᵀ with M = [t]× (C + [t]×Q / 2)ᵀ. 72 products of columns and numbers; with the two full
// products of 6x6 matrices there are 87.
inline void add_transported(const Motion& X, const double* u, Blocks& sum) {
  const Numbers r(X.R);
  alignas(32) double t[4];
  store(t, X.t);
  V4 A[3];
  V4 B[3];
  V4 D[3];
  times_half_P(X.R, u, A);
  times_C(X.R, u, B);
  times_Q(X.R, u, D);
  V4 Y[3];
  for (int j = 0; j < 3; ++j) {
    const V4 Q = r.times_row(D, j);
    const V4 C = r.times_row(B, j);
    const V4 arm = cross(X.t, Q);
    Y[j] = C + 0.5 * arm;
    add(sum.C[j], C + arm);
    add(sum.Q[j], Q);
  }
  add(sum.P[0], r.times_row(A, 0) + (t[1] * Y[2] - t[2] * Y[1]));
  add(sum.P[1], r.times_row(A, 1) + (t[2] * Y[0] - t[0] * Y[2]));
  add(sum.P[2], r.times_row(A, 2) + (t[0] * Y[1] - t[1] * Y[0]));
}

// sum += B Σ Bᵀ for any B = [M, N; 0, M].
inline void add_sandwich(const V4* M, const V4* N, const double* u, Blocks& sum) {
  const Numbers m(M);
  const Numbers n(N);
  V4 A[3];
  V4 B[3];
  V4 NQ[3];
  V4 half_NQ[3];
  V4 D[3];
  times_half_P(M, u, A);
  times_C(M, u, B);
  times_Q(N, u, NQ);
  times_half_Q(N, u, half_NQ);
  times_Q(M, u, D);
  for (int j = 0; j < 3; ++j) {
    half_NQ[j] += B[j];
    B[j] += NQ[j];
  }
  for (int j = 0; j < 3; ++j) {
    add(sum.P[j], m.times_row(A, j) + n.times_row(half_NQ, j));
    add(sum.C[j], m.times_row(B, j));
    add(sum.Q[j], m.times_row(D, j));
  }
}

inline void set(Blocks& sum, const double* u) {
  store(sum.P[0], V4{0.5 * u[0]});
  store(sum.P[1], V4{u[1], 0.5 * u[6]});
  store(sum.P[2], V4{u[2], u[7], 0.5 * u[11]});
  for (int j = 0; j < 3; ++j) store(sum.C[j], V4{u[3 + j], u[8 + j], u[12 + j]});
  store(sum.Q[0], V4{u[15], u[16], u[17]});
  store(sum.Q[1], V4{u[16], u[18], u[19]});
  store(sum.Q[2], V4{u[17], u[19], u[20]});
}

inline void set_zero(Blocks& sum) {
  for (int j = 0; j < 3; ++j) {
    store(sum.P[j], V4{});
    store(sum.C[j], V4{});
    store(sum.Q[j], V4{});
  }
}

inline void store_upper(const Blocks& sum, double* u) {
  int k = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) u[k++] = sum.P[j][i] + sum.P[i][j];
    for (int j = 0; j < 3; ++j) u[k++] = sum.C[j][i];
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) u[k++] = sum.Q[j][i];
  }
}

// The matrix of a unit quaternion, row by row.
struct Rotation {
  double row[3][3];
};

inline Rotation rotation_of(const double* q) {
  const double x = q[0];
  const double y = q[1];
  const double z = q[2];
  const double w = q[3];
  const double xx = 2 * x * x;
  const double yy = 2 * y * y;
  const double zz = 2 * z * z;
  const double xy = 2 * x * y;
  const double xz = 2 * x * z;
  const double yz = 2 * y * z;
  const double wx = 2 * w * x;
  const double wy = 2 * w * y;
  const double wz = 2 * w * z;
  return {{{1 - yy - zz, xy - wz, xz + wy},
           {xy + wz, 1 - xx - zz, yz - wx},
           {xz - wy, yz + wx, 1 - xx - yy}}};
}

inline Motion identity() { return {{V4{1, 0, 0, 0}, V4{0, 1, 0, 0}, V4{0, 0, 1, 0}}, V4{}}; }

// X_SP of X_SC: R_SP = R_SC R_PCᵀ, t_SP = t_SC - R_SP p_PC.
inline void step_up(Motion& X, const double* X_PC) {
  const Rotation R_PC = rotation_of(X_PC);
  const auto& m = R_PC.row;
  const V4 up[3] = {combine(X.R, m[0][0], m[0][1], m[0][2]),
                    combine(X.R, m[1][0], m[1][1], m[1][2]),
                    combine(X.R, m[2][0], m[2][1], m[2][2])};
  for (int k = 0; k < 3; ++k) X.R[k] = up[k];
  X.t -= combine(X.R, X_PC[4], X_PC[5], X_PC[6]);
}

// X_SC of X_SP: R_SC = R_SP R_PC, t_SC = t_SP + R_SP p_PC.
inline void step_down(Motion& X, const double* X_PC) {
  const Rotation R_PC = rotation_of(X_PC);
  const auto& m = R_PC.row;
  X.t += combine(X.R, X_PC[4], X_PC[5], X_PC[6]);
  const V4 down[3] = {combine(X.R, m[0][0], m[1][0], m[2][0]),
                      combine(X.R, m[0][1], m[1][1], m[2][1]),
                      combine(X.R, m[0][2], m[1][2], m[2][2])};
  for (int k = 0; k < 3; ++k) X.R[k] = down[k];
}

// @param fresh  nothing is accumulated yet; sum is then not written yet
template <bool kWithCovariance>
inline void climb_edges(Motion& X, Blocks& sum, bool fresh, const Edges& edges) {
  std::size_t i = 0;
  if (fresh && edges.count > 0) {
    // The first edge's covariance is already expressed in S.
    if constexpr (kWithCovariance) set(sum, edges.first[0].upper);
    step_up(X, edges.first[0].pose);
    i = 1;
  } else if (fresh && kWithCovariance) {
    set_zero(sum);
  }
  for (; i < edges.count; ++i) {
    if constexpr (kWithCovariance) add_transported(X, edges.first[i].upper, sum);
    step_up(X, edges.first[i].pose);
  }
}

template <bool kWithCovariance>
inline void climb_on(Climb& climb, const Edges& edges) {
  Motion X = climb.empty ? identity() : load(climb.X_SH);
  climb_edges<kWithCovariance>(X, climb.sum, climb.empty, edges);
  store(climb.X_SH, X);
  climb.empty = false;
}

void climb_poses(Climb& climb, const Edges& edges) { climb_on<false>(climb, edges); }
void climb_both(Climb& climb, const Edges& edges) { climb_on<true>(climb, edges); }

// X · Y⁻¹.
inline Motion quotient(const Motion& X, const Columns& Y) {
  Motion Z;
  for (int j = 0; j < 3; ++j) Z.R[j] = combine(X.R, Y.R[0][j], Y.R[1][j], Y.R[2][j]);
  Z.t = X.t - combine(Z.R, Y.t[0], Y.t[1], Y.t[2]);
  return Z;
}

// The quaternion and translation of X⁻¹. With the unit quaternion (v, w) of R, the largest row of
// 4 (v, w)ᵀ (v, w) is normalized. Its sign is such that the largest number of the result is
// positive, or w, if it is not much smaller.
inline void store_inverse(const Motion& X, double* pose) {
  alignas(32) double R[3][4];
  alignas(32) double t[4];
  for (int k = 0; k < 3; ++k) store(R[k], X.R[k]);
  store(t, X.t);
  const double x = R[1][2] - R[2][1];
  const double y = R[2][0] - R[0][2];
  const double z = R[0][1] - R[1][0];
  const double xy = R[0][1] + R[1][0];
  const double xz = R[0][2] + R[2][0];
  const double yz = R[1][2] + R[2][1];
  double row[4] = {x, y, z, 1 + R[0][0] + R[1][1] + R[2][2]};
  double sign = 1;
  if (row[3] < 1) {
    sign = -1;
    const bool by_x = R[0][0] >= R[1][1] && R[0][0] >= R[2][2];
    const bool by_y = R[1][1] >= R[2][2];
    if (by_x) {
      const double chosen[4] = {1 + R[0][0] - R[1][1] - R[2][2], xy, xz, x};
      std::memcpy(row, chosen, sizeof(row));
    } else if (by_y) {
      const double chosen[4] = {xy, 1 - R[0][0] + R[1][1] - R[2][2], yz, y};
      std::memcpy(row, chosen, sizeof(row));
    } else {
      const double chosen[4] = {xz, yz, 1 - R[0][0] - R[1][1] + R[2][2], z};
      std::memcpy(row, chosen, sizeof(row));
    }
  }
  const double k =
      sign / std::sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2] + row[3] * row[3]);
  for (int i = 0; i < 3; ++i) pose[i] = -k * row[i];
  pose[3] = k * row[3];
  for (int i = 0; i < 3; ++i) pose[4 + i] = -(R[i][0] * t[0] + R[i][1] * t[1] + R[i][2] * t[2]);
}

template <bool kWithCovariance>
inline void join_climbs(const Climb& a, const Edges& from_a, const Climb& b, const Edges& from_b,
                        double* X_AB) {
  Motion X = b.empty ? identity() : load(b.X_SH);
  Blocks sum;
  if constexpr (kWithCovariance) {
    if (!b.empty) sum = b.sum;
  }
  climb_edges<kWithCovariance>(X, sum, b.empty, from_b);
  for (std::size_t i = from_a.count; i-- > 0;) {
    step_down(X, from_a.first[i].pose);
    if constexpr (kWithCovariance) add_transported(X, from_a.first[i].upper, sum);
  }
  if (!a.empty) {
    X = quotient(X, a.X_SH);
    if constexpr (kWithCovariance) {
      double upper[21];
      store_upper(a.sum, upper);
      add_transported(X, upper, sum);
    }
  }
  store_inverse(X, X_AB);
  if constexpr (kWithCovariance) store_upper(sum, X_AB + 7);
}

void join_poses(const Climb& a, const Edges& from_a, const Climb& b, const Edges& from_b,
                double* X_AB) {
  join_climbs<false>(a, from_a, b, from_b, X_AB);
}
void join_both(const Climb& a, const Edges& from_a, const Climb& b, const Edges& from_b,
               double* X_AB) {
  join_climbs<true>(a, from_a, b, from_b, X_AB);
}

void transport(const Columns& X, const double* upper, double* transported) {
  Blocks sum;
  set_zero(sum);
  add_transported(load(X), upper, sum);
  store_upper(sum, transported);
}

void transport_sum(const Weighted* all, std::size_t count, const double* upper, double* total) {
  Blocks sum;
  set_zero(sum);
  for (std::size_t k = 0; k < count; ++k) {
    double weighted[21];
    for (int i = 0; i < 21; ++i) weighted[i] = all[k].weight * upper[i];
    add_transported(load(all[k].X), weighted, sum);
  }
  store_upper(sum, total);
}

void add_columns(const Columns& columns, const double* F, std::size_t count, double* sum) {
  const Motion X = load(columns);
  for (std::size_t k = 0; k < count; ++k, F += 6, sum += 6) {
    const V4 theta = combine(X.R, F[3], F[4], F[5]);
    const V4 rho = combine(X.R, F[0], F[1], F[2]) + cross(X.t, theta);
    for (int i = 0; i < 3; ++i) sum[i] += rho[i];
    for (int i = 0; i < 3; ++i) sum[3 + i] += theta[i];
  }
}

#include "math/kernel_blend.ipp"
#include "math/kernel_fourth.ipp"
