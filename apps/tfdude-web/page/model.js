// What the server has sent: frames, the values of their edges, and what follows from them. docs/web.md has the layouts.
import { compose, invert, transport } from './spatial.js';

const STATIC = -0x80000000;
const HEADER = 20;
const UPPER = [];
for (let i = 0; i < 6; ++i) for (let j = i; j < 6; ++j) UPPER.push([i, j]);

/** Of a covariance. */
export const EXACT = 0, GIVEN = 1, UNSPECIFIED = 2;

export class Model {
  constructor() {
    this.root = null;         // id of the frame that all is seen from
    this.past = false;        // an instant is shown
    this.picture = 0;         // counts what arrives
    this.period = 33;         // between values [ms]
    this.forget();
  }

  allocate(n) {
    this.count = n;
    this.parent = new Int32Array(n).fill(-1);
    this.owner = new Int32Array(n);
    this.waits = new Array(n).fill('');       // the parent's id, if it does not exist
    this.children = Array.from({ length: n }, () => []);
    this.known = new Uint8Array(n);           // the edge has a value
    this.edge = new Float64Array(7 * n);      // as shown: on the way from the values before to the newest
    this.newest = new Float64Array(7 * n);
    this.before = new Float64Array(7 * n);
    this.moving = [];
    this.stamp = new BigInt64Array(n);        // 0: holds for all times
    this.isStatic = new Uint8Array(n);
    this.noData = new Uint8Array(n);          // at the instant that is shown
    this.sigma = new Float64Array(36 * n);
    this.sigmaKind = new Uint8Array(n).fill(UNSPECIFIED);
    this.correlated = new Uint8Array(n);
    // Seen from the root:
    this.pose = new Float64Array(7 * n);
    this.cov = new Float64Array(36 * n);
    this.covKind = new Uint8Array(n);         // EXACT, GIVEN, UNSPECIFIED: an edge on the way is
    this.shown = new Uint8Array(n);           // connected with the root by edges with values
    this.order = [];
    this.sigmaStale = true;
  }

  /** Before something is shown, of which nothing is known yet. */
  forget() {
    this.version = -1;
    this.ids = [];
    this.index = new Map();
    this.partitions = [];
    this.rates = {};
    this.joints = [];
    this.events = [];
    this.span = null;         // [oldest, newest], BigInt ns
    this.now = 0n;            // of the last picture
    this.chosen = null;       // what the owners say of one frame: root, frame, rows of its covariance
    this.allocate(0);
  }

  setStructure({ version, partitions, frames }) {
    this.arrive();
    const before = this.index;
    const kept = { known: this.known, edge: this.edge, stamp: this.stamp, isStatic: this.isStatic, sigma: this.sigma,
      sigmaKind: this.sigmaKind };
    this.version = version;
    this.partitions = partitions;
    this.allocate(frames.length);
    this.ids = frames.map(([id]) => id);
    this.index = new Map(this.ids.map((id, i) => [id, i]));
    frames.forEach(([id, parent, owner], i) => {
      this.owner[i] = owner;
      if (typeof parent === 'number') {
        this.parent[i] = parent;
        this.children[parent].push(i);
      } else {
        this.waits[i] = parent;
      }
      const old = before.get(id);
      if (old === undefined) return;
      this.known[i] = kept.known[old]; this.stamp[i] = kept.stamp[old]; this.isStatic[i] = kept.isStatic[old];
      this.sigmaKind[i] = kept.sigmaKind[old];
      this.edge.set(kept.edge.subarray(7 * old, 7 * old + 7), 7 * i);
      this.newest.set(kept.edge.subarray(7 * old, 7 * old + 7), 7 * i);
      this.sigma.set(kept.sigma.subarray(36 * old, 36 * old + 36), 36 * i);
    });
    this.cutCycles();
    for (const list of this.children) list.sort((a, b) => (this.ids[a] < this.ids[b] ? -1 : 1));
    if (!this.index.has(this.root)) this.root = this.defaultRoot();
    this.reroot();
  }

  /** Only a damaged recording has any. */
  cutCycles() {
    const walk = new Int32Array(this.count);  // the one that has come by
    for (let start = 0; start < this.count; ++start) {
      for (let i = start; i >= 0 && walk[i] === 0; i = this.parent[i]) {
        walk[i] = start + 1;
        const above = this.parent[i];
        if (above < 0 || walk[above] !== start + 1) continue;
        this.parent[i] = -1;
        this.children[above].splice(this.children[above].indexOf(i), 1);
      }
    }
  }

  roots() {
    const roots = [];
    for (let i = 0; i < this.count; ++i) if (this.parent[i] < 0) roots.push(i);
    return roots.sort((a, b) => (this.ids[a] < this.ids[b] ? -1 : 1));
  }

  sizeBelow(i) {
    let size = 0;
    for (const stack = [i]; stack.length; ++size) stack.push(...this.children[stack.pop()]);
    return size;
  }

  defaultRoot() {
    let best = null, most = 0;
    for (const i of this.roots()) {
      const size = this.sizeBelow(i);
      if (size > most) { most = size; best = this.ids[i]; }
    }
    return best;
  }

  rootOf(i) {
    while (this.parent[i] >= 0) i = this.parent[i];
    return i;
  }

  isReachable(i) { return this.partitions[this.owner[i]].reachable; }

  chooseRoot(id) {
    this.root = id;
    this.reroot();
  }

  /** The order in which poses follow from each other, from the root outwards: up and down. */
  reroot() {
    this.order = [];
    this.sigmaStale = true;
    const start = this.index.get(this.root);
    if (start === undefined) return;
    const from = new Int32Array(this.count).fill(-2);
    from[start] = -1;
    const queue = [start];
    for (let done = 0; done < queue.length; ++done) {
      const at = queue[done];
      this.order.push([at, from[at]]);
      for (const next of [...this.children[at], ...(this.parent[at] >= 0 ? [this.parent[at]] : [])]) {
        if (from[next] === -2) { from[next] = at; queue.push(next); }
      }
    }
    this.solve();
  }

  /** Computes all poses seen from the root. */
  solve() {
    const { pose, edge, known, shown, parent } = this;
    const inverse = new Float64Array(7);
    shown.fill(0);
    for (const [i, from] of this.order) {
      if (from < 0) {
        pose.set([0, 0, 0, 1, 0, 0, 0], 7 * i);
        shown[i] = 1;
      } else if (parent[i] === from) {
        if (!shown[from] || !known[i]) continue;
        compose(pose, 7 * i, pose, 7 * from, edge, 7 * i);
        shown[i] = 1;
      } else {
        if (!shown[from] || !known[from]) continue;
        invert(inverse, 0, edge, 7 * from);
        compose(pose, 7 * i, pose, 7 * from, inverse, 0);
        shown[i] = 1;
      }
    }
    ++this.picture;
  }

  /**
   * Computes all covariances seen from the root, to first order. Errors of different edges count as independent here;
   * the numbers of B in A come from the server, which knows better.
   */
  solveSigmas() {
    const { cov, covKind, sigma, sigmaKind, edge, shown, parent } = this;
    const inverse = new Float64Array(7), sum = new Float64Array(36);
    for (const [i, from] of this.order) {
      if (!shown[i]) continue;
      if (from < 0) {
        cov.fill(0, 36 * i, 36 * i + 36);
        covKind[i] = EXACT;
        continue;
      }
      const down = parent[i] === from, own = down ? i : from;
      const worst = Math.max(covKind[from] === UNSPECIFIED || sigmaKind[own] === UNSPECIFIED ? UNSPECIFIED : 0,
        covKind[from] === GIVEN || sigmaKind[own] === GIVEN ? GIVEN : 0);
      covKind[i] = worst;
      if (down) {
        // X_Dc = X_Dp X_pc: Ad(X_pc⁻¹) Σ Ad(X_pc⁻¹)ᵀ + Σ_pc
        invert(inverse, 0, edge, 7 * i);
        transport(cov, 36 * i, inverse, 0, cov, 36 * from);
        for (let k = 0; k < 36; ++k) cov[36 * i + k] += sigma[36 * i + k];
      } else {
        // X_Dp = X_Dc X_pc⁻¹: Ad(X_pc) (Σ + Σ_pc) Ad(X_pc)ᵀ
        for (let k = 0; k < 36; ++k) sum[k] = cov[36 * from + k] + sigma[36 * from + k];
        transport(cov, 36 * i, edge, 7 * from, sum, 0);
      }
    }
    this.takeChosen();
    this.sigmaStale = false;
  }

  /** The owners know how errors on the way to the chosen frame are correlated. */
  takeChosen() {
    const { chosen } = this, i = chosen && chosen.root === this.root ? this.index.get(chosen.frame) : undefined;
    if (i === undefined || !this.shown[i] || this.covKind[i] !== GIVEN) return;
    for (let k = 0; k < 36; ++k) this.cov[36 * i + k] = chosen.rows[Math.floor(k / 6)][k % 6];
  }

  /** Takes a binary message. @return whether it fits what is shown */
  take(buffer) {
    const view = new DataView(buffer);
    const kind = view.getUint8(0), past = (view.getUint8(1) & 1) === 1, base = view.getBigInt64(8, true);
    if (view.getUint32(4, true) !== this.version || past !== this.past) return false;
    const count = view.getUint32(16, true);
    if (kind === 1) {
      // A root has no values.
      if (past) this.noData = Uint8Array.from(this.parent, (parent) => (parent < 0 ? 0 : 1));
      else if (this.now === 0n) this.noData.fill(0);
      this.now = base;
      this.takeValues(view, count, base);
    } else {
      this.takeSigmas(view, count);
    }
    return true;
  }

  takeValues(view, count, base) {
    const scale = Math.SQRT1_2 / 32767, { newest, edge, before } = this, now = performance.now();
    this.arrive();
    this.period += 0.2 * (Math.min(100, Math.max(16, now - (this.arrived || 0))) - this.period);
    this.arrived = now;
    let at = HEADER;
    for (let n = 0; n < count; ++n) {
      const word = view.getUint32(at, true), i = word & 0x1fffffff, largest = word >>> 30, wide = word & 0x20000000;
      const stamp = view.getInt32(at + 4, true);
      at += 8;
      this.isStatic[i] = stamp === STATIC ? 1 : 0;
      this.stamp[i] = stamp === STATIC ? 0n : base + BigInt(stamp) * 100000n;
      const e = 7 * i;
      for (let k = 4; k < 7; ++k) {
        newest[e + k] = wide ? view.getFloat64(at, true) : view.getFloat32(at, true);
        at += wide ? 8 : 4;
      }
      let rest = 1;
      for (let k = 0; k < 4; ++k) {
        if (k === largest) continue;
        const part = view.getInt16(at, true) * scale;
        newest[e + k] = part;
        rest -= part * part;
        at += 2;
      }
      newest[e + largest] = Math.sqrt(Math.max(0, rest));
      const shown = edge.subarray(e, e + 7), next = newest.subarray(e, e + 7);
      if (this.known[i] && !this.past) {
        const same = shown[0] * next[0] + shown[1] * next[1] + shown[2] * next[2] + shown[3] * next[3] >= 0 ? 1 : -1;
        for (let k = 0; k < 7; ++k) before[e + k] = k < 4 ? same * shown[k] : shown[k];
        this.moving.push(i);
      } else {
        shown.set(next);
      }
      this.known[i] = 1;
      this.noData[i] = 0;
    }
    if (!this.moving.length) this.solve();  // else advance() does
  }

  /** Moves what is shown on to the newest values, within the time between two of them. @return whether it moves */
  advance(now) {
    if (!this.moving.length) return false;
    const part = Math.min(1, Math.max(0, (now - this.arrived) / this.period));
    if (part === 1) {
      this.arrive();
    } else {
      const { edge, newest, before } = this;
      for (const i of this.moving) {
        const e = 7 * i;
        for (let k = e; k < e + 7; ++k) edge[k] = before[k] + part * (newest[k] - before[k]);
        const length = Math.hypot(edge[e], edge[e + 1], edge[e + 2], edge[e + 3]);
        for (let k = e; k < e + 4; ++k) edge[k] /= length;
      }
    }
    this.solve();
    return true;
  }

  /** Shows the newest values. */
  arrive() {
    for (const i of this.moving) this.edge.set(this.newest.subarray(7 * i, 7 * i + 7), 7 * i);
    this.moving = [];
  }

  takeSigmas(view, count) {
    let at = HEADER;
    for (let n = 0; n < count; ++n) {
      const word = view.getUint32(at, true), i = word & 0x1fffffff;
      const unspecified = word >>> 31, zero = (word >>> 29) & 1;
      at += 4;
      this.correlated[i] = (word >>> 30) & 1;
      this.sigmaKind[i] = unspecified ? UNSPECIFIED : zero ? EXACT : GIVEN;
      const s = 36 * i;
      if (zero || unspecified) {
        this.sigma.fill(0, s, s + 36);
        continue;
      }
      for (const [row, column] of UPPER) {
        const entry = view.getFloat32(at, true);
        this.sigma[s + 6 * row + column] = entry;
        this.sigma[s + 6 * column + row] = entry;
        at += 4;
      }
    }
    this.sigmaStale = true;
  }

  /** Seconds since an edge's newest sample; null: it is static, or has none. */
  age(i) {
    return this.stamp[i] === 0n ? null : Number(this.now - this.stamp[i]) * 1e-9;
  }

  /** Whether an edge that was sampled regularly is not any more. */
  isStale(i) {
    const age = this.age(i);
    if (age === null || this.past) return false;
    const hz = (this.rates[this.ids[i]] || {}).hz || 0;
    return age > Math.max(1, hz > 0 ? 5 / hz : 0);
  }

  /** The newest instant at which all edges that still move have a value. */
  commonInstant() {
    let common = null;
    for (let i = 0; i < this.count; ++i) {
      const fresh = this.known[i] && this.stamp[i] !== 0n && !this.isStale(i);
      if (fresh && (common === null || this.stamp[i] < common)) common = this.stamp[i];
    }
    return common;
  }

  /** The frames from a to b, each with whether the path goes down to it; null if they have no common root. */
  path(a, b) {
    const up = [];
    for (let i = a; i >= 0; i = this.parent[i]) up.push(i);
    const down = [];
    let i = b;
    for (; i >= 0 && !up.includes(i); i = this.parent[i]) down.push(i);
    return i < 0 ? null : { up: up.slice(0, up.indexOf(i)), top: i, down: down.reverse() };
  }
}
