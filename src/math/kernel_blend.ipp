// The end of kernel_body.ipp: interpolation between two samples of an edge that are little apart.

struct Vec {
  double x, y, z;
};
inline Vec operator+(Vec a, Vec b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(Vec a, Vec b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator*(double k, Vec a) { return {k * a.x, k * a.y, k * a.z}; }
inline double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(Vec a, Vec b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
// By the quaternion (u, w).
inline Vec rotate(Vec u, double w, Vec a) {
  const Vec t = 2.0 * cross(u, a);
  return a + w * t + cross(u, t);
}
inline V4 wide(Vec a) { return V4{a.x, a.y, a.z, 0}; }

// The way from the one to the other, ξ = Log(X0⁻¹ X1).
struct Way {
  Vec rho;
  Vec theta;
  double angle2;
};

// All series are cut where what is left is below 1e-11 for angles up to kSmallAngle.
constexpr double kSmallAngle = 0.1;
constexpr double kSmallSine2 = 0.0025;  // of half of it, squared

inline bool way_between(Edge X0, Edge X1, Way& way) {
  const Vec u0{X0[0], X0[1], X0[2]};
  const Vec u1{X1[0], X1[1], X1[2]};
  const double w = X0[3] * X1[3] + dot(u0, u1);
  const Vec v = X0[3] * u1 - X1[3] * u0 - cross(u0, u1);
  const double n = dot(v, v);
  if (!(n < kSmallSine2)) return false;
  const double arc =
      2.0 + n * (1.0 / 3 + n * (3.0 / 20 + n * (5.0 / 56 + n * (35.0 / 576))));
  way.theta = (w < 0 ? -arc : arc) * v;
  way.angle2 = dot(way.theta, way.theta);
  const Vec step{X1[4] - X0[4], X1[5] - X0[5], X1[6] - X0[6]};
  const Vec d = rotate(-1.0 * u0, X0[3], step);
  const Vec once = cross(way.theta, d);
  const double c = (1.0 + way.angle2 * (1.0 / 60 + way.angle2 / 2520)) / 12;
  way.rho = d - 0.5 * once + c * cross(way.theta, once);
  return true;
}

// X0 · Exp(s ξ)
inline void go(Edge X0, const Way& way, double s, double* X) {
  const double f = s * s * way.angle2;
  const Vec once = cross(way.theta, way.rho);
  const Vec t = s * way.rho + (s * s * (0.5 - f * (1.0 / 24 - f / 720))) * once +
                (s * s * s * (1.0 / 6 - f * (1.0 / 120 - f / 5040))) * cross(way.theta, once);
  const double h = 0.25 * f;
  const Vec v = (0.5 * s * (1.0 - h * (1.0 / 6 - h / 120))) * way.theta;
  const double w = 1.0 - h * (0.5 - h * (1.0 / 24 - h / 720));
  const Vec u0{X0[0], X0[1], X0[2]};
  const Vec u = X0[3] * v + w * u0 + cross(u0, v);
  const double real = X0[3] * w - dot(u0, v);
  // A step of Newton's towards length one.
  const double k = 1.5 - 0.5 * (dot(u, u) + real * real);
  const Vec p = rotate(u0, X0[3], t);
  X[0] = k * u.x;
  X[1] = k * u.y;
  X[2] = k * u.z;
  X[3] = k * real;
  X[4] = X0[4] + p.x;
  X[5] = X0[5] + p.y;
  X[6] = X0[6] + p.z;
}

// sum += B Σ Bᵀ, B = [M, N; 0, M] = 1 + Σ_k c_k ad(ξ)^k, k = 1 to 4. With Θ = [θ]×, Θ³ = -|θ|² Θ and
// d|θ|² = 2 θ·ρ along ρ, M = 1 + a Θ + b Θ² with a = c1 - c3 |θ|², b = c2 - c4 |θ|², and N is the derivative of M
// along ρ.
inline void carry(const Way& way, const double* c, const double* upper, Blocks& sum) {
  const double a = c[0] - c[2] * way.angle2;
  const double b = c[1] - c[3] * way.angle2;
  const double along = dot(way.theta, way.rho);
  const double da = -2.0 * along * c[2];
  const double db = -2.0 * along * c[3];
  const V4 theta = wide(way.theta);
  const V4 rho = wide(way.rho);
  const double t[3] = {way.theta.x, way.theta.y, way.theta.z};
  const double r[3] = {way.rho.x, way.rho.y, way.rho.z};
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

// The same covariance at both ends is what it is between them but for s (1-s)/4 ad(ξ) Σ ad(ξ)ᵀ and terms of fourth order:
// whether that is below a millionth of it.
inline bool stays(const Way& way, const double* u) {
  constexpr double kLittle = 16e-6;
  return way.angle2 < kLittle &&
         dot(way.rho, way.rho) * (u[15] + u[18] + u[20]) <= kLittle * (u[0] + u[6] + u[11]);
}

// Coefficients of Jr(s ξ) Jr⁻¹(ξ), as coefficients() of interpolate.cpp.
inline void carry_weighted(const Way& way, double s, double weight, const double* upper,
                           Blocks& sum) {
  const double rest = 1.0 - s;
  const double c[4] = {0.5 * rest, rest * (1.0 - 2.0 * s) / 12.0, -s * rest * rest / 24.0,
                       -1.0 / 720.0 + s * s * (1.0 / 72.0 - s / 48.0 + s * s / 120.0)};
  double weighted[21];
  for (int k = 0; k < 21; ++k) weighted[k] = weight * upper[k];
  carry(way, c, weighted, sum);
}

bool blend_pose(Edge X0, Edge X1, double s, double* X) {
  Way way;
  if (!way_between(X0, X1, way)) return false;
  go(X0, way, s, X);
  return true;
}

bool blend(Edge X0, Edge X1, double s, double* X) {
  Way way;
  if (!way_between(X0, X1, way)) return false;
  go(X0, way, s, X);
  const double* u0 = X0 + 7;
  const double* u1 = X1 + 7;
  if (std::memcmp(u0, u1, 21 * sizeof(double)) == 0 && stays(way, u0)) {
    std::memcpy(X + 7, u0, 21 * sizeof(double));
    return true;
  }
  Blocks sum;
  const Way back{-1.0 * way.rho, -1.0 * way.theta, way.angle2};
  carry_weighted(back, 1.0 - s, 1.0 - s, u0, sum);
  carry_weighted(way, s, s, u1, sum);
  store_upper(sum, X + 7);
  return true;
}
