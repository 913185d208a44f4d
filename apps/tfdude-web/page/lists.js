// The lists beside the tree: owners, joints, events.
import { clock, degrees, element, metres } from './text.js';

export function drawOwners(model, colours) {
  const made = model.partitions.map(({ name, reachable, why }, i) => element('span', {
    class: reachable ? '' : 'gone', style: `--colour:${colours[i % colours.length]}`,
    title: reachable ? `partition ${name}` : why,
  }, reachable ? name : `${name} unreachable`));
  document.getElementById('owners').replaceChildren(...made);
}

export function drawJoints(joints) {
  document.getElementById('count-joints').textContent = joints.length || '';
  const box = document.getElementById('joints');
  if (!joints.length) {
    box.replaceChildren(element('div', { class: 'empty' }, 'No joints'));
    return;
  }
  box.replaceChildren(...joints.map((joint) => {
    const show = joint.type === 'prismatic' ? metres : degrees;
    const stddev = joint.variance === null ? null : Math.sqrt(joint.variance);
    const deviation = stddev === null ? '' : ` ± ${show(stddev)}`;
    const made = element('div', { class: 'joint', title: `${joint.name} moves ${joint.frame}` }, element('div', {},
      element('span', { class: 'name' }, joint.name),
      element('span', { class: 'n' }, joint.measured ? `${show(joint.position)}${deviation}`
        : `assumed ${show(joint.position)}`)));
    const { limits } = joint;
    if (limits && limits[1] > limits[0]) {
      const [low, high] = limits, at = (v) => Math.max(0, Math.min(100, (100 * (v - low)) / (high - low)));
      const range = element('div', { class: 'range' });
      if (stddev) {
        const from = at(joint.position - 3 * stddev);
        range.append(element('u', { style: `left:${from}%;width:${at(joint.position + 3 * stddev) - from}%` }));
      }
      range.append(element('i', { style: `left:${at(joint.position)}%` }));
      made.append(range, element('small', {}, element('span', {}, show(low)), element('span', {}, show(high))));
    }
    return made;
  }));
}

export function drawEvents(events) {
  document.getElementById('count-events').textContent = events.length || '';
  const made = [...events].reverse().map((event) => element('div', { class: `event ${event.level}` },
    element('time', {}, clock(BigInt(event.time_ns))), event.message));
  if (!made.length) made.push(element('div', { class: 'empty' }, 'Nothing has happened since the server started'));
  document.getElementById('events').replaceChildren(...made);
}
