// Included by cloud.cpp once per instruction set, as kernel_body.ipp is by kernel.cpp. Four points
// are computed at once: what belongs together in memory is transposed in registers.

inline V4 load4(const double* from) {
  V4 v;
  std::memcpy(&v, from, sizeof v);
  return v;
}
inline V4 load4(const float* from) {
  F4 v;
  std::memcpy(&v, from, sizeof v);
  return __builtin_convertvector(v, V4);
}
inline void store4(double* to, V4 v) { std::memcpy(to, &v, sizeof v); }
inline void store4(float* to, V4 v) {
  const F4 narrow = __builtin_convertvector(v, F4);
  std::memcpy(to, &narrow, sizeof narrow);
}
// Four numbers as they are stored.
inline V4 narrow(V4 v, double) { return v; }
inline F4 narrow(V4 v, float) { return __builtin_convertvector(v, F4); }

// Rows of four numbers each become columns.
template <class V>
inline void transpose(V* m) {
  const V a = __builtin_shufflevector(m[0], m[1], 0, 4, 2, 6);
  const V b = __builtin_shufflevector(m[0], m[1], 1, 5, 3, 7);
  const V c = __builtin_shufflevector(m[2], m[3], 0, 4, 2, 6);
  const V d = __builtin_shufflevector(m[2], m[3], 1, 5, 3, 7);
  m[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  m[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  m[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  m[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

// Coordinates of four points.
struct Four {
  V4 x;
  V4 y;
  V4 z;
};

template <class Number>
inline Four load_points(const Number* from) {
  const V4 a = load4(from);      // x0 y0 z0 x1
  const V4 b = load4(from + 4);  // y1 z1 x2 y2
  const V4 c = load4(from + 8);  // z2 x3 y3 z3
  const V4 bc = __builtin_shufflevector(b, c, 2, 3, 4, 5);  // x2 y2 z2 x3
  const V4 ab = __builtin_shufflevector(a, b, 1, 2, 4, 5);  // y0 z0 y1 z1
  return {__builtin_shufflevector(a, bc, 0, 3, 4, 7),
          __builtin_shufflevector(ab, __builtin_shufflevector(b, c, 3, 3, 6, 6), 0, 2, 4, 6),
          __builtin_shufflevector(ab, c, 1, 3, 4, 7)};
}

template <class Number>
inline void store_points(Number* to, const Four& p) {
  const V4 xy = __builtin_shufflevector(p.x, p.y, 0, 4, 2, 6);  // x0 y0 x2 y2
  const V4 yz = __builtin_shufflevector(p.y, p.z, 1, 5, 3, 7);  // y1 z1 y3 z3
  const V4 zx = __builtin_shufflevector(p.z, p.x, 0, 5, 2, 7);  // z0 x1 z2 x3
  store4(to, __builtin_shufflevector(xy, zx, 0, 1, 4, 5));
  store4(to + 4, __builtin_shufflevector(yz, xy, 0, 1, 6, 7));
  store4(to + 8, __builtin_shufflevector(zx, yz, 2, 3, 6, 7));
}

template <class Number, int kRows>
inline void store_covariances(Number* to, const V4* wide) {
  using V = decltype(narrow(wide[0], Number()));
  V sigma[6];
  for (int k = 0; k < 6; ++k) sigma[k] = narrow(wide[k], Number());
  V first[4] = {sigma[0], sigma[1], sigma[2], kRows == 6 ? sigma[3] : sigma[1]};
  transpose(first);
  if constexpr (kRows == 6) {
    for (int i = 0; i < 4; ++i) {
      std::memcpy(to + 6 * i, &first[i], sizeof(V));
      to[6 * i + 4] = sigma[4][i];
      to[6 * i + 5] = sigma[5][i];
    }
  } else {
    V second[4] = {sigma[3], sigma[4], sigma[2], sigma[4]};
    transpose(second);
    for (int i = 0; i < 4; ++i) {
      std::memcpy(to + 9 * i, &first[i], sizeof(V));
      std::memcpy(to + 9 * i + 4, &second[i], sizeof(V));
      to[9 * i + 8] = sigma[5][i];
    }
  }
}

// P + Y + Yᵀ with Y = A [r]× and A = C - [r]× Q / 2.
inline void covariance_at(const Map& map, const Four& r, V4* sigma) {
  const auto& C = map.C;
  const auto& Q = map.half_Q;
  V4 A[3][3];
  for (int j = 0; j < 3; ++j) {
    A[0][j] = C[0][j] + r.z * Q[1][j] - r.y * Q[2][j];
    A[1][j] = C[1][j] - r.z * Q[0][j] + r.x * Q[2][j];
    A[2][j] = C[2][j] + r.y * Q[0][j] - r.x * Q[1][j];
  }
  sigma[0] = map.P[0] + 2.0 * (r.z * A[0][1] - r.y * A[0][2]);
  sigma[1] = map.P[1] + r.x * A[0][2] - r.z * A[0][0] + r.z * A[1][1] - r.y * A[1][2];
  sigma[2] = map.P[2] + r.y * A[0][0] - r.x * A[0][1] + r.z * A[2][1] - r.y * A[2][2];
  sigma[3] = map.P[3] + 2.0 * (r.x * A[1][2] - r.z * A[1][0]);
  sigma[4] = map.P[4] + r.y * A[1][0] - r.x * A[1][1] + r.x * A[2][2] - r.z * A[2][0];
  sigma[5] = map.P[5] + 2.0 * (r.y * A[2][0] - r.x * A[2][1]);
}

template <class Number, int kRows>
inline void transform_four(const Map& map, const Number* p_B, Number* p_A, Number* covariances) {
  const Four p = load_points(p_B);
  const Four r{map.R[0][0] * p.x + map.R[0][1] * p.y + map.R[0][2] * p.z,
               map.R[1][0] * p.x + map.R[1][1] * p.y + map.R[1][2] * p.z,
               map.R[2][0] * p.x + map.R[2][1] * p.y + map.R[2][2] * p.z};
  store_points(p_A, {r.x + map.t[0], r.y + map.t[1], r.z + map.t[2]});
  if constexpr (kRows > 0) {
    V4 sigma[6];
    covariance_at(map, r, sigma);
    store_covariances<Number, kRows>(covariances, sigma);
  }
}

template <class Number, int kRows>
void transform_cloud(const Map& map, const Number* p_B, std::size_t count, Number* p_A,
                     Number* covariances) {
  std::size_t i = 0;
  for (; i + 4 <= count; i += 4) {
    transform_four<Number, kRows>(map, p_B + 3 * i, p_A + 3 * i, covariances + kRows * i);
  }
  if (i == count) return;
  // The last ones, as part of four.
  Number from[12] = {};
  Number to[12];
  Number sigma[36];
  const std::size_t rest = count - i;
  std::memcpy(from, p_B + 3 * i, 3 * rest * sizeof(Number));
  transform_four<Number, kRows>(map, from, to, sigma);
  std::memcpy(p_A + 3 * i, to, 3 * rest * sizeof(Number));
  if (kRows > 0) std::memcpy(covariances + kRows * i, sigma, kRows * rest * sizeof(Number));
}
