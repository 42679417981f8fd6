// Marker maps: which points of a file are which landmarks of the body. As TOML, in an editor, and remembered.

import { parse, TomlError } from "smol-toml";

const KEY = "motionenv.map."; // in the browser's storage
const MOST = 200; // maps that are remembered

/** The points that an entry of a map names: "A", { A: 0.5, B: 0.5 } or ["A", "B"]. */
export const pointsOf = (entry) =>
  typeof entry === "string" ? [entry] : Array.isArray(entry) ? entry : Object.keys(entry ?? {});

const quoted = (text) => JSON.stringify(text).replaceAll("\x7f", "\\u007f"); // what TOML and JSON escape alike

function written(entry) {
  if (typeof entry === "string") return quoted(entry);
  if (Array.isArray(entry)) return `[${entry.map(quoted).join(", ")}]`;
  const weights = Object.entries(entry).map(([point, weight]) => `${quoted(point)} = ${weight}`);
  return `{ ${weights.join(", ")} }`;
}

/** A marker map as TOML. */
export function toToml(name, entries) {
  const lines = [...entries].map(([landmark, entry]) => `${landmark} = ${written(entry)}`);
  return [`name = ${quoted(name)}`, "", "[points]", ...lines, ""].join("\n");
}

/** The entries of a map in TOML, by landmark. Throws an Error with a message for the user. */
export function fromToml(text, landmarks) {
  let found;
  try {
    found = parse(text);
  } catch (error) {
    if (!(error instanceof TomlError)) throw error;
    throw new Error(`line ${error.line} isn't TOML, such as left_knee_lateral = "KneeL"`);
  }
  if (!isTable(found.points)) throw new Error("it has no section [points]");
  const unknown = Object.keys(found.points).find((landmark) => !Object.hasOwn(landmarks, landmark));
  if (unknown) throw new Error(`there is no landmark ${unknown}`);
  const wrong = Object.entries(found.points).find(([, entry]) => !sound(entry));
  if (wrong) throw new Error(`${wrong[0]} must be the name of a point, names, or names with weights`);
  return new Map(Object.entries(found.points));
}

const isTable = (value) => typeof value === "object" && !Array.isArray(value) && !(value instanceof Date);

function sound(entry) {
  if (typeof entry === "string") return entry !== "";
  if (Array.isArray(entry)) return entry.length > 0 && entry.every((name) => typeof name === "string");
  const weights = isTable(entry) ? Object.values(entry) : [];
  return weights.length > 0 && weights.every(Number.isFinite);
}

/** A map that is being edited, with undo. `entries`: of the beginning. */
export class MapEditor {
  constructor(entries) {
    this.entries = entries;
    this.past = [];
  }

  /** The landmark that a point alone marks, or undefined. */
  landmarkOf(point) {
    return [...this.entries].find(([, entry]) => entry === point)?.[0];
  }

  /** Let a point mark a landmark; returns the landmark that it marked before, if another. */
  assign(landmark, point) {
    const before = this.landmarkOf(point);
    if (before === landmark) return undefined;
    this.change((entries) => {
      if (before) entries.delete(before);
      entries.set(landmark, point);
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
