// Brings the parts of the page together.
import { Connection } from './connection.js';
import { Inspector } from './inspector.js';
import { Labels } from './labels.js';
import { drawEvents, drawJoints, drawOwners } from './lists.js';
import { Model } from './model.js';
import { Recording } from './recording.js';
import { Scene } from './scene.js';
import { element } from './text.js';
import { Timeline } from './timeline.js';
import { Tree } from './tree.js';
import { Color } from '/three/build/three.module.js';

// Distinct hues of one lightness; one a partition, in the order of their names.
const DARK = ['#7c9cff', '#f2a65a', '#5fd4a0', '#e58bd2', '#e5d15a', '#5cc8e8',
  '#ff8a80', '#b39dff', '#9fd05f', '#d7a98c'];
const LIGHT = ['#3d63e0', '#c2640a', '#128a57', '#b23c9a', '#8a7400', '#0a7fa8',
  '#cf3b34', '#6d4fd0', '#4f8a10', '#8d5a3a'];

const by = (id) => document.getElementById(id);
const model = new Model();
const scene = new Scene(by('scene'), model);
const labels = new Labels(by('labels'), scene);
const tree = new Tree(model, { choose });
const inspector = new Inspector(model, { ends: setEnds, why: () => connection.send({ op: 'why' }) });
const timeline = new Timeline(model, { ask: (request) => connection.send(request), robot: () => recording.leave() });
const recording = new Recording({
  send: (request) => connection.send(request),
  piece: (buffer) => connection.sendRaw(buffer),
  enter({ start, end }) {
    changeOver(true);
    timeline.enter(BigInt(start), BigInt(end));
  },
  leave() {
    changeOver(false);
    timeline.leave();
  },
});
const costs = [];            // what the script took for each of the last pictures, without drawing [ms]
let waiting = 0;             // the same, for messages since the last picture
let fitted = false;
let rootOfRobot = null;      // that all was seen from before a recording
let sigmasDue = 0;
let behindText = 0;

const connection = new Connection({
  text(message) {
    const take = {
      hello: () => { by('link').title = message.version; },
      structure: () => takeStructure(message),
      pair: () => takePair(message),
      why: () => inspector.takeWhy(message),
      upload: () => recording.take(message),
      recording: () => recording.takeAnswer(message),
      robot: () => recording.left(),
      status: () => takeStatus(message),
      joints: () => {
        drawJoints(model.joints = message.joints);
        inspector.dirty = true;  // it names joints that have had no sample
      },
      events: () => { model.events.push(...message.events); drawEvents(model.events = model.events.slice(-300)); },
    }[message.op];
    if (take) take();
  },
  binary(buffer) {
    const begin = performance.now();
    if (!model.take(buffer)) return;
    if (!fitted && model.known.some((known) => known)) later.fit = true;
    later.update = true;
    waiting += performance.now() - begin;
  },
  state(name) {
    by('link').className = `link ${name === 'open' ? 'good' : 'bad'}`;
    by('link').textContent = name === 'open' ? 'live' : 'no server; trying again';
    if (name !== 'open') return;
    recording.lost();
    model.events = [];
    timeline.again();
    askPair();
  },
});

const later = { update: false, fit: false };
const wanted = new URLSearchParams(location.hash.slice(1));

function takeStructure(message) {
  model.setStructure(message);
  if (model.index.has(wanted.get('root'))) {
    model.chooseRoot(wanted.get('root'));
    wanted.delete('root');
    remember();
  }
  by('count-frames').textContent = model.count;
  const roots = by('root'), option = (id) => element('option', { value: id }, id);
  const others = model.ids.filter((id) => model.parent[model.index.get(id)] >= 0).sort();
  roots.replaceChildren(
    element('optgroup', { label: 'roots' }, ...model.roots().map((i) => option(model.ids[i]))),
    element('optgroup', { label: 'frames' }, ...others.map(option)));
  roots.value = model.root;
  nameRoot();
  scene.a = model.index.get(inspector.a.value) ?? -1;
  scene.b = model.index.get(inspector.b.value) ?? -1;
  inspector.setFrames();
  setPath();
  drawOwners(model, scene.palette);
  tree.layout();
  later.update = true;
  const notice = by('notice');
  notice.hidden = model.count > 0;
  notice.replaceChildren(element('b', {}, 'No frames yet'),
    'No partition answers in this domain. Start one, for example with scripts/demo.');
}

/** Between the robot and a recording. The structure comes next. */
function changeOver(recorded) {
  if (recorded && !inspector.recorded) rootOfRobot = model.root;
  if (rootOfRobot) wanted.set('root', rootOfRobot);
  model.forget();
  takeStructure({ version: -1, partitions: [], frames: [] });
  drawEvents(model.events);
  drawJoints(model.joints);
  inspector.changeOver(recorded);
  by('link').textContent = recorded ? 'recording' : 'live';
  scene.turned = false;
  fitted = false;
}

function takePair(message) {
  inspector.take(message);
  const { answer } = inspector;
  model.chosen = answer && answer.covariance ? { root: answer.from, frame: answer.to, rows: answer.covariance } : null;
}

function takeStatus({ edges, span }) {
  Object.assign(model.rates, edges);
  if (span) model.span = span.map(BigInt);
}

function choose(i, asA) {
  if (asA) setEnds(model.ids[i], inspector.b.value);
  else setEnds(inspector.a.value || model.root, model.ids[i]);
}

function setEnds(a, b) {
  inspector.setEnds(a, b);
  model.chosen = null;
  remember();
  tree.a = a;
  tree.b = b;
  scene.a = model.index.get(a) ?? -1;
  scene.b = model.index.get(b) ?? -1;
  setPath();
  askPair();
  tree.draw();
  later.update = true;
}

function setPath() {
  const way = scene.a >= 0 && scene.b >= 0 ? model.path(scene.a, scene.b) : null;
  scene.path = new Set(way ? [...way.up, way.top, ...way.down] : []);
}

function askPair() {
  const a = inspector.a.value, b = inspector.b.value;
  connection.send(a && b ? { op: 'pair', a, b } : { op: 'pair', a: '', b: '' });
}

/** Its name may be longer than its box. */
function nameRoot() { by('root').title = `${model.root || ''}\nAll poses and ellipsoids are relative to this frame`; }

function seeFrom(id) {
  model.chooseRoot(id);
  by('root').value = id;
  nameRoot();
  remember();
  const wasA = inspector.a.value;
  if (inspector.b.value && wasA !== id) setEnds(id, inspector.b.value);
  model.solveSigmas();
  scene.fit();
  tree.draw();
}

/** What is looked at is a part of the address, so that it can be passed on. */
function remember() {
  const view = { root: model.root, a: inspector.a.value, b: inspector.b.value };
  const text = new URLSearchParams(Object.entries(view).filter(([, id]) => id)).toString();
  history.replaceState(null, '', `${location.pathname}${location.search}#${text}`);
}

function setTheme(light) {
  document.documentElement.classList.toggle('light', light);
  localStorage.setItem('tfdude-theme', light ? 'light' : 'dark');
  const palette = light ? LIGHT : DARK;
  scene.palette = palette;
  tree.colours = palette;
  inspector.colours = palette;
  scene.setColours(palette.map((text) => new Color(text)));
  drawOwners(model, palette);
  tree.draw();
  later.update = true;
}

function picture(time) {
  requestAnimationFrame(picture);
  let begin = performance.now();
  timeline.advance(begin);
  if (model.advance(begin)) later.update = true;
  if (later.update) {
    later.update = false;
    // Poses move at each picture; covariances need not be computed for all frames as often.
    if (model.sigmaStale || time > sigmasDue) {
      model.solveSigmas();
      sigmasDue = time + 100;
    }
    scene.update();
    scene.updateSigmas();
    if (later.fit) {
      later.fit = false;
      fitted = true;
      scene.fit();
    }
  }
  const drawing = performance.now(), drawn = scene.draw();
  begin += performance.now() - drawing;
  if (drawn) labels.draw();
  if (time > behindText) {
    behindText = time + 500;
    keepInView();
    tree.draw();
    inspector.draw();
    timeline.draw();
    by('legend').textContent = `grid ${scene.gridStep >= 1 ? scene.gridStep : Math.round(scene.gridStep * 1000)} ${
      scene.gridStep >= 1 ? 'm' : 'mm'}`;
  } else if (inspector.dirty && time > (inspector.due || 0)) {
    inspector.due = time + 100;
    inspector.draw();
  }
  if (drawn) {
    costs.push(performance.now() - begin + waiting);
    waiting = 0;
  }
  if (costs.length > 2000) costs.splice(0, 1000);
}

/** Shows all again when something lies outside, unless the user has turned the view: then the button says so. */
function keepInView() {
  const outside = fitted && scene.isOutside();
  if (outside && !scene.turned && !scene.following) later.fit = later.update = true;
  by('fit').classList.toggle('wanted', outside && scene.turned);
}

/** How many standard deviations the shapes have. */
function setShape(k) {
  scene.k = inspector.k = k;
  by('sigma').value = String(k);
  later.update = true;
  inspector.draw();
}

function press(button) {
  const on = button.getAttribute('aria-pressed') !== 'true';
  button.setAttribute('aria-pressed', on);
  scene.show[button.dataset.show] = on;
  later.update = true;
}

function follow(on) {
  scene.following = on;
  by('follow').setAttribute('aria-pressed', on);
  later.update = true;
}

function listen() {
  by('toggles').addEventListener('click', ({ target }) => target.dataset.show && press(target));
  by('root').addEventListener('change', ({ target }) => seeFrom(target.value));
  by('sigma').addEventListener('change', ({ target }) => setShape(Number(target.value)));
  by('theme').addEventListener('click', () => setTheme(!document.documentElement.classList.contains('light')));
  by('help').addEventListener('click', () => by('keys').showModal());
  by('fit').addEventListener('click', () => scene.fit());
  by('follow').addEventListener('click', () => follow(!scene.following));
  for (const [button, name] of [['toggle-side', 'no-side'], ['toggle-inspector', 'no-inspector']]) {
    by(button).addEventListener('click', () => document.querySelector('main').classList.toggle(name));
  }
  document.querySelector('.tabs').addEventListener('click', ({ target }) => {
    const chosen = target.closest('button');
    if (!chosen) return;
    for (const tab of document.querySelectorAll('.tabs button')) {
      tab.setAttribute('aria-selected', tab === chosen);
      by(`tab-${tab.dataset.tab}`).hidden = tab !== chosen;
    }
    tree.draw();
  });
  let pressed = null;
  const canvas = by('scene');
  canvas.addEventListener('pointerdown', (event) => { pressed = [event.clientX, event.clientY]; });
  canvas.addEventListener('pointerup', (event) => {
    if (!pressed || Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
    const box = canvas.getBoundingClientRect();
    const i = scene.pick(event.clientX - box.left, event.clientY - box.top);
    if (i < 0) return;
    choose(i, event.shiftKey);
    tree.moveTo(i);
  });
  canvas.addEventListener('pointermove', (event) => {
    if (event.buttons) return;
    const box = canvas.getBoundingClientRect();
    const hovered = scene.pick(event.clientX - box.left, event.clientY - box.top);
    if (hovered !== labels.hovered) { labels.hovered = hovered; scene.dirty = true; }
    canvas.style.cursor = hovered >= 0 ? 'pointer' : 'grab';
  });
  new ResizeObserver(() => scene.resize(by('view').clientWidth, by('view').clientHeight)).observe(by('view'));
  document.addEventListener('keydown', key);
}

function key(event) {
  if (/INPUT|SELECT/.test(event.target.tagName) && event.target.type !== 'range') return;
  if (event.ctrlKey || event.metaKey || event.altKey || by('keys').open) return;
  const shown = document.querySelectorAll('#toggles button');
  const chosen = inspector.b.value || tree.cursor;
  const actions = {
    '/': () => by('search').focus(),
    '?': () => by('keys').showModal(),
    ' ': () => timeline.togglePause(),
    l: () => timeline.live(),
    ',': () => timeline.step(-0.1),
    '.': () => timeline.step(0.1),
    f: () => follow(!scene.following),
    x: () => setEnds(inspector.b.value, inspector.a.value),
    r: () => chosen && seeFrom(chosen),
    Home: () => scene.fit(),
    Escape: () => { setEnds('', ''); follow(false); },
  };
  const action = actions[event.key] || (shown[Number(event.key) - 1] && (() => press(shown[Number(event.key) - 1])));
  if (!action) return;
  action();
  event.preventDefault();
}

// On a narrow screen the lists lie over the picture.
if (window.innerWidth <= 860) document.querySelector('main').classList.add('no-side', 'no-inspector');
const stored = localStorage.getItem('tfdude-theme');
setTheme(stored ? stored === 'light' : window.matchMedia('(prefers-color-scheme: light)').matches);
listen();
scene.meshes.load().then((any) => {
  document.querySelector('[data-show=meshes]').hidden = !any;
  later.update = true;
});
drawJoints([]);
drawEvents([]);
if (wanted.get('b')) setEnds(wanted.get('a') || '', wanted.get('b'));
requestAnimationFrame(picture);
// For tests and for the curious.
window.tfdude = { model, scene, inspector, timeline, tree, connection, costs, setEnds, seeFrom, setTheme, setShape, recording };
