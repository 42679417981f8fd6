// Marker maps: which points of a file are which landmarks of the body. As TOML, in an editor, and remembered.

const KEY = "motionenv.map."; // in the browser's storage
const MOST = 200; // maps that are remembered

const quoted = (text) => JSON.stringify(text).replaceAll("\x7f", "\\u007f"); // what TOML and JSON escape alike

function written(weights) {
  const [first, ...more] = Object.entries(weights);
  if (!more.length) return quoted(first[0]);
  return `{ ${[first, ...more].map(([point, weight]) => `${quoted(point)} = ${weight}`).join(", ")} }`;
}

/** A marker map as TOML, which the service reads; `entries`: for each landmark, points and their weights. */
export function toToml(name, entries) {
  const lines = [...entries].map(([landmark, weights]) => `${landmark} = ${written(weights)}`);
  return [`name = ${quoted(name)}`, "", "[points]", ...lines, ""].join("\n");
}

/** A map that is being edited, with undo. `entries`: for each landmark, points and their weights. */
export class MapEditor {
  constructor(entries) {
    this.entries = entries;
    this.past = [];
  }

  /** The landmark that a point alone marks, or undefined. */
  landmarkOf(point) {
    return [...this.entries].find(([, weights]) => alone(weights) === point)?.[0];
  }

  /** Let a point mark a landmark; returns the landmark that it marked before, if another. */
  assign(landmark, point) {
    const before = this.landmarkOf(point);
    if (before === landmark) return undefined;
    this.change((entries) => {
      if (before) entries.delete(before);
      entries.set(landmark, { [point]: 1 });
    });
    return before;
  }

  /** Forget the points of a landmark. */
  clear(landmark) {
    if (this.entries.has(landmark)) this.change((entries) => entries.delete(landmark));
  }

  /** Replace all entries. */
  replace(entries) {
    this.past.push(this.entries);
    this.entries = entries;
  }

  change(by) {
    const entries = new Map(this.entries);
    by(entries);
    this.replace(entries);
  }

  /** Take back the last change. */
  undo() {
    this.entries = this.past.pop() ?? this.entries;
  }
}

/** The point that marks a landmark alone, or undefined. */
export function alone(weights = {}) {
  const points = Object.keys(weights);
  return points.length === 1 ? points[0] : undefined;
}

/** FNV-1a (64 bits) of the sorted names: the same for files with the same points. */
export function hashOf(names) {
  let hash = 0xcbf29ce484222325n;
  for (const byte of new TextEncoder().encode([...names].sort().join("\0"))) {
    hash = BigInt.asUintN(64, (hash ^ BigInt(byte)) * 0x100000001b3n);
  }
  return hash.toString(16).padStart(16, "0");
}

/** The map (TOML) that was used for files with these points; null if there is none. */
export function remembered(names) {
  try {
    return localStorage.getItem(KEY + hashOf(names));
  } catch {
    return null; // a browser that stores nothing
  }
}

/** Remember a map (TOML) for files with these points; null forgets it. */
export function remember(names, map) {
  try {
    localStorage.removeItem(KEY + hashOf(names));
    if (map === null) return;
    const kept = Object.keys(localStorage).filter((key) => key.startsWith(KEY));
    if (kept.length >= MOST) localStorage.removeItem(kept[0]);
    localStorage.setItem(KEY + hashOf(names), map);
  } catch {
    // A browser that stores nothing, or no more: the map is used, and isn't remembered.
  }
}
