// The last seconds of one component of B in A, with its band.

export class Plot {
  constructor() {
    this.samples = [];    // {t [s], value[6], sigma[6] or null, answer}
    this.component = 0;
    this.span = 30;
    this.k = 3;
    this.end = 'now';     // what the newest instant is called
  }

  clear() { this.samples = []; }

  /** Of a recording that goes back. */
  forgetAfter(t) { this.samples = this.samples.filter((sample) => sample.t < t); }

  add(t, value, sigma, answer) {
    const last = this.samples[this.samples.length - 1];
    if (last && t <= last.t) return;
    this.samples.push({ t, value, sigma, answer });
    while (this.samples.length && this.samples[0].t < t - this.span) this.samples.shift();
  }

  draw(canvas) {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    canvas.width = width * ratio;
    canvas.height = height * ratio;
    const g = canvas.getContext('2d'), css = getComputedStyle(document.documentElement);
    const colour = (name) => css.getPropertyValue(name).trim();
    g.scale(ratio, ratio);
    g.font = '10px system-ui, sans-serif';
    const { samples, component, k } = this, scale = component < 3 ? 1 : 180 / Math.PI;
    if (samples.length < 2) {
      g.fillStyle = colour('--faint');
      g.textAlign = 'center';
      g.fillText('nothing has moved yet', width / 2, height / 2);
      return;
    }
    const end = samples[samples.length - 1].t;
    let low = Infinity, high = -Infinity;
    // A few samples of a large deviation, as before the first measurement, would flatten all others.
    const band = ({ sigma }) => (sigma ? k * sigma[component] : 0);
    const usual = samples.map(band).sort((a, b) => a - b)[samples.length >> 1];
    for (const sample of samples) {
      const width = Math.min(band(sample), 4 * usual);
      low = Math.min(low, sample.value[component] - width);
      high = Math.max(high, sample.value[component] + width);
    }
    const margin = Math.max((high - low) * 0.08, Math.abs(high) * 1e-9, 1e-12);
    low -= margin; high += margin;
    const left = 46, right = width - 8, top = 8, bottom = height - 16;
    const x = (t) => right + ((t - end) / this.span) * (right - left);
    const y = (v) => bottom - ((v - low) / (high - low)) * (bottom - top);
    g.strokeStyle = colour('--line');
    g.fillStyle = colour('--faint');
    g.lineWidth = 1;
    g.textAlign = 'right';
    g.textBaseline = 'middle';
    for (const v of ticks(low * scale, high * scale, 3)) {
      const at = Math.round(y(v / scale)) + 0.5;
      g.beginPath(); g.moveTo(left, at); g.lineTo(right, at); g.stroke();
      g.fillText(String(Number(v.toPrecision(6))), left - 5, at);
    }
    g.textAlign = 'center';
    g.textBaseline = 'alphabetic';
    for (const s of [-30, -20, -10, 0]) {
      const at = Math.round(x(end + s)) + 0.5;
      g.beginPath(); g.moveTo(at, bottom); g.lineTo(at, bottom + 4); g.stroke();
      g.fillText(s ? `${s} s` : this.end, Math.min(right - 10, Math.max(left + 12, x(end + s))), height - 4);
    }
    g.save();
    g.beginPath();
    g.rect(left, top, right - left, bottom - top);
    g.clip();
    g.fillStyle = colour('--accent-soft');
    g.beginPath();
    samples.forEach((s, n) => g[n ? 'lineTo' : 'moveTo'](x(s.t), y(s.value[component] + band(s))));
    for (const s of [...samples].reverse()) g.lineTo(x(s.t), y(s.value[component] - band(s)));
    g.fill();
    g.strokeStyle = colour('--accent');
    g.lineWidth = 1.5;
    g.beginPath();
    samples.forEach((s, n) => g[n ? 'lineTo' : 'moveTo'](x(s.t), y(s.value[component])));
    g.stroke();
    g.restore();
  }
}

function ticks(low, high, most) {
  const raw = (high - low) / most, unit = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * unit).find((s) => s >= raw);
  const made = [];
  for (let v = Math.ceil(low / step) * step; v <= high; v += step) made.push(Math.abs(v) < step * 1e-9 ? 0 : v);
  return made;
}
