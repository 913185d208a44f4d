// Draws frames, links, ellipsoids and cones of orientation: each kind in one call, whatever the number of frames.
import * as THREE from '/three/build/three.module.js';
import { OrbitControls } from '/three/examples/jsm/controls/OrbitControls.js';
import { EXACT, GIVEN, UNSPECIFIED } from './model.js';
import { Meshes } from './meshes.js';
import { factor } from './spatial.js';
import { axesMaterial, coneMaterial, ellipsoidMaterial, linkMaterial, pointMaterial } from './shaders.js';

/** An instanced mesh of our own: r111's InstancedMesh has no colour an instance, and is culled by its base. */
class Instances {
  constructor(scene, base, material, sizes) {
    this.base = base;
    this.sizes = sizes;
    this.capacity = 0;
    this.mesh = new THREE.Mesh(new THREE.InstancedBufferGeometry(), material);
    this.mesh.frustumCulled = false;
    scene.add(this.mesh);
  }

  /** Makes room for n instances; the arrays are then in `data`. */
  begin(n) {
    if (n > this.capacity) {
      this.capacity = Math.max(64, Math.ceil(n * 1.5));
      this.mesh.geometry.dispose();
      const geometry = new THREE.InstancedBufferGeometry();
      geometry.setIndex(this.base.index);
      for (const name of Object.keys(this.base.attributes)) geometry.setAttribute(name, this.base.attributes[name]);
      this.data = {};
      for (const name of Object.keys(this.sizes)) {
        this.data[name] = new Float32Array(this.capacity * this.sizes[name]);
        const attribute = new THREE.InstancedBufferAttribute(this.data[name], this.sizes[name]);
        attribute.setUsage(THREE.DynamicDrawUsage);
        geometry.setAttribute(name, attribute);
      }
      this.mesh.geometry = geometry;
    }
    this.n = 0;
  }

  end() {
    const geometry = this.mesh.geometry;
    geometry.maxInstancedCount = this.n;
    this.mesh.visible = this.n > 0;
    for (const name of Object.keys(this.sizes)) {
      const attribute = geometry.attributes[name];
      if (!attribute) continue;
      attribute.updateRange = { offset: 0, count: this.n * this.sizes[name] };
      attribute.needsUpdate = true;
    }
  }
}

// Quads for lines of some pixels: `corner` is which line, which end, which side.
function ribbon(lines) {
  const geometry = new THREE.BufferGeometry();
  const corners = [], index = [];
  for (let line = 0; line < lines; ++line) {
    for (const [end, side] of [[0, -1], [0, 1], [1, -1], [1, 1]]) corners.push(line, end, side);
    const at = 4 * line;
    index.push(at, at + 1, at + 2, at + 2, at + 1, at + 3);
  }
  geometry.setAttribute('corner', new THREE.BufferAttribute(new Float32Array(corners), 3));
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(corners.length), 3));
  geometry.setIndex(index);
  return geometry;
}

// Three fans: `corner` is which axis, where on the ring (angle), and 1 on the ring, 0 at the origin.
function cones(steps) {
  const geometry = new THREE.BufferGeometry();
  const corners = [], index = [];
  for (let axis = 0; axis < 3; ++axis) {
    const at = corners.length / 3;
    corners.push(axis, 0, 0);
    for (let k = 0; k < steps; ++k) corners.push(axis, (2 * Math.PI * k) / steps, 1);
    for (let k = 0; k < steps; ++k) index.push(at, at + 1 + k, at + 1 + ((k + 1) % steps));
  }
  geometry.setAttribute('corner', new THREE.BufferAttribute(new Float32Array(corners), 3));
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(corners.length), 3));
  geometry.setIndex(index);
  return geometry;
}

export class Scene {
  constructor(canvas, model) {
    this.model = model;
    this.show = { axes: true, links: true, names: true, ellipsoids: true, cones: true, pathOnly: false, meshes: true };
    this.k = 3;
    this.anchor = [0, 0, 0];          // what is at the origin of the picture: keeps floats precise
    this.path = new Set();
    this.a = this.b = -1;
    this.following = false;
    this.size = 0.2;
    this.radius = 1;                  // of all frames
    this.turned = false;              // by the user
    // r111 would make a context of WebGL 1, which knows instances only by an extension.
    const context = canvas.getContext('webgl2', { antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer = new THREE.WebGLRenderer({ canvas, context, antialias: true, alpha: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(45, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);      // before OrbitControls, which reads it once
    this.camera.position.set(3, -4, 3);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableKeys = false;
    this.controls.addEventListener('change', () => { this.dirty = true; });
    this.controls.addEventListener('start', () => { this.turned = true; });
    this.makeParts();
    this.meshes = new Meshes(this);
    this.dirty = true;
  }

  makeParts() {
    this.grid = null;
    this.links = new Instances(this.scene, ribbon(1), linkMaterial(), { from: 3, to: 3, colour: 4 });
    this.axes = new Instances(this.scene, ribbon(3), axesMaterial(), { origin: 3, quaternion: 4, look: 2 });
    this.points = new Instances(this.scene, ribbon(1), pointMaterial(), { origin: 3, colour: 4 });
    this.coneFans = new Instances(this.scene, cones(28), coneMaterial(), {
      origin: 3, quaternion: 4, sigmaDiagonal: 3, sigmaOff: 3, colour: 4 });
    this.ellipsoids = new Instances(this.scene, new THREE.SphereBufferGeometry(1, 22, 14), ellipsoidMaterial(), {
      origin: 3, axis0: 3, axis1: 3, axis2: 3, colour: 4 });
    this.links.mesh.renderOrder = 1;
    this.axes.mesh.renderOrder = 2;
    this.points.mesh.renderOrder = 3;
    this.coneFans.mesh.renderOrder = 4;
    this.ellipsoids.mesh.renderOrder = 5;
  }

  setColours(colours) {
    this.colours = colours;
    const css = getComputedStyle(document.documentElement);
    const colour = (name) => new THREE.Color(css.getPropertyValue(name).trim());
    this.grey = colour('--faint');
    for (const [name, letter] of [['axisX', 'x'], ['axisY', 'y'], ['axisZ', 'z']]) {
      for (const part of [this.axes, this.coneFans]) part.mesh.material.uniforms[name].value = colour(`--${letter}`);
    }
    this.chosen = { a: colour('--a'), b: colour('--b') };
    this.lineColour = colour('--line');
    this.makeGrid();
    this.update();
  }

  makeGrid() {
    if (this.grid) this.scene.remove(this.grid);
    const step = 10 ** Math.round(Math.log10(this.size * 2));
    this.grid = new THREE.GridHelper(40 * step, 40, this.lineColour, this.lineColour);
    this.grid.rotation.x = Math.PI / 2;
    this.grid.material.transparent = true;
    this.grid.material.opacity = 0.8;
    this.grid.material.depthWrite = false;
    this.gridStep = step;
    this.grid.position.set(-this.anchor[0], -this.anchor[1], -this.anchor[2]);
    this.scene.add(this.grid);
  }

  resize(width, height) {
    this.width = width;
    this.height = height;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.turned) this.fit();
    this.dirty = true;
  }

  colourOf(i) {
    return this.model.isReachable(i) && !this.model.noData[i] ? this.colours[this.model.owner[i] % this.colours.length]
      : this.grey;
  }

  isDrawn(i) {
    return this.model.shown[i] && (!this.show.pathOnly || this.path.size === 0 || this.path.has(i));
  }

  /** Takes what the model has now. */
  update() {
    const { model, anchor } = this;
    if (!this.colours) return;
    if (this.following && this.b >= 0 && model.shown[this.b]) this.moveTarget(this.b);
    this.axes.begin(model.count);
    this.links.begin(model.count);
    this.points.begin(model.count);
    for (let i = 0; i < model.count; ++i) {
      if (!this.isDrawn(i)) continue;
      const p = 7 * i, alive = model.isReachable(i) && !model.noData[i], pose = model.pose;
      const x = pose[p + 4] - anchor[0], y = pose[p + 5] - anchor[1], z = pose[p + 6] - anchor[2];
      const colour = this.colourOf(i), chosen = i === this.a || i === this.b;
      const faded = alive ? (model.isStale(i) ? 0.45 : 1) : 0.55;
      if (this.show.axes) {
        const { n, data } = this.axes;
        data.origin.set([x, y, z], 3 * n);
        data.quaternion.set([pose[p], pose[p + 1], pose[p + 2], pose[p + 3]], 4 * n);
        data.look.set([chosen ? 1.6 : 1, alive ? faded : -faded], 2 * n);
        ++this.axes.n;
      }
      const parent = model.parent[i];
      if (this.show.links && parent >= 0 && this.isDrawn(parent) && model.known[i]) {
        const { n, data } = this.links, q = 7 * parent;
        data.from.set([pose[q + 4] - anchor[0], pose[q + 5] - anchor[1], pose[q + 6] - anchor[2]], 3 * n);
        data.to.set([x, y, z], 3 * n);
        const onPath = this.path.has(i) && this.path.has(parent);
        data.colour.set([colour.r, colour.g, colour.b, (onPath ? 1 : 0.6) * faded], 4 * n);
        ++this.links.n;
      }
      const { n, data } = this.points;
      const dot = i === this.a ? this.chosen.a : i === this.b ? this.chosen.b : colour;
      data.origin.set([x, y, z], 3 * n);
      data.colour.set([dot.r, dot.g, dot.b, chosen ? 2 : 1], 4 * n);
      ++this.points.n;
    }
    for (const part of [this.axes, this.links, this.points]) part.end();
    this.meshes.update();
    this.dirty = true;
  }

  /** Takes the covariances that the model has now. */
  updateSigmas() {
    const { model, anchor, k } = this;
    if (!this.colours) return;
    const block = new Float64Array(9), S = new Float64Array(9), A = new Float64Array(9), R = new Float64Array(9);
    this.ellipsoids.begin(model.count);
    this.coneFans.begin(model.count);
    for (let i = 0; i < model.count; ++i) {
      if (!this.isDrawn(i) || model.covKind[i] !== GIVEN) continue;
      const p = 7 * i, c = 36 * i, pose = model.pose, cov = model.cov;
      const origin = [pose[p + 4] - anchor[0], pose[p + 5] - anchor[1], pose[p + 6] - anchor[2]];
      const colour = i === this.b ? this.chosen.b : this.colourOf(i);
      const alpha = i === this.b ? 1 : this.b < 0 ? 0.85 : 0.6;
      if (this.show.ellipsoids) {
        for (let row = 0; row < 3; ++row) for (let j = 0; j < 3; ++j) block[3 * row + j] = cov[c + 6 * row + j];
        congruence(S, R, pose, p, block);
        // One that is larger than the robot would cover it.
        const reach = k * Math.sqrt(cov[c] + cov[c + 7] + cov[c + 14]);
        const clear = Math.max(0.15, Math.min(1, (2 * this.radius) / reach));
        factor(A, S);
        const { n, data } = this.ellipsoids;
        data.origin.set(origin, 3 * n);
        data.axis0.set([k * A[0], k * A[3], k * A[6]], 3 * n);
        data.axis1.set([k * A[1], k * A[4], k * A[7]], 3 * n);
        data.axis2.set([k * A[2], k * A[5], k * A[8]], 3 * n);
        data.colour.set([colour.r, colour.g, colour.b, alpha * clear], 4 * n);
        ++this.ellipsoids.n;
      }
      if (this.show.cones) {
        const { n, data } = this.coneFans;
        data.origin.set(origin, 3 * n);
        data.quaternion.set([pose[p], pose[p + 1], pose[p + 2], pose[p + 3]], 4 * n);
        data.sigmaDiagonal.set([cov[c + 21], cov[c + 28], cov[c + 35]], 3 * n);
        data.sigmaOff.set([cov[c + 22], cov[c + 23], cov[c + 29]], 3 * n);
        data.colour.set([i === this.b || i === this.a ? 1.6 : 1, 0, 0, alpha], 4 * n);
        ++this.coneFans.n;
      }
    }
    this.ellipsoids.end();
    this.coneFans.end();
    this.coneFans.mesh.material.uniforms.k.value = k;
    this.dirty = true;
  }

  /** Where a frame is on the screen, in pixels, and how far away; null if it is behind the camera or not drawn. */
  project(i, out) {
    const p = 7 * i;
    out.set(this.model.pose[p + 4] - this.anchor[0], this.model.pose[p + 5] - this.anchor[1],
      this.model.pose[p + 6] - this.anchor[2]);
    const distance = out.distanceTo(this.camera.position);
    out.project(this.camera);
    if (out.z > 1 || Math.abs(out.x) > 1.1 || Math.abs(out.y) > 1.1) return null;
    return { x: (out.x + 1) * 0.5 * this.width, y: (1 - out.y) * 0.5 * this.height, distance };
  }

  /** The frame nearest to a point of the screen; -1: none is near. */
  pick(x, y) {
    const at = new THREE.Vector3();
    let best = -1, least = 16 * 16;
    for (let i = 0; i < this.model.count; ++i) {
      const place = this.isDrawn(i) ? this.project(i, at) : null;
      if (!place) continue;
      const d = (place.x - x) ** 2 + (place.y - y) ** 2;
      if (d < least) { least = d; best = i; }
    }
    return best;
  }

  moveTarget(i) {
    const p = 7 * i, next = new THREE.Vector3();
    next.set(...[4, 5, 6].map((k) => this.model.pose[p + k] - this.anchor[k - 4]));
    this.camera.position.add(next.clone().sub(this.controls.target));
    this.controls.target.copy(next);
    this.controls.update();
  }

  /** Axes that neither overlap their neighbours nor vanish. */
  axisLength(radius) {
    const { edge, parent, known, count } = this.model, lengths = [];
    for (let i = 0; i < count; ++i) {
      const length = parent[i] < 0 || !known[i] ? 0 : Math.hypot(edge[7 * i + 4], edge[7 * i + 5], edge[7 * i + 6]);
      if (length > 1e-6) lengths.push(length);
    }
    const usual = lengths.sort((a, b) => a - b)[lengths.length >> 1] || radius;
    return Math.min(radius / 7, Math.max(0.6 * usual, radius / 60));
  }

  /** Whether a frame lies outside what the last fit() has shown. */
  isOutside() {
    const { model, anchor } = this, most = 1.3 * this.radius;
    for (let i = 0; i < model.count; ++i) {
      const p = 7 * i + 4, { pose } = model;
      if (this.isDrawn(i) && Math.hypot(pose[p] - anchor[0], pose[p + 1] - anchor[1], pose[p + 2] - anchor[2]) > most) {
        return true;
      }
    }
    return false;
  }

  /** Shows all frames. */
  fit() {
    const { model } = this;
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < model.count; ++i) {
      if (!this.isDrawn(i)) continue;
      for (let k = 0; k < 3; ++k) {
        const c = model.pose[7 * i + 4 + k];
        low[k] = Math.min(low[k], c);
        high[k] = Math.max(high[k], c);
      }
    }
    if (low[0] === Infinity) return;
    const diagonal = Math.hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    this.anchor = low.map((c, k) => (c + high[k]) / 2);
    const radius = Math.max(diagonal / 2, 0.05);
    this.size = this.axisLength(radius);
    this.radius = radius;
    this.turned = false;
    const distance = (radius * 2.6) / Math.min(1, this.camera.aspect);
    const away = new THREE.Vector3(0.62, -0.82, 0.55).normalize().multiplyScalar(distance);
    this.camera.position.copy(away);
    this.controls.target.set(0, 0, 0);
    this.controls.update();
    this.makeGrid();
    this.update();
    this.updateSigmas();
  }

  draw() {
    if (!this.dirty || !this.width) return false;
    this.dirty = false;
    const distance = this.camera.position.distanceTo(this.controls.target);
    this.camera.near = distance / 500;
    this.camera.far = distance * 100 + 40 * (this.gridStep || 1);
    this.camera.updateProjectionMatrix();
    const pixels = this.height / (2 * Math.tan((this.camera.fov * Math.PI) / 360));
    for (const part of [this.axes, this.links, this.points, this.coneFans, this.ellipsoids]) {
      const { uniforms } = part.mesh.material;
      uniforms.viewport.value.set(this.width, this.height);
      uniforms.pixels.value = pixels;
      uniforms.size.value = this.size;
    }
    this.renderer.render(this.scene, this.camera);
    return true;
  }
}

// R·block·Rᵀ, with the rotation of the pose.
function congruence(S, R, pose, p, block) {
  const x = pose[p], y = pose[p + 1], z = pose[p + 2], w = pose[p + 3];
  R[0] = 1 - 2 * (y * y + z * z); R[1] = 2 * (x * y - z * w); R[2] = 2 * (x * z + y * w);
  R[3] = 2 * (x * y + z * w); R[4] = 1 - 2 * (x * x + z * z); R[5] = 2 * (y * z - x * w);
  R[6] = 2 * (x * z - y * w); R[7] = 2 * (y * z + x * w); R[8] = 1 - 2 * (x * x + y * y);
  for (let i = 0; i < 3; ++i) {
    for (let j = 0; j < 3; ++j) {
      let sum = 0;
      for (let m = 0; m < 3; ++m) {
        for (let n = 0; n < 3; ++n) sum += R[3 * i + m] * block[3 * m + n] * R[3 * j + n];
      }
      S[3 * i + j] = sum;
    }
  }
}

export { EXACT, UNSPECIFIED };
