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

// sum += Ad Σ Adᵀ for Ad = [R, G; 0, R], where G = [t]×R for Ad(X). With A = R P + G Cᵀ, B = R C +
// G Q and D = R Q, the parts of Ad Σ Adᵀ are A Rᵀ + B Gᵀ, B Rᵀ and D Rᵀ. 81 products of columns and
// numbers.
inline void sandwich(const V4* R, const V4* G, const double* u, Blocks& sum) {
  // Rows of R and G, as numbers, through memory: loads that broadcast a number to all lanes are
  // free, shuffles are not.
  alignas(32) double r[3][4];
  alignas(32) double g[3][4];
  for (int k = 0; k < 3; ++k) {
    store(r[k], R[k]);
    store(g[k], G[k]);
  }
  const V4 A[3] = {combine(R, u[0], u[1], u[2]) + combine(G, u[3], u[4], u[5]),
                   combine(R, u[1], u[6], u[7]) + combine(G, u[8], u[9], u[10]),
                   combine(R, u[2], u[7], u[11]) + combine(G, u[12], u[13], u[14])};
  const V4 B[3] = {combine(R, u[3], u[8], u[12]) + combine(G, u[15], u[16], u[17]),
                   combine(R, u[4], u[9], u[13]) + combine(G, u[16], u[18], u[19]),
                   combine(R, u[5], u[10], u[14]) + combine(G, u[17], u[19], u[20])};
  const V4 D[3] = {combine(R, u[15], u[16], u[17]), combine(R, u[16], u[18], u[19]),
                   combine(R, u[17], u[19], u[20])};
  for (int j = 0; j < 3; ++j) {
    store(sum.P[j], load(sum.P[j]) + combine(A, r[0][j], r[1][j], r[2][j]) +
                        combine(B, g[0][j], g[1][j], g[2][j]));
    store(sum.C[j], load(sum.C[j]) + combine(B, r[0][j], r[1][j], r[2][j]));
    store(sum.Q[j], load(sum.Q[j]) + combine(D, r[0][j], r[1][j], r[2][j]));
  }
}

inline void sandwich(const V4* R, V4 t, const double* u, Blocks& sum) {
  const V4 G[3] = {cross(t, R[0]), cross(t, R[1]), cross(t, R[2])};
  sandwich(R, G, u, sum);
}

// R_SP = R_SC R_PCᵀ, t_SP = t_SC - R_SP p_PC, with R_PC from the quaternion.
inline void step(V4* R, V4& t, Edge edge) {
  const double x = edge[0];
  const double y = edge[1];
  const double z = edge[2];
  const double w = edge[3];
  const double xx = 2 * x * x;
  const double yy = 2 * y * y;
  const double zz = 2 * z * z;
  const double xy = 2 * x * y;
  const double xz = 2 * x * z;
  const double yz = 2 * y * z;
  const double wx = 2 * w * x;
  const double wy = 2 * w * y;
  const double wz = 2 * w * z;
  const V4 up[3] = {combine(R, 1 - yy - zz, xy - wz, xz + wy),
                    combine(R, xy + wz, 1 - xx - zz, yz - wx),
                    combine(R, xz - wy, yz + wx, 1 - xx - yy)};
  for (int k = 0; k < 3; ++k) R[k] = up[k];
  t -= combine(R, edge[4], edge[5], edge[6]);
}

template <bool kWithCovariance>
inline void climb(Columns& X_SH, Blocks* sum, const Edge* edges, std::size_t count) {
  V4 R[3] = {load(X_SH.R[0]), load(X_SH.R[1]), load(X_SH.R[2])};
  V4 t = load(X_SH.t);
  for (std::size_t i = 0; i < count; ++i) {
    if constexpr (kWithCovariance) sandwich(R, t, edges[i] + 7, *sum);
    step(R, t, edges[i]);
  }
  for (int k = 0; k < 3; ++k) store(X_SH.R[k], R[k]);
  store(X_SH.t, t);
}

void accumulate_pose(Columns& X_SH, const Edge* edges, std::size_t count) {
  climb<false>(X_SH, nullptr, edges, count);
}

void accumulate_both(Columns& X_SH, Blocks& sum, const Edge* edges, std::size_t count) {
  climb<true>(X_SH, &sum, edges, count);
}

Columns quotient(const Columns& X, const Columns& Y) {
  const V4 R[3] = {load(X.R[0]), load(X.R[1]), load(X.R[2])};
  Columns Z;
  V4 turned[3];
  for (int j = 0; j < 3; ++j) {
    turned[j] = combine(R, Y.R[0][j], Y.R[1][j], Y.R[2][j]);
    store(Z.R[j], turned[j]);
  }
  store(Z.t, load(X.t) - combine(turned, Y.t[0], Y.t[1], Y.t[2]));
  return Z;
}

void transport(const Columns& X, const double* upper, Blocks& sum) {
  const V4 R[3] = {load(X.R[0]), load(X.R[1]), load(X.R[2])};
  sandwich(R, load(X.t), upper, sum);
}

#include "math/kernel_blend.ipp"
