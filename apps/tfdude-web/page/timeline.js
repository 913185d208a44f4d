// The slider through the past: all owners at one instant. While it is used, the server keeps sending nothing new. Of a
// recording, through all of it.
import { clock, seconds } from './text.js';

const KEPT = 60;       // [s]

export class Timeline {
  /** @param on  functions: ask(request), robot() */
  constructor(model, on) {
    this.model = model;
    this.on = on;
    this.at = null;      // BigInt ns; null: now
    this.asked = 0;
    this.recorded = null;   // [start, end] of a recording that is shown, BigInt ns
    this.played = 0;        // when it was moved on [ms]; 0: it does not play
    this.slider = document.getElementById('time');
    this.output = document.getElementById('instant');
    this.slider.addEventListener('input', () => this.drag());
    document.getElementById('pause').addEventListener('click', () => this.togglePause());
    document.getElementById('live').addEventListener('click', () => this.live());
  }

  /** The instant of the slider's right end. */
  end() {
    if (this.recorded) return this.recorded[1];
    if (this.at === null) this.held = this.model.commonInstant() ?? this.model.now;
    return this.held;
  }

  drag() {
    const end = this.end();
    this.show(end + BigInt(Math.round(Number(this.slider.value) * 1e9)));
  }

  togglePause() {
    if (this.recorded) this.play(!this.played);
    else if (this.at === null) this.show(this.end()); else this.live();
  }

  step(s) {
    const end = this.end(), next = (this.at ?? end) + BigInt(Math.round(s * 1e9));
    const first = this.recorded ? this.recorded[0] : next;
    this.show(next > end ? end : next < first ? first : next);
  }

  /** Shows a recording, at its end. */
  enter(start, end) {
    this.recorded = [start, end];
    this.slider.min = -Number(end - start) * 1e-9;
    this.show(end);
  }

  /** Shows the robot as it is now. */
  leave() {
    this.recorded = null;
    this.played = 0;
    this.live();
  }

  play(on) {
    this.played = on ? performance.now() : 0;
    if (on && this.at >= this.recorded[1]) this.show(this.recorded[0]);
    this.draw();
  }

  /** Plays on, at the speed at which it was recorded. */
  advance(now) {
    const ms = now - this.played;
    if (!this.played || ms < 40) return;
    this.played = now;
    this.step(ms * 1e-3);
    if (this.at === this.recorded[1]) this.play(false);
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
    if (this.recorded) {
      this.on.robot();
      return;
    }
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
    const past = this.at !== null, { model, recorded } = this;
    document.body.classList.toggle('past', past);
    document.body.classList.toggle('playing', this.played > 0);
    document.getElementById('live').classList.toggle('on', !past);
    const kept = model.span ? Number(model.span[1] - model.span[0]) * 1e-9 : 0;
    if (!past) this.slider.min = -Math.max(1, Math.min(KEPT, Math.ceil(kept)));
    if (!past) {
      this.output.textContent = model.count ? `now · ${clock(model.now)}` : '';
    } else if (recorded) {
      const [from, length] = [this.at - recorded[0], recorded[1] - recorded[0]].map((ns) => seconds(Number(ns) * 1e-9));
      this.output.textContent = `${from} of ${length} · ${clock(this.at)}`;
    } else {
      const back = Number(this.held - this.at) * 1e-9;
      const state = back < 0.0005 ? 'paused' : `${seconds(back)} earlier`;
      this.output.textContent = `${state} · ${clock(this.at)}`;
    }
  }
}
