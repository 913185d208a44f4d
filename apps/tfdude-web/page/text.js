// Numbers for people.

/** Makes an element: element('div', {class: 'row', onclick: f}, child or text, ...). */
export function element(name, properties = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
    else if (key === 'style') made.setAttribute('style', value);
    else if (value !== null && value !== undefined) made.setAttribute(key, value);
  }
  for (const child of children) if (child !== null && child !== undefined) made.append(child);
  return made;
}

/** With so many decimals; no zero has a sign. */
export function fixed(x, decimals) {
  const text = x.toFixed(decimals);
  return Number(text) === 0 ? text.replace('-', '') : text;
}

/** A length: "1.2 mm", "3.40 m". */
export function metres(x) {
  const size = Math.abs(x);
  if (size === 0) return '0';
  if (size < 1e-6) return `${(x * 1e9).toPrecision(2)} nm`;
  if (size < 1e-3) return `${(x * 1e6).toPrecision(3)} µm`;
  if (size < 1) return `${(x * 1e3).toPrecision(3)} mm`;
  if (size < 1e3) return `${x.toPrecision(3)} m`;
  return `${(x / 1e3).toPrecision(3)} km`;
}

/** An angle given in radians: "0.12°". */
export function degrees(x) {
  const d = (x * 180) / Math.PI;
  if (d === 0) return '0';
  return `${Math.abs(d) < 100 ? d.toPrecision(3) : d.toFixed(0)}°`;
}

export function seconds(s) {
  const size = Math.abs(s);
  if (size < 1) return `${(s * 1e3).toFixed(0)} ms`;
  if (size < 60) return `${s.toFixed(1)} s`;
  if (size < 3600) return `${(s / 60).toFixed(1)} min`;
  if (size < 86400) return `${(s / 3600).toFixed(1)} h`;
  return `${(s / 86400).toFixed(0)} d`;
}

export function hertz(f) {
  return f >= 100 ? `${f.toFixed(0)} Hz` : `${Number(f.toPrecision(2))} Hz`;
}

/** The time of day of a stamp in ns (BigInt); seconds, if it is of a simulation. */
export function clock(ns) {
  const ms = Number(ns / 1000000n);
  if (ms < 1e11) return `${(ms / 1e3).toFixed(2)} s`;
  return new Date(ms).toISOString().slice(11, 23);
}
