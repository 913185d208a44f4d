// Names beside the frames, on one canvas. The most important come first; what would overlap is counted instead.
import { Vector3 } from '/three/build/three.module.js';

const MOST = 60;
const HEIGHT = 15;

export class Labels {
  constructor(canvas, scene) {
    this.canvas = canvas;
    this.scene = scene;
    this.hovered = -1;
    this.widths = new Map();
    this.before = new Set();
  }

  width(g, id) {
    if (!this.widths.has(id)) this.widths.set(id, g.measureText(id).width);
    return this.widths.get(id);
  }

  draw() {
    const { canvas, scene } = this, { model } = scene, ratio = Math.min(window.devicePixelRatio || 1, 2);
    if (canvas.width !== Math.round(scene.width * ratio) || canvas.height !== Math.round(scene.height * ratio)) {
      canvas.width = Math.round(scene.width * ratio);
      canvas.height = Math.round(scene.height * ratio);
    }
    const g = canvas.getContext('2d');
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, scene.width, scene.height);
    const css = getComputedStyle(document.documentElement);
    const colour = (name) => css.getPropertyValue(name).trim();
    g.font = '12px system-ui, "DejaVu Sans", sans-serif';
    g.textBaseline = 'middle';
    const taken = [], shown = new Set();
    const colours = { ink: colour('--ink'), soft: colour('--soft'), ground: colour('--ground'),
      a: colour('--a'), b: colour('--b'), faint: colour('--faint') };
    for (const label of this.ranked()) {
      if (shown.size >= MOST) break;
      const w = this.width(g, label.id), spot = this.spot(label, w, taken);
      if (!spot) continue;
      taken.push(spot);
      shown.add(label.i);
      g.lineWidth = 3.5;
      g.lineJoin = 'round';
      g.strokeStyle = colours.ground;
      g.globalAlpha = 0.85;
      g.strokeText(label.id, spot.x, spot.y + HEIGHT / 2);
      g.globalAlpha = 1;
      g.fillStyle = label.i === scene.b ? colours.b : label.i === scene.a ? colours.a
        : !model.isReachable(label.i) ? colours.faint : label.rank < 4 ? colours.ink : colours.soft;
      g.fillText(label.id, spot.x, spot.y + HEIGHT / 2);
    }
    this.before = shown;
  }

  /** Frames by importance: chosen, under the pointer, on the path, roots, those shown before, near ones. */
  ranked() {
    const { scene } = this, { model } = scene, at = new Vector3(), list = [];
    for (let i = 0; i < model.count; ++i) {
      const place = scene.isDrawn(i) ? scene.project(i, at) : null;
      if (!place) continue;
      const important = i === scene.b || i === scene.a ? 0 : i === this.hovered ? 1 : scene.path.has(i) ? 2
        : model.parent[i] < 0 ? 3 : 4;
      if (!scene.show.names && important > 1) continue;
      const near = place.distance * (this.before.has(i) ? 0.7 : 1);
      list.push({ i, id: model.ids[i], rank: important, near, ...place });
    }
    return list.sort((p, q) => p.rank - q.rank || p.near - q.near);
  }

  spot(label, w, taken) {
    // Names of lesser frames keep a distance, so that a crowd stays legible.
    const apart = label.rank < 4 ? 4 : 18;
    for (const [dx, dy] of [[9, -HEIGHT - 2], [9, 4], [-w - 9, -HEIGHT - 2], [-w - 9, 4]]) {
      const box = { x: label.x + dx, y: label.y + dy, w, h: HEIGHT };
      const free = taken.every((other) => box.x > other.x + other.w + apart || other.x > box.x + box.w + apart ||
        box.y > other.y + other.h + apart / 3 || other.y > box.y + box.h + apart / 3);
      if (free) return box;
      if (label.rank < 2) return box;
    }
    return null;
  }
}
