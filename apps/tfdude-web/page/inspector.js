// B in A: the numbers that the server has got from the owners, exactly as `tfdude lookup` prints them.
import { UNSPECIFIED } from './model.js';
import { Plot } from './plot.js';
import { eigen, meanVelocity, positionCovariance, toRpy } from './spatial.js';
import { clock, degrees, element, fixed, metres, seconds } from './text.js';

const NAMES = ['x', 'y', 'z', 'roll', 'pitch', 'yaw'];
// Of a normal distribution in three dimensions.
const SHARES = { 1: '19.9 %', 2: '73.9 %', 2.795: '95 %', 3: '97.1 %', 30: 'all' };

const note = (text, kind) => element('p', { class: `note ${kind}` }, text);

export class Inspector {
  /** @param on  functions: ends(a, b), why() */
  constructor(model, on) {
    this.model = model;
    this.on = on;
    this.plot = new Plot();
    this.answer = null;
    this.why = null;          // the explanation of the pair
    this.k = 3;
    this.recorded = false;    // a recording is shown
    this.box = document.getElementById('inspector');
    const end = (letter) => element('input', {
      type: 'text', id: `end-${letter}`, list: 'all-frames',
      placeholder: letter === 'a' ? 'seen from' : 'choose a frame',
      spellcheck: 'false', autocomplete: 'off', 'aria-label': `Frame ${letter.toUpperCase()}`,
      onchange: () => this.on.ends(this.a.value, this.b.value),
    });
    this.a = end('a');
    this.b = end('b');
    this.body = element('div', { class: 'block' });
    // The button stays when the numbers are drawn again, so that a click is not lost.
    this.ask = element('button', { id: 'ask-why', title: 'Ask the owners what makes this uncertain, or why there is ' +
      'no answer', onclick: () => this.on.why() }, 'Why?');
    this.reasonBody = element('div', {});
    this.reason = element('div', { class: 'block', id: 'why' }, this.ask, this.reasonBody);
    this.more = element('div', { class: 'block' });
    this.canvas = element('canvas', { id: 'plot' });
    this.plotBox = element('div', { class: 'block' }, this.plotTitle = element('h2', {}), this.canvas);
    this.choices = element('datalist', { id: 'all-frames' });
    this.box.append(element('div', { class: 'ends' },
      element('b', { class: 'a' }, 'A'), this.a,
      element('button', { class: 'swap icon', title: 'Swap (X)',
        onclick: () => this.on.ends(this.b.value, this.a.value) }, '⇅'),
      element('b', { class: 'b' }, 'B'), this.b), this.choices, this.body, this.reason, this.plotBox,
      this.more);
    this.draw();
  }

  setFrames() {
    this.choices.replaceChildren(...this.model.ids.map((id) => element('option', { value: id })));
  }

  setEnds(a, b) {
    if (a !== this.a.value || b !== this.b.value) {
      this.plot.clear();
      this.answer = null;
      this.why = null;
    }
    for (const [input, id] of [[this.a, a], [this.b, b]]) {
      input.value = id;
      input.title = id;  // which may be longer than its box
    }
    this.draw();
  }

  take(answer) {
    if (answer.from !== this.a.value || answer.to !== this.b.value) return;
    this.answer = answer;
    this.dirty = true;
    if (answer.error || (answer.past && !this.recorded)) return;
    const { translation, rotation: q } = answer;
    if (!answer.stamp_ns) return;
    const t = Number(BigInt(answer.stamp_ns) / 1000n) * 1e-6;
    if (this.recorded) this.plot.forgetAfter(t);
    this.plot.add(t, [...translation, ...toRpy(q)], this.sigmas(answer), answer);
  }

  /** Something else is shown: a recording, or the robot. */
  changeOver(recorded) {
    this.recorded = recorded;
    this.plot.end = recorded ? '0 s' : 'now';
    this.plot.clear();
    this.answer = null;
    this.why = null;
    this.draw();
  }

  takeWhy(why) {
    if (why.from !== this.a.value || why.to !== this.b.value) return;
    this.why = why;
    this.dirty = true;
  }

  /** Beside the numbers: of the position along the axes of A, then of the rotation about the axes of B. */
  sigmas(answer) {
    const rows = answer.covariance || answer.covariance_of_specified;
    if (!rows) return null;
    const S = positionCovariance(answer.rotation, rows);
    return rows.map((row, i) => Math.sqrt(Math.max(0, i < 3 ? S[4 * i] : row[i])));
  }

  /** The joints that move unspecified edges and have had no sample, by the names that samples have. */
  assumed(answer) {
    const moved = new Set(answer.basis.unspecified);
    const joints = this.model.joints.filter((joint) => !joint.measured && moved.has(joint.frame));
    return [...new Set(joints.map((joint) => (joint.mimic ? joint.mimic.joint : joint.name)))].sort();
  }

  draw() {
    this.dirty = false;
    const parts = [], more = [];
    const { answer } = this;
    this.plotBox.hidden = !answer || Boolean(answer.error) || this.plot.samples.length < 2;
    if (!this.b.value) {
      parts.push(note('Choose a frame in the list or in the picture to see where it is, and how sure that is.', ''));
    } else if (!answer) {
      parts.push(note('Asking its owners …', ''));
    } else {
      if (answer.error) parts.push(element('p', { class: 'note bad' }, answer.error));
      else parts.push(...this.pose(answer));
      if (!answer.error) more.push(...this.ellipsoid(answer));
      more.push(...this.path(answer));
    }
    this.body.replaceChildren(...parts);
    this.reason.hidden = !this.b.value || !answer || this.recorded;  // a recording has no owners to ask
    this.reasonBody.replaceChildren(...(this.why ? this.explanation(this.why) : []));
    this.more.replaceChildren(...more);
    if (!this.plotBox.hidden) {
      const unit = this.plot.component < 3 ? 'm' : '°';
      this.plotTitle.textContent = `${NAMES[this.plot.component]} [${unit}] in the last 30 s, ±${this.k} σ`;
      this.plot.k = this.k;
      this.plot.draw(this.canvas);
    }
  }

  pose(answer) {
    const q = answer.rotation, rpy = toRpy(q), s = this.sigmas(answer);
    const complete = Boolean(answer.covariance);
    const rows = NAMES.map((name, i) => element('tr', {
      class: i === this.plot.component ? 'on' : '', title: 'Plot it',
      onclick: () => { this.plot.component = i; this.draw(); },
    },
    element('th', { class: i < 3 ? name : '' }, name),
    element('td', {}, i < 3 ? `${fixed(answer.translation[i], 6)} m`
      : `${fixed((rpy[i - 3] * 180) / Math.PI, 4)}°`),
    element('td', { class: 's' }, s ? `± ${i < 3 ? metres(s[i]) : degrees(s[i])}` : '')));
    const notes = [];
    const { basis } = answer;
    if (answer.unreachable) notes.push(note(`${answer.unreachable}. These are its last values.`, 'bad'));
    if (!complete) {
      const edges = basis.unspecified.join(', ');
      notes.push(note(`σ is not given for ${edges}: these numbers are of the other edges only.`, 'warn'));
      const joints = this.assumed(answer);
      const have = joints.length === 1 ? 'joint has' : 'joints have';
      if (joints.length) notes.push(note(`${joints.length} ${have} had no sample: ${joints.join(', ')}.`, 'warn'));
    }
    notes.push(note(this.distance(answer), ''));
    const velocity = this.velocity(answer);
    if (velocity) notes.push(velocity);
    if (s) notes.push(note('σ of x, y, z is along the axes of A, of the rotation about the axes of B.', ''));
    if (basis.bound) notes.push(note('σ is an upper bound: some correlations are not known.', ''));
    const copy = element('button', { class: 'copy', title: 'Copy as JSON',
      onclick: () => navigator.clipboard.writeText(JSON.stringify(answer)) }, 'copy');
    return [element('h2', {}, 'B in A', copy), element('table', { class: 'pose' }, element('tbody', {}, ...rows)),
      element('p', { class: 'note', title: 'x, y, z, w' }, `quaternion ${q.map((c) => fixed(c, 6)).join('  ')}`),
      element('p', { class: 'note' }, this.instant(answer)), ...notes];
  }

  /** Of the two origins, with the deviation along the line between them. */
  distance(answer) {
    const t = answer.translation, d = Math.hypot(...t), rows = answer.covariance || answer.covariance_of_specified;
    if (!rows || d === 0) return `Distance ${metres(d)}.`;
    const S = positionCovariance(answer.rotation, rows);
    let variance = 0;
    for (let i = 0; i < 3; ++i) for (let j = 0; j < 3; ++j) variance += (t[i] * S[3 * i + j] * t[j]) / (d * d);
    return `Distance ${metres(d)} ± ${metres(Math.sqrt(Math.max(0, variance)))}.`;
  }

  /** Of B, the mean of the last tenth of a second or somewhat more; null: too little is known of the time before. */
  velocity(answer) {
    const { samples } = this.plot, after = samples[samples.length - 1];
    if (!after || after.answer.stamp_ns !== answer.stamp_ns) return null;
    const ago = ({ answer: { stamp_ns } }) => Number(BigInt(answer.stamp_ns) - BigInt(stamp_ns)) * 1e-9;
    const before = [...samples].reverse().find((sample) => ago(sample) >= 0.1);
    if (!before || ago(before) > 1) return null;
    const { linear, angular } = meanVelocity(before.answer, answer, ago(before));
    const along = (v) => v.map((c) => fixed(c, 3)).join('  ');
    const made = note(`Velocity ${metres(Math.hypot(...linear))}/s, ${degrees(Math.hypot(...angular))}/s ` +
      `(mean of ${seconds(ago(before))}).`, '');
    made.title = `x, y, z along the axes of A: ${along(linear)} m/s, ${along(angular)} rad/s\n` +
      'tfdude velocity says how certain it is.';
    return made;
  }

  /** Why B in A is so uncertain, or why there is no answer: as `tfdude why` says it. */
  explanation(why) {
    if (why.cause) {
      const { obstacle, frame, partition, needs, similar } = why.cause;
      const where = [frame && `frame ${frame}`, partition && `partition ${partition}`].filter(Boolean).join(' of ');
      const parts = [note(`${obstacle.replaceAll('_', ' ')}${where ? `: ${where}` : ''}.`, 'bad')];
      if (needs) parts.push(note(`It needs ${needs}.`, ''));
      if (similar.length) parts.push(note(`Did you mean ${similar.join(', ')}?`, 'warn'));
      return parts;
    }
    const size = (variance) => (why.is_rotation ? degrees : metres)(Math.sqrt(Math.max(0, variance)));
    const along = why.direction.map((c) => fixed(c, 2)).join(' ');
    const parts = [note(`± ${size(why.variance)} ${why.is_rotation ? 'about' : 'along'} ${along}, ` +
      'where it is the least certain. Of this variance:', '')];
    for (const [kind, list] of [['', why.edges], ['source ', why.sources], ['joint ', why.joints]]) {
      const shown = list.slice(0, 6);
      if (!shown.length) continue;
      parts.push(element('div', { class: 'bars' }, ...shown.map((one) => element('div', {},
        element('span', { class: 'name', title: kind + one.name }, kind + one.name),
        element('span', { class: 'bar', title: size(one.variance) },
          element('i', { style: `width:${Math.max(0, Math.min(100, 100 * one.share))}%` })),
        element('span', { class: 'n' }, `${(100 * one.share).toFixed(0)} %`)))));
    }
    const { best } = why;
    if (best) {
      parts.push(note(`Measuring ${best.to} in ${best.from} would leave ± ${size(best.variance_after)}.`, ''));
    }
    if (why.assumed_joints.length) parts.push(note(`Nobody has measured ${why.assumed_joints.join(', ')}.`, 'warn'));
    return parts;
  }

  instant(answer) {
    if (!answer.stamp_ns) return 'Static: it holds for all times.';
    const stamp = BigInt(answer.stamp_ns), age = Number(this.model.now - stamp) * 1e-9;
    return answer.past ? `At ${clock(stamp)}.` : `At ${clock(stamp)}, ${seconds(Math.max(0, age))} ago.`;
  }

  /** The semi-axes of the ellipsoid of B's position, in A. */
  ellipsoid(answer) {
    const rows = answer.covariance || answer.covariance_of_specified;
    if (!rows || rows.slice(0, 3).every((row, i) => row[i] === 0)) {
      return answer.covariance ? [element('p', { class: 'note' }, 'Declared as exact: σ is zero.')] : [];
    }
    const { values, vectors } = eigen(positionCovariance(answer.rotation, rows));
    const most = Math.sqrt(values[0]) || 1;
    const title = answer.covariance ? `${this.k} σ contains ${SHARES[this.k]}` : `${this.k} σ of the other edges`;
    return [element('h2', {}, `Ellipsoid · ${title}`),
      element('div', { class: 'bars' }, ...values.map((value, i) => element('div', {},
        element('span', { class: 'name', title: 'direction in A' },
          `along ${vectors[i].map((c) => fixed(c, 2)).join(' ')}`),
        element('span', { class: 'bar' }, element('i', { style: `width:${(100 * Math.sqrt(value)) / most}%` })),
        element('span', { class: 'n' }, metres(this.k * Math.sqrt(value))))))];
  }

  path(answer) {
    const { model } = this, parts = [];
    if (answer.path && answer.path.length) {
      parts.push(element('h2', {}, 'Path by owners'), element('ul', { class: 'path' }, ...answer.path.map((segment) => {
        const owner = model.partitions.findIndex((one) => one.name === segment.partition);
        const gone = owner >= 0 && !model.partitions[owner].reachable;
        const colour = gone ? 'var(--faint)' : this.colours[owner % this.colours.length];
        return element('li', { style: `--colour:${colour}`, class: gone ? 'gone' : '',
          title: `${segment.partition}: ${segment.from} → ${segment.to}` },
          element('b', {}, segment.partition), `  ${segment.from} → ${segment.to}${gone ? ', unreachable' : ''}`);
      })));
    }
    const a = model.index.get(answer.from), b = model.index.get(answer.to);
    if (a === undefined || b === undefined) return parts;
    const way = model.path(a, b);
    if (!way) {
      const root = (i) => model.ids[model.rootOf(i)];
      parts.push(note(`${answer.from} is below ${root(a)}, ${answer.to} below ${root(b)}.`, ''));
      return parts;
    }
    return parts.concat(this.budget([...way.up, ...way.down]));
  }

  /** The edges of the path, with their own deviations: what to improve first. */
  budget(edges) {
    const { model } = this;
    const total = (i, ...places) => Math.sqrt(places.reduce((sum, k) => sum + model.sigma[36 * i + k], 0));
    const sizes = edges.map((i) => ({ i, s: total(i, 0, 7, 14), r: total(i, 21, 28, 35) }));
    const most = Math.max(...sizes.map(({ s }) => s), 1e-12), turn = Math.max(...sizes.map(({ r }) => r), 1e-12);
    if (sizes.length === 0) return [];
    const rows = sizes.map(({ i, s, r }) => {
      const width = (100 * s) / most || (100 * r) / turn;
      const text = s > 0 ? metres(s) : r > 0 ? degrees(r) : 'exact';
      return element('div', {},
        element('span', { class: 'name', title: model.ids[i] }, model.ids[i]),
        element('span', { class: 'bar', title: `${metres(s)}, ${degrees(r)}` },
          element('i', { style: `width:${width}%` })),
        element('span', { class: 'n' }, model.sigmaKind[i] === UNSPECIFIED ? 'not given' : text));
    });
    return [element('h2', {}, 'σ of each edge'), element('div', { class: 'bars' }, ...rows)];
  }
}
