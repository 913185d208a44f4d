// Poses are 7 numbers in a Float64Array: quaternion x, y, z, w, then translation. A covariance is 36 numbers, row by
// row, of the right perturbation with the translation first, as everywhere in tf-dude.

/** Writes X_AB · X_BC to out at o. */
export function compose(out, o, X, a, Y, b) {
  const ax = X[a], ay = X[a + 1], az = X[a + 2], aw = X[a + 3];
  const bx = Y[b], by = Y[b + 1], bz = Y[b + 2], bw = Y[b + 3];
  const px = Y[b + 4], py = Y[b + 5], pz = Y[b + 6];
  const tx = 2 * (ay * pz - az * py), ty = 2 * (az * px - ax * pz), tz = 2 * (ax * py - ay * px);
  out[o + 4] = X[a + 4] + px + aw * tx + ay * tz - az * ty;
  out[o + 5] = X[a + 5] + py + aw * ty + az * tx - ax * tz;
  out[o + 6] = X[a + 6] + pz + aw * tz + ax * ty - ay * tx;
  const x = aw * bx + ax * bw + ay * bz - az * by, y = aw * by - ax * bz + ay * bw + az * bx;
  const z = aw * bz + ax * by - ay * bx + az * bw, w = aw * bw - ax * bx - ay * by - az * bz;
  const n = 1 / Math.sqrt(x * x + y * y + z * z + w * w);
  out[o] = x * n; out[o + 1] = y * n; out[o + 2] = z * n; out[o + 3] = w * n;
}

/** Writes the inverse of X to out. */
export function invert(out, o, X, a) {
  const x = -X[a], y = -X[a + 1], z = -X[a + 2], w = X[a + 3];
  const px = X[a + 4], py = X[a + 5], pz = X[a + 6];
  const tx = 2 * (y * pz - z * py), ty = 2 * (z * px - x * pz), tz = 2 * (x * py - y * px);
  out[o] = x; out[o + 1] = y; out[o + 2] = z; out[o + 3] = w;
  out[o + 4] = -(px + w * tx + y * tz - z * ty);
  out[o + 5] = -(py + w * ty + z * tx - x * tz);
  out[o + 6] = -(pz + w * tz + x * ty - y * tx);
}

/** The rotation matrix of X, row by row, to R. */
export function rotation(R, X, a) {
  const x = X[a], y = X[a + 1], z = X[a + 2], w = X[a + 3];
  R[0] = 1 - 2 * (y * y + z * z); R[1] = 2 * (x * y - z * w); R[2] = 2 * (x * z + y * w);
  R[3] = 2 * (x * y + z * w); R[4] = 1 - 2 * (x * x + z * z); R[5] = 2 * (y * z - x * w);
  R[6] = 2 * (x * z - y * w); R[7] = 2 * (y * z + x * w); R[8] = 1 - 2 * (x * x + y * y);
}

const rot = new Float64Array(9);
const skewed = new Float64Array(9);
const half = new Float64Array(36);

/** Writes Ad(X) S Ad(X)ᵀ to out, with Ad(X) = [R, [t]×R; 0, R]. */
export function transport(out, o, X, a, S, s) {
  rotation(rot, X, a);
  const R = rot, K = skewed, tx = X[a + 4], ty = X[a + 5], tz = X[a + 6];
  for (let c = 0; c < 3; ++c) {
    K[c] = ty * R[6 + c] - tz * R[3 + c];
    K[3 + c] = tz * R[c] - tx * R[6 + c];
    K[6 + c] = tx * R[3 + c] - ty * R[c];
  }
  for (let i = 0; i < 3; ++i) {
    const r0 = R[3 * i], r1 = R[3 * i + 1], r2 = R[3 * i + 2];
    const k0 = K[3 * i], k1 = K[3 * i + 1], k2 = K[3 * i + 2];
    for (let c = 0; c < 6; ++c) {
      const d0 = S[s + 18 + c], d1 = S[s + 24 + c], d2 = S[s + 30 + c];
      half[6 * i + c] = r0 * S[s + c] + r1 * S[s + 6 + c] + r2 * S[s + 12 + c] + k0 * d0 + k1 * d1 + k2 * d2;
      half[18 + 6 * i + c] = r0 * d0 + r1 * d1 + r2 * d2;
    }
  }
  for (let i = 0; i < 6; ++i) {
    const h = 6 * i;
    for (let j = 0; j < 3; ++j) {
      const r0 = R[3 * j], r1 = R[3 * j + 1], r2 = R[3 * j + 2];
      out[o + h + j] = half[h] * r0 + half[h + 1] * r1 + half[h + 2] * r2 + half[h + 3] * K[3 * j] +
        half[h + 4] * K[3 * j + 1] + half[h + 5] * K[3 * j + 2];
      out[o + h + 3 + j] = half[h + 3] * r0 + half[h + 4] * r1 + half[h + 5] * r2;
    }
  }
}

/**
 * The covariance of B's position along the axes of A, 3x3 row by row: R S Rᵀ, of the rotation q of X_AB and the rows of
 * its covariance, which has the axes of B.
 */
export function positionCovariance(q, rows) {
  const R = new Float64Array(9), S = new Float64Array(9);
  rotation(R, [...q, 0, 0, 0], 0);
  for (let i = 0; i < 3; ++i) {
    for (let j = 0; j < 3; ++j) {
      let sum = 0;
      for (let m = 0; m < 3; ++m) for (let n = 0; n < 3; ++n) sum += R[3 * i + m] * rows[m][n] * R[3 * j + n];
      S[3 * i + j] = sum;
    }
  }
  return S;
}

/** Eigenvalues, descending, and unit eigenvectors (columns of V) of a symmetric 3x3 matrix, by Jacobi's method. */
export function eigen(M) {
  const A = M.slice(), V = [1, 0, 0, 0, 1, 0, 0, 0, 1];
  for (let sweep = 0; sweep < 30; ++sweep) {
    const off = Math.abs(A[1]) + Math.abs(A[2]) + Math.abs(A[5]);
    if (off <= 1e-18 * (Math.abs(A[0]) + Math.abs(A[4]) + Math.abs(A[8]))) break;
    for (const [p, q] of [[0, 1], [0, 2], [1, 2]]) {
      const apq = A[3 * p + q];
      if (apq === 0) continue;
      const theta = (A[4 * q] - A[4 * p]) / (2 * apq);
      const t = (theta < 0 ? -1 : 1) / (Math.abs(theta) + Math.sqrt(theta * theta + 1));
      const c = 1 / Math.sqrt(t * t + 1), s = t * c;
      for (let k = 0; k < 3; ++k) {
        const kp = A[3 * k + p], kq = A[3 * k + q];
        A[3 * k + p] = c * kp - s * kq; A[3 * k + q] = s * kp + c * kq;
      }
      for (let k = 0; k < 3; ++k) {
        const pk = A[3 * p + k], qk = A[3 * q + k];
        A[3 * p + k] = c * pk - s * qk; A[3 * q + k] = s * pk + c * qk;
        const vp = V[3 * k + p], vq = V[3 * k + q];
        V[3 * k + p] = c * vp - s * vq; V[3 * k + q] = s * vp + c * vq;
      }
    }
  }
  const order = [0, 1, 2].sort((i, j) => A[4 * j] - A[4 * i]);
  return {
    values: order.map((i) => Math.max(0, A[4 * i])),
    vectors: order.map((i) => [V[i], V[3 + i], V[6 + i]]),
  };
}

/**
 * A with A·Aᵀ = S, of a symmetric positive semi-definite 3x3 matrix: Cholesky's factor, with columns of zeros where
 * nothing is left. Any such A maps the unit sphere to the same ellipsoid, so no eigenvalues are needed.
 */
export function factor(A, S) {
  const tiny = 1e-14 * (S[0] + S[4] + S[8]);
  const a = S[0] > tiny ? Math.sqrt(S[0]) : 0;
  const b = a ? S[3] / a : 0, c = a ? S[6] / a : 0;
  const dd = S[4] - b * b, d = dd > tiny ? Math.sqrt(dd) : 0;
  const e = d ? (S[7] - b * c) / d : 0;
  const ff = S[8] - c * c - e * e, f = ff > tiny ? Math.sqrt(ff) : 0;
  A[0] = a; A[1] = 0; A[2] = 0; A[3] = b; A[4] = d; A[5] = 0; A[6] = c; A[7] = e; A[8] = f;
}

/**
 * The mean velocity between two poses {rotation, translation} of B in A, so many seconds apart: of B's origin [m/s], and
 * of its rotation [rad/s], both along the axes of A.
 */
export function meanVelocity(before, after, dt) {
  const linear = after.translation.map((x, i) => (x - before.translation[i]) / dt);
  const [px, py, pz, pw] = before.rotation, [qx, qy, qz, qw] = after.rotation;
  // The vector of after · before⁻¹, the shorter way round.
  const w = qw * pw + qx * px + qy * py + qz * pz, sign = w < 0 ? -1 : 1;
  const turn = [qx * pw - qw * px - qy * pz + qz * py, qy * pw - qw * py - qz * px + qx * pz,
    qz * pw - qw * pz - qx * py + qy * px];
  const sine = Math.hypot(...turn), angle = 2 * Math.atan2(sine, Math.abs(w));
  return { linear, angular: turn.map((c) => (sine === 0 ? 0 : (sign * c * angle) / (sine * dt))) };
}

/** Roll, pitch, yaw about fixed axes [rad], as the command line prints them. */
export function toRpy([x, y, z, w]) {
  const sine = Math.max(-1, Math.min(1, 2 * (w * y - z * x)));
  return [Math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), Math.asin(sine),
    Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))];
}
