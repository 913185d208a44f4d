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

// Number `i` of each of the four edges.
template <Edge Blend::*kEdge>
inline V4 lanes(const Blend* four, int i) {
  return V4{(four[0].*kEdge)[i], (four[1].*kEdge)[i], (four[2].*kEdge)[i], (four[3].*kEdge)[i]};
}
template <Edge Blend::*kEdge>
inline Poses poses(const Blend* four) {
  return {{lanes<kEdge>(four, 0), lanes<kEdge>(four, 1), lanes<kEdge>(four, 2)},
          lanes<kEdge>(four, 3),
          {lanes<kEdge>(four, 4), lanes<kEdge>(four, 5), lanes<kEdge>(four, 6)}};
}

inline Vec rotate(Vec u, V4 w, Vec a) {
  const Vec once = cross(u, a);
  return a + (w + w) * once + cross(u + u, once);
}

// The differences ξ = Log(X0⁻¹ X1), and their squared angles.
struct Ways {
  Vec rho;
  Vec theta;
  V4 angle2;
};

// All series are cut where the remainder is below 1e-11 for angles up to 0.1.
constexpr double kSmallSine2 = 0.0025;  // (sin of half the angle)²

// @param sine2  the squared sines of half the angles
inline Ways ways_between(const Poses& X0, const Poses& X1, V4& sine2) {
  const V4 w = X0.w * X1.w + dot(X0.u, X1.u);
  const Vec v = X0.w * X1.u - X1.w * X0.u - cross(X0.u, X1.u);
  const V4 n = dot(v, v);
  const V4 arc = 2.0 + n * (1.0 / 3 + n * (3.0 / 20 + n * (5.0 / 56 + n * (35.0 / 576))));
  sine2 = n;
  Ways ways;
  ways.theta = (w < 0.0 ? -arc : arc) * v;
  ways.angle2 = dot(ways.theta, ways.theta);
  const Vec back{-X0.u.x, -X0.u.y, -X0.u.z};
  const Vec d = rotate(back, X0.w, X1.t - X0.t);
  const Vec once = cross(ways.theta, d);
  const V4 c = (1.0 / 12) + ways.angle2 * (1.0 / 720 + ways.angle2 * (1.0 / 30240));
  ways.rho = d - (V4{} + 0.5) * once + c * cross(ways.theta, once);
  return ways;
}

// X0 · Exp(s ξ)
inline Poses go(const Poses& X0, const Ways& ways, V4 s) {
  const V4 f = s * s * ways.angle2;
  const Vec once = cross(ways.theta, ways.rho);
  const Vec t =
      s * ways.rho + (s * s * (0.5 - f * (1.0 / 24 - f * (1.0 / 720)))) * once +
      (s * s * s * (1.0 / 6 - f * (1.0 / 120 - f * (1.0 / 5040)))) * cross(ways.theta, once);
  const V4 h = 0.25 * f;
  const Vec v = (0.5 * s * (1.0 - h * (1.0 / 6 - h * (1.0 / 120)))) * ways.theta;
  const V4 w = 1.0 - h * (0.5 - h * (1.0 / 24 - h * (1.0 / 720)));
  const Vec u = X0.w * v + w * X0.u + cross(X0.u, v);
  const V4 real = X0.w * w - dot(X0.u, v);
  // A Newton step towards unit length.
  const V4 k = 1.5 - 0.5 * (dot(u, u) + real * real);
  return {k * u, k * real, X0.t + rotate(X0.u, X0.w, t)};
}

// One lane of Ways.
struct Way {
  double rho[3];
  double theta[3];
  double angle2;
};

inline double square(const double* a) { return a[0] * a[0] + a[1] * a[1] + a[2] * a[2]; }

// sum += B Σ Bᵀ, B = [M, N; 0, M] = 1 + Σ_k c_k ad(ξ)^k, k = 1 to 4. With Θ = [θ]×, Θ³ = -|θ|² Θ
// and d|θ|² = 2 θ·ρ along ρ, M = 1 + a Θ + b Θ² with a = c1 - c3 |θ|², b = c2 - c4 |θ|², and N is
// the derivative of M along ρ.
// along ρ.
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
  sandwich(M, N, upper, sum);
}

inline void store_upper(const Blocks& sum, double* u) {
  int k = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) u[k++] = sum.P[j][i];
    for (int j = 0; j < 3; ++j) u[k++] = sum.C[j][i];
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) u[k++] = sum.Q[j][i];
  }
}

inline void carry_weighted(const Way& way, double s, double weight, const double* upper,
                           Blocks& sum) {
  double weighted[21];
  for (int k = 0; k < 21; ++k) weighted[k] = weight * upper[k];
  carry(way, small_angle_coefficients(s).data(), weighted, sum);
}

// If both ends have the same covariance, the covariance between them differs from it only by s
// (1-s)/4 ad(ξ) Σ ad(ξ)ᵀ and terms of fourth order. Adds nothing where that term is below a
// millionth.
inline bool add_bulge(const Way& way, double s, const double* upper, Blocks& sum) {
  constexpr double kLittle = 16e-6;
  const double turned = upper[15] + upper[18] + upper[20];
  const bool stays = way.angle2 < kLittle &&
                     square(way.rho) * turned <= kLittle * (upper[0] + upper[6] + upper[11]);
  if (stays) return false;
  const V4 theta{way.theta[0], way.theta[1], way.theta[2], 0};
  const V4 rho{way.rho[0], way.rho[1], way.rho[2], 0};
  V4 M[3];
  V4 N[3];
  for (int j = 0; j < 3; ++j) {
    V4 e{};
    e[j] = 1;
    M[j] = cross(theta, e);
    N[j] = cross(rho, e);
  }
  double weighted[21];
  const double weight = 0.25 * s * (1.0 - s);
  for (int k = 0; k < 21; ++k) weighted[k] = weight * upper[k];
  sandwich(M, N, weighted, sum);
  return true;
}

inline void blend_covariance(const Way& way, const Blend& one) {
  // Up to here, what add_bulge() leaves out is below 1e-8.
  constexpr double kQuarticEnds = 1e-3;
  const double* u0 = one.upper0;
  const double* u1 = one.upper1;
  double* u = one.X + 7;
  const bool same = u0 == u1 || std::memcmp(u0, u1, 21 * sizeof(double)) == 0;
  Blocks sum;
  if (same && way.angle2 < kQuarticEnds) {
    if (add_bulge(way, one.s, u0, sum)) {
      store_upper(sum, u);
      for (int k = 0; k < 21; ++k) u[k] += u0[k];
    } else {
      std::memcpy(u, u0, 21 * sizeof(double));
    }
    return;
  }
  const Way back{{-way.rho[0], -way.rho[1], -way.rho[2]},
                 {-way.theta[0], -way.theta[1], -way.theta[2]},
                 way.angle2};
  carry_weighted(back, 1.0 - one.s, 1.0 - one.s, u0, sum);
  carry_weighted(way, one.s, one.s, u1, sum);
  store_upper(sum, u);
}

template <bool kWithCovariance>
inline void blend_all(Blend* all, std::size_t count) {
  for (std::size_t from = 0; from < count; from += 4) {
    const std::size_t here = count - from < 4 ? count - from : 4;
    Blend four[4];
    for (std::size_t i = 0; i < 4; ++i) four[i] = all[from + (i < here ? i : 0)];
    V4 sine2;
    const Poses X0 = poses<&Blend::X0>(four);
    const Ways ways = ways_between(X0, poses<&Blend::X1>(four), sine2);
    const Poses X = go(X0, ways, V4{four[0].s, four[1].s, four[2].s, four[3].s});
    for (std::size_t i = 0; i < here; ++i) {
      all[from + i].near = sine2[i] < kSmallSine2;
      if (!all[from + i].near) continue;
      double* out = four[i].X;
      out[0] = X.u.x[i];
      out[1] = X.u.y[i];
      out[2] = X.u.z[i];
      out[3] = X.w[i];
      out[4] = X.t.x[i];
      out[5] = X.t.y[i];
      out[6] = X.t.z[i];
      if constexpr (kWithCovariance) {
        blend_covariance({{ways.rho.x[i], ways.rho.y[i], ways.rho.z[i]},
                          {ways.theta.x[i], ways.theta.y[i], ways.theta.z[i]},
                          ways.angle2[i]},
                         four[i]);
      }
    }
  }
}

void blend_poses(Blend* all, std::size_t count) { blend_all<false>(all, count); }
void blend_both(Blend* all, std::size_t count) { blend_all<true>(all, count); }
