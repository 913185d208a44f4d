// The tree of frames. Only the rows in view are elements, so thousands of frames cost no more than some.
import { GIVEN, UNSPECIFIED } from './model.js';
import { element, hertz, metres, seconds } from './text.js';

const ROW = 24;

export class Tree {
  /** @param on  functions: choose(index, asA) */
  constructor(model, on) {
    this.model = model;
    this.on = on;
    this.folded = new Set();
    this.rows = [];
    this.cursor = null;       // id
    this.box = document.getElementById('tree');
    this.list = document.getElementById('rows');
    this.search = document.getElementById('search');
    this.box.addEventListener('scroll', () => this.draw());
    this.search.addEventListener('input', () => this.layout());
    this.search.addEventListener('keydown', (event) => this.searchKey(event));
    this.box.addEventListener('keydown', (event) => this.key(event));
    document.getElementById('fold').addEventListener('click', () => this.foldAll());
    new ResizeObserver(() => this.draw()).observe(this.box);
  }

  searchKey(event) {
    if (event.key === 'Escape') {
      this.search.value = '';
      this.layout();
      this.box.focus();
    } else if (event.key === 'ArrowDown' || event.key === 'Enter') {
      const first = this.rows.find((row) => row.hit);
      if (first) this.moveTo(first.i);
      this.box.focus();
      event.preventDefault();
    }
  }

  /** Which rows there are. */
  layout() {
    const { model } = this;
    const sought = this.search.value.trim().toLowerCase();
    const hits = new Set(), above = new Set();
    if (sought) {
      model.ids.forEach((id, i) => {
        const owner = model.partitions[model.owner[i]].name;
        if (!id.toLowerCase().includes(sought) && !owner.toLowerCase().includes(sought)) return;
        hits.add(i);
        for (let p = model.parent[i]; p >= 0 && !above.has(p); p = model.parent[p]) above.add(p);
      });
    }
    this.rows = [];
    const stack = model.roots().reverse().map((i) => ({ i, depth: 0 }));
    while (stack.length) {
      const row = stack.pop();
      if (sought && !hits.has(row.i) && !above.has(row.i)) continue;
      row.hit = hits.has(row.i);
      row.folds = model.children[row.i].length > 0;
      row.folded = !sought && this.folded.has(model.ids[row.i]);
      this.rows.push(row);
      if (row.folded) continue;
      for (const child of [...model.children[row.i]].reverse()) stack.push({ i: child, depth: row.depth + 1 });
    }
    this.list.style.height = `${this.rows.length * ROW}px`;
    this.sought = sought;
    this.draw();
  }

  foldAll() {
    const { children, parent, ids } = this.model;
    if (this.folded.size) {
      this.folded.clear();
    } else {
      children.forEach((list, i) => { if (list.length && parent[i] >= 0) this.folded.add(ids[i]); });
    }
    this.layout();
  }

  draw() {
    const first = Math.max(0, Math.floor(this.box.scrollTop / ROW) - 2);
    const last = Math.min(this.rows.length, first + Math.ceil(this.box.clientHeight / ROW) + 5);
    const drawn = [];
    for (let n = first; n < last; ++n) drawn.push(this.row(this.rows[n], n));
    this.list.replaceChildren(...drawn);
    if (this.rows.length === 0) {
      this.list.replaceChildren(element('div', { class: 'empty' }, this.sought ? 'No frame matches' : 'No frames yet'));
    }
  }

  row(row, n) {
    const { model } = this, { i } = row, id = model.ids[i];
    const reachable = model.isReachable(i);
    const colour = reachable ? this.colours[model.owner[i] % this.colours.length] : 'var(--faint)';
    // Deep levels take less room, so that names keep theirs.
    const indent = 6 + Math.min(row.depth, 6) * 10 + Math.min(20, Math.max(0, row.depth - 6)) * 4;
    const made = element('div', {
      class: `row${id === this.cursor ? ' at' : ''}${reachable ? '' : ' gone'}${model.shown[i] ? '' : ' out'}`,
      style: `top:${n * ROW}px;padding-left:${indent}px;--colour:${colour}`,
      role: 'treeitem', 'aria-selected': id === this.cursor, title: this.titleOf(i),
      onclick: (event) => { this.cursor = id; this.on.choose(i, event.shiftKey); this.box.focus(); },
    });
    made.append(
      element('span', { class: 'fold', onclick: (event) => { event.stopPropagation(); this.fold(id); } },
        row.folds ? (row.folded ? '▸' : '▾') : ''),
      element('span', { class: 'dot' }), this.name(id), this.tags(i), this.figures(i));
    return made;
  }

  name(id) {
    const made = element('span', { class: 'name' });
    const at = this.sought ? id.toLowerCase().indexOf(this.sought) : -1;
    if (at < 0) {
      made.append(id);
    } else {
      const end = at + this.sought.length;
      made.append(id.slice(0, at), element('mark', {}, id.slice(at, end)), id.slice(end));
    }
    return made;
  }

  tags(i) {
    const id = this.model.ids[i], made = document.createDocumentFragment();
    if (id === this.a) made.append(element('span', { class: 'tag a' }, 'A'));
    if (id === this.b) made.append(element('span', { class: 'tag b' }, 'B'));
    return made;
  }

  titleOf(i) {
    const { model } = this;
    const owner = model.partitions[model.owner[i]];
    const lines = [`${model.ids[i]}, owned by ${owner.name}`];
    if (!owner.reachable) lines.push(owner.why || 'its owner does not respond');
    if (model.waits[i]) lines.push(`waits for its parent ${model.waits[i]}`);
    if (!model.shown[i]) lines.push(`not connected with ${model.root}: its root is ${model.ids[model.rootOf(i)]}`);
    const age = model.age(i), rate = model.rates[model.ids[i]];
    if (age !== null) lines.push(`newest sample ${seconds(Math.max(0, age))} ago`);
    if (age !== null && rate && rate.hz) lines.push(hertz(rate.hz));
    if (rate && rate.refused) lines.push(`${rate.refused} samples rejected`);
    if (model.parent[i] >= 0 && model.sigmaKind[i] === UNSPECIFIED) lines.push('σ not given');
    return lines.join('\n');
  }

  figures(i) {
    const { model } = this, made = element('span', { class: 'figures' });
    const remark = model.waits[i] ? `waits for ${model.waits[i]}` : !model.isReachable(i) ? 'unreachable'
      : model.noData[i] && model.parent[i] >= 0 ? 'no data'
        : !model.shown[i] && model.parent[i] < 0 ? 'unconnected' : '';
    if (remark) {
      made.append(element('span', { class: 'none' }, remark));
      return made;
    }
    let sigma = '';
    if (model.shown[i] && model.ids[i] !== model.root) {
      const c = 36 * i;
      sigma = model.covKind[i] === GIVEN ? `±${metres(Math.sqrt(model.cov[c] + model.cov[c + 7] + model.cov[c + 14]))}`
        : model.covKind[i] === UNSPECIFIED ? 'σ ?' : 'exact';
    }
    const rate = model.rates[model.ids[i]], age = model.age(i);
    // A rate says all of an edge that is fresh. Of others, the age matters.
    const stale = model.isStale(i), fresh = age !== null && !stale && rate && rate.hz;
    made.append(element('span', { class: 's' }, sigma),
      element('span', { class: `g${stale ? ' old' : ''}` },
        model.parent[i] < 0 ? '' : age === null ? 'static' : fresh ? hertz(rate.hz) : seconds(Math.max(0, age))));
    return made;
  }

  fold(id) {
    if (!this.folded.delete(id)) this.folded.add(id);
    this.layout();
  }

  moveTo(i) {
    this.cursor = this.model.ids[i];
    for (let p = this.model.parent[i]; p >= 0; p = this.model.parent[p]) this.folded.delete(this.model.ids[p]);
    this.layout();
    const n = this.rows.findIndex((row) => row.i === i);
    const top = n * ROW;
    if (top < this.box.scrollTop || top + ROW > this.box.scrollTop + this.box.clientHeight) {
      this.box.scrollTop = top - this.box.clientHeight / 2;
    }
    this.draw();
  }

  key(event) {
    const n = this.rows.findIndex((row) => this.model.ids[row.i] === this.cursor);
    const row = this.rows[n];
    const go = (to) => { if (this.rows[to]) this.moveTo(this.rows[to].i); };
    const actions = {
      ArrowDown: () => go(n + 1),
      ArrowUp: () => go(Math.max(0, n - 1)),
      ArrowRight: () => { if (row && row.folded) this.fold(this.cursor); else go(n + 1); },
      ArrowLeft: () => {
        if (row && row.folds && !row.folded) this.fold(this.cursor);
        else if (row && this.model.parent[row.i] >= 0) this.moveTo(this.model.parent[row.i]);
      },
      Enter: () => { if (row) this.on.choose(row.i, event.shiftKey); },
      a: () => { if (row) this.on.choose(row.i, true); },
    };
    if (!actions[event.key] || event.ctrlKey || event.metaKey) return;
    actions[event.key]();
    event.preventDefault();
    event.stopPropagation();
  }
}
