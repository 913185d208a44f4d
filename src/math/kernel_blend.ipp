// Included at the end of kernel_body.ipp: interpolation between two samples of an edge that are
// close together. Poses are computed four edges at a time, one per lane; covariances one by one, in
// columns.

struct Vec {
  V4 x, y, z;
};
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(V4 k, Vec a) { return {k * a.x, k * a.y, k * a.z}; }
inline V4 dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Four poses.
struct Poses {
  Vec u;  // u and w form the quaternions
  V4 w;
  Vec t;
};

inline void transpose(V4* rows) {
  const V4 a = __builtin_shufflevector(rows[0], rows[1], 0, 4, 2, 6);
  const V4 b = __builtin_shufflevector(rows[0], rows[1], 1, 5, 3, 7);
  const V4 c = __builtin_shufflevector(rows[2], rows[3], 0, 4, 2, 6);
  const V4 d = __builtin_shufflevector(rows[2], rows[3], 1, 5, 3, 7);
  rows[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  rows[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  rows[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  rows[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

using Unaligned = double __attribute__((vector_size(32), aligned(8)));

// The numbers from `first` on of each of four arrays: lanes[k] has number first + k of each.
inline void load_lanes(const double* const* four, int first, V4* lanes) {
  for (int i = 0; i < 4; ++i) lanes[i] = *reinterpret_cast<const Unaligned*>(four[i] + first);
  transpose(lanes);
}
// The opposite, into those that are not null.
inline void store_lanes(const V4* lanes, double* const* four, int first) {
  V4 rows[4] = {lanes[0], lanes[1], lanes[2], lanes[3]};
  transpose(rows);
  for (int i = 0; i < 4; ++i) {
    if (four[i] != nullptr) *reinterpret_cast<Unaligned*>(four[i] + first) = rows[i];
  }
}

inline Poses load_poses(const double* const* four) {
  V4 q[4];
  V4 rest[4];
  load_lanes(four, 0, q);
  load_lanes(four, 3, rest);
  return {{q[0], q[1], q[2]}, q[3], {rest[1], rest[2], rest[3]}};
}
inline void store_poses(const Poses& X, double* const* four) {
  const V4 lanes[7] = {X.u.x, X.u.y, X.u.z, X.w, X.t.x, X.t.y, X.t.z};
  store_lanes(lanes, four, 0);
  store_lanes(lanes + 3, four, 3);
}

// Where the groups of four numbers of a covariance begin; the last two overlap.
constexpr int kGroups[6] = {0, 4, 8, 12, 16, 17};

inline Vec rotate(Vec u, V4 w, Vec a) {
  const Vec once = cross(u, a);
  return a + (w + w) * once + cross(u + u, once);
}

// All series are cut where the remainder is below 1e-11 for angles up to 0.1.
constexpr double kSmallSine2 = 0.0025;  // (sin of half the angle)²

// What lies between two poses.
struct Between {
  Vec even;  // X1's rotation times the inverse of X0's: the vector of the quaternion is even + odd
  Vec odd;   // in the parent's axes, and even - odd in the child's
  V4 sine2;  // (sin of half the angle)²
  V4 sign;   // that of the shorter way
  V4 arc;    // rotation vector / vector of the quaternion
  V4 angle2;
  Vec way;  // of the translation, in the parent's axes
};

inline Between between(const Poses& X0, const Poses& X1) {
  Between b;
  b.even = X0.w * X1.u - X1.w * X0.u;
  b.odd = cross(X0.u, X1.u);
  const Vec v = b.even + b.odd;
  const V4 n = dot(v, v);
  b.sine2 = n;
  b.sign = X0.w * X1.w + dot(X0.u, X1.u) < 0.0 ? V4{} - 1.0 : V4{} + 1.0;
  b.arc = b.sign * (2.0 + n * (1.0 / 3 + n * (3.0 / 20 + n * (5.0 / 56 + n * (35.0 / 576)))));
  b.angle2 = b.arc * b.arc * n;
  b.way = X1.t - X0.t;
  return b;
}

// sin(r a) / sin(a) with n = (sin a)².
inline V4 share(V4 r, V4 n) {
  const V4 r2 = r * r;
  return r * (1.0 + n * (1.0 - r2) * (1.0 / 6) *
                        (1.0 + n * (9.0 - r2) * (1.0 / 20) * (1.0 + n * (25.0 - r2) * (1.0 / 42))));
}

// X0 · Exp(s ξ). Its rotation is a weighted mean of both. Its translation is t0 + s g(s, [θ]×)
// (t1 - t0) in the parent's axes, with g(s, x) = (exp(s x) - 1) / (s (exp(x) - 1)), a series of
// Bernoulli polynomials.
inline Poses go(const Poses& X0, const Poses& X1, const Between& b, V4 s) {
  const V4 rest = 1.0 - s;
  const V4 k0 = share(rest, b.sine2);
  const V4 k1 = b.sign * share(s, b.sine2);
  const Vec u = k0 * X0.u + k1 * X1.u;
  const V4 w = k0 * X0.w + k1 * X1.w;
  // A Newton step towards unit length.
  const V4 k = 1.5 - 0.5 * (dot(u, u) + w * w);
  const V4 s2 = s * s;
  const V4 c1 = -0.5 * rest;
  const V4 c2 = rest * (1.0 - 2.0 * s) * (1.0 / 12);
  const V4 c3 = s * rest * rest * (1.0 / 24);
  const V4 c4 = s2 * (1.0 / 72 - s * (1.0 / 48) + s2 * (1.0 / 120)) - 1.0 / 720;
  const V4 c5 = s * (s2 * (2.5 - 3.0 * s + s2) - 0.5) * (1.0 / 720);
  const V4 c6 = (s2 * (s2 * (3.5 - 3.5 * s + s2) - 7.0 / 6) + 1.0 / 6) * (1.0 / 5040);
  const Vec theta = b.arc * (b.even + b.odd);
  const Vec once = cross(theta, b.way);
  const Vec t = b.way + (c1 - b.angle2 * (c3 - b.angle2 * c5)) * once +
                (c2 - b.angle2 * (c4 - b.angle2 * c6)) * cross(theta, once);
  return {k * u, k * w, X0.t + s * t};
}

// The differences ξ = Log(X0⁻¹ X1).
struct Ways {
  Vec rho;
  Vec theta;
  V4 angle2;
};

inline Ways ways(const Poses& X0, const Between& b) {
  Ways ways;
  ways.theta = b.arc * (b.even - b.odd);
  ways.angle2 = b.angle2;
  const Vec back{-X0.u.x, -X0.u.y, -X0.u.z};
  const Vec d = rotate(back, X0.w, b.way);
  const Vec once = cross(ways.theta, d);
  const V4 c = (1.0 / 12) + ways.angle2 * (1.0 / 720 + ways.angle2 * (1.0 / 30240));
  ways.rho = d - (V4{} + 0.5) * once + c * cross(ways.theta, once);
  return ways;
}

// One lane of Ways.
struct Way {
  double rho[3];
  double theta[3];
  double angle2;
};

// sum += B Σ Bᵀ, B = [M, N; 0, M] = 1 + Σ_k c_k ad(ξ)^k, k = 1 to 4. With Θ = [θ]×, Θ³ = -|θ|² Θ
// and d|θ|² = 2 θ·ρ along ρ, M = 1 + a Θ + b Θ² with a = c1 - c3 |θ|², b = c2 - c4 |θ|², and N is
// the derivative of M along ρ.
inline void carry(const Way& way, const double* c, const double* upper, Blocks& sum) {
  const double a = c[0] - c[2] * way.angle2;
  const double b = c[1] - c[3] * way.angle2;
  const double along =
      way.theta[0] * way.rho[0] + way.theta[1] * way.rho[1] + way.theta[2] * way.rho[2];
  const double da = -2.0 * along * c[2];
  const double db = -2.0 * along * c[3];
  const double* t = way.theta;
  const double* r = way.rho;
  const V4 theta{t[0], t[1], t[2], 0};
  const V4 rho{r[0], r[1], r[2], 0};
  V4 M[3];
  V4 N[3];
  for (int j = 0; j < 3; ++j) {
    V4 e{};
    e[j] = 1;
    const V4 turn = cross(theta, e);
    M[j] = (1.0 - b * way.angle2) * e + a * turn + (b * t[j]) * theta;
    N[j] = (-2.0 * b * along - db * way.angle2) * e + a * cross(rho, e) + da * turn +
           (b * t[j]) * rho + (b * r[j] + db * t[j]) * theta;
  }
  add_sandwich(M, N, upper, sum);
}

inline void carry_weighted(const Way& way, double s, double weight, const double* upper,
                           Blocks& sum) {
  double weighted[21];
  for (int k = 0; k < 21; ++k) weighted[k] = weight * upper[k];
  carry(way, small_angle_coefficients(s).data(), weighted, sum);
}

// If both ends have the same covariance, the covariance between them differs from it only by s
// (1-s)/4 ad(ξ) Σ ad(ξ)ᵀ and terms of fourth order. Whether that term is below a millionth.
inline bool stays(const double* upper, double angle2, double distance2) {
  constexpr double kLittle = 16e-6;
  const double turned = upper[15] + upper[18] + upper[20];
  return angle2 < kLittle && distance2 * turned <= kLittle * (upper[0] + upper[6] + upper[11]);
}

// A 3x3 matrix of each of four edges.
struct Mats {
  Vec column[3];

  Vec row(int i) const {
    const auto of = [i](const Vec& a) { return i == 0 ? a.x : i == 1 ? a.y : a.z; };
    return {of(column[0]), of(column[1]), of(column[2])};
  }
};

// The covariances Σ + s (1-s)/4 ad(ξ) Σ ad(ξ)ᵀ. With ad(ξ) Σ = [L, K; *, H], the blocks of the
// product are L Θᵀ + K [ρ]×ᵀ, K Θᵀ and H Θᵀ.
inline void bulged(const double* const* four, const Ways& xi, V4 s, V4* upper) {
  for (const int first : kGroups) load_lanes(four, first, upper + first);
  const V4* u = upper;
  const Mats P{{{u[0], u[1], u[2]}, {u[1], u[6], u[7]}, {u[2], u[7], u[11]}}};
  const Mats C{{{u[3], u[8], u[12]}, {u[4], u[9], u[13]}, {u[5], u[10], u[14]}}};
  const Mats Q{{{u[15], u[16], u[17]}, {u[16], u[18], u[19]}, {u[17], u[19], u[20]}}};
  Mats L;
  Mats K;
  Mats H;
  for (int j = 0; j < 3; ++j) {
    L.column[j] = cross(xi.theta, P.column[j]) + cross(xi.rho, C.row(j));
    K.column[j] = cross(xi.theta, C.column[j]) + cross(xi.rho, Q.column[j]);
    H.column[j] = cross(xi.theta, Q.column[j]);
  }
  const V4 weight = 0.25 * s * (1.0 - s);
  int k = 0;
  const auto add = [&](const Vec& row, int from) {
    if (from <= 0) upper[k++] += weight * row.x;
    if (from <= 1) upper[k++] += weight * row.y;
    upper[k++] += weight * row.z;
  };
  for (int i = 0; i < 3; ++i) {
    add(cross(xi.theta, L.row(i)) + cross(xi.rho, K.row(i)), i);
    add(cross(xi.theta, K.row(i)), 0);
  }
  for (int i = 0; i < 3; ++i) add(cross(xi.theta, H.row(i)), i);
}

inline bool same_covariance(const Blend& one) {
  return one.X0.upper == one.X1.upper ||
         std::memcmp(one.X0.upper, one.X1.upper, 21 * sizeof(double)) == 0;
}

inline void blend_covariance(const Way& way, const Blend& one) {
  const Way back{{-way.rho[0], -way.rho[1], -way.rho[2]},
                 {-way.theta[0], -way.theta[1], -way.theta[2]},
                 way.angle2};
  Blocks sum;
  set_zero(sum);
  carry_weighted(back, 1.0 - one.s, 1.0 - one.s, one.X0.upper, sum);
  carry_weighted(way, one.s, one.s, one.X1.upper, sum);
  store_upper(sum, one.X + 7);
}

// Of the edges that are near.
inline void blend_covariances(Blend* const* some, std::size_t count, const Poses& X0,
                              const Between& b, V4 s) {
  // Up to here, what bulged() leaves out is below 1e-8.
  constexpr double kQuarticEnds = 1e-3;
  const V4 distance2 = dot(b.way, b.way);
  double* bulging[4] = {};
  bool blending[4] = {};
  bool bulges = false;
  bool blends = false;
  for (std::size_t i = 0; i < count; ++i) {
    const Blend& one = *some[i];
    one.edge->upper = one.X0.upper;
    if (!one.near) continue;
    const bool same = same_covariance(one);
    if (same && stays(one.X0.upper, b.angle2[i], distance2[i])) continue;
    one.edge->upper = one.X + 7;
    if (same && b.angle2[i] < kQuarticEnds) {
      bulging[i] = one.X + 7;
      bulges = true;
    } else {
      blends = blending[i] = true;
    }
  }
  if (!bulges && !blends) return;
  const Ways xi = ways(X0, b);
  if (bulges) {
    const double* upper0[4];
    for (std::size_t i = 0; i < 4; ++i) upper0[i] = some[i < count ? i : 0]->X0.upper;
    V4 upper[21];
    bulged(upper0, xi, s, upper);
    for (const int first : kGroups) store_lanes(upper + first, bulging, first);
  }
  for (std::size_t i = 0; blends && i < count; ++i) {
    if (!blending[i]) continue;
    blend_covariance({{xi.rho.x[i], xi.rho.y[i], xi.rho.z[i]},
                      {xi.theta.x[i], xi.theta.y[i], xi.theta.z[i]},
                      xi.angle2[i]},
                     *some[i]);
  }
}

template <bool kWithCovariance>
inline void blend_all(Blend* const* all, std::size_t count) {
  for (std::size_t from = 0; from < count; from += 4) {
    const std::size_t here = count - from < 4 ? count - from : 4;
    Blend* const* some = all + from;
    const double* pose0[4];
    const double* pose1[4];
    for (std::size_t i = 0; i < 4; ++i) {
      const Blend& one = *some[i < here ? i : 0];
      pose0[i] = one.X0.pose;
      pose1[i] = one.X1.pose;
    }
    const auto part = [&](std::size_t i) { return some[i < here ? i : 0]->s; };
    const V4 s{part(0), part(1), part(2), part(3)};
    const Poses X0 = load_poses(pose0);
    const Poses X1 = load_poses(pose1);
    const Between b = between(X0, X1);
    double* out[4] = {};
    for (std::size_t i = 0; i < here; ++i) {
      Blend& one = *some[i];
      one.near = b.sine2[i] < kSmallSine2;
      if (!one.near) continue;
      out[i] = one.X;
      one.edge->pose = one.X;
    }
    store_poses(go(X0, X1, b, s), out);
    if constexpr (kWithCovariance) blend_covariances(some, here, X0, b, s);
  }
}

void blend_poses(Blend* const* all, std::size_t count) { blend_all<false>(all, count); }
void blend_both(Blend* const* all, std::size_t count) { blend_all<true>(all, count); }
