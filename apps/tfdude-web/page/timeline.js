// The slider through the past: all owners at one instant. While it is used, the server keeps sending nothing new.
import { clock, seconds } from './text.js';

const KEPT = 60;       // [s]

export class Timeline {
  /** @param on  functions: ask(request) */
  constructor(model, on) {
    this.model = model;
    this.on = on;
    this.at = null;      // BigInt ns; null: now
    this.asked = 0;
    this.slider = document.getElementById('time');
    this.output = document.getElementById('instant');
    this.slider.addEventListener('input', () => this.drag());
    document.getElementById('pause').addEventListener('click', () => this.togglePause());
    document.getElementById('live').addEventListener('click', () => this.live());
  }

  /** The instant of the slider's right end. */
  end() {
    if (this.at === null) this.held = this.model.commonInstant() ?? this.model.now;
    return this.held;
  }

  drag() {
    const end = this.end();
    this.show(end + BigInt(Math.round(Number(this.slider.value) * 1e9)));
  }

  togglePause() {
    if (this.at === null) this.show(this.end()); else this.live();
  }

  step(s) {
    const end = this.end(), next = (this.at ?? end) + BigInt(Math.round(s * 1e9));
    this.show(next > end ? end : next);
  }

  show(instant) {
    const end = this.end();
    this.at = instant;
    this.model.past = true;
    this.slider.value = Number(instant - end) * 1e-9;
    this.ask();
    this.draw();
  }

  /** At most 25 times a second; the last wish is always asked for. */
  ask() {
    const wait = this.asked + 40 - performance.now();
    clearTimeout(this.timer);
    if (wait > 0) {
      this.timer = setTimeout(() => this.ask(), wait);
      return;
    }
    this.asked = performance.now();
    if (this.at !== null) this.on.ask({ op: 'past', at: String(this.at) });
  }

  live() {
    clearTimeout(this.timer);
    this.at = null;
    this.model.past = false;
    this.model.noData.fill(0);
    this.slider.value = 0;
    this.on.ask({ op: 'live' });
    this.draw();
  }

  /** After the connection was lost. */
  again() {
    if (this.at !== null) this.ask();
  }

  draw() {
    const past = this.at !== null, { model } = this;
    document.body.classList.toggle('past', past);
    document.getElementById('live').classList.toggle('on', !past);
    const kept = model.span ? Number(model.span[1] - model.span[0]) * 1e-9 : 0;
    if (!past) this.slider.min = -Math.max(1, Math.min(KEPT, Math.ceil(kept)));
    if (!past) {
      this.output.textContent = model.count ? `now · ${clock(model.now)}` : '';
    } else {
      const back = Number(this.held - this.at) * 1e-9;
      const state = back < 0.0005 ? 'paused' : `${seconds(back)} earlier`;
      this.output.textContent = `${state} · ${clock(this.at)}`;
    }
  }
}
