// Joint angles over one cycle; where there are no cycles, over the last seconds.

import { make } from "./sliders.js";

const NAMES = ["Hip", "Knee", "Shoulder", "Elbow"];
const WIDE = 100;
const HIGH = 60;
const RANGE = { Hip: [-40, 60], Knee: [-10, 80], Shoulder: [-50, 50], Elbow: [-5, 95] };
const KEPT = 90; // frames

const svg = (tag, attributes) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
};

const path = (values, [low, high], { closed = false, room = null } = {}) => {
  const points = closed ? [...values, values[0]] : values;
  const last = Math.max(1, (room ?? points.length) - 1);
  let joined = false; // a gap is where nothing is known
  return points
    .map((v, i) => {
      if (Number.isNaN(v)) return (joined = false) || "";
      const step = `${joined ? "L" : "M"}${((WIDE * i) / last).toFixed(2)} ${((HIGH * (high - v)) / (high - low)).toFixed(2)}`;
      joined = true;
      return step;
    })
    .join("");
};

/** Four small charts of flexion, left and right, of one walker or two. */
export class Plot {
  constructor(element) {
    this.history = null;
    this.charts = NAMES.map((name) => {
      const picture = svg("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, preserveAspectRatio: "none", role: "img" });
      const [low, high] = RANGE[name];
      const zero = (HIGH * high) / (high - low);
      picture.append(svg("line", { x1: 0, x2: WIDE, y1: zero, y2: zero }));
      const lines = ["left", "right", "left other", "right other"].map((kind) => svg("path", { class: kind }));
      const now = svg("line", { class: "now", y1: 0, y2: HIGH, x1: 0, x2: 0 });
      const marks = svg("path", { class: "marks" });
      picture.append(marks, ...lines, now);
      const title = make("span", { textContent: name });
      const range = make("span", { textContent: `${low}° to ${high}°` });
      element.append(make("figure", {}, make("figcaption", {}, title, range), picture));
      return { name, picture, marks, lines, now };
    });
    this.legend = make("p", { className: "legend" });
    element.append(this.legend);
  }

  /** Draw the cycles of one walker or two. */
  show(walkers) {
    const words = [["left", "left"], ["right", "right"], ...(walkers.length > 1 ? [["other", "walker B"]] : [])];
    this.legend.replaceChildren(...words.map(([className, textContent]) => make("span", { className, textContent })));
    this.history = walkers[0].curves ? null : Object.fromEntries(NAMES.map((name) => [name, [[], []]]));
    const cuts = (walkers[0].marks ?? []).map((mark) => `M${(WIDE * mark).toFixed(2)} 0V${HIGH}`).join("");
    for (const { name, picture, marks, lines, now } of this.charts) {
      marks.setAttribute("d", cuts);
      lines.forEach((line, i) => {
        const curves = walkers[i >> 1]?.curves;
        line.setAttribute("d", curves ? path(curves[name][i & 1], RANGE[name], { closed: walkers[i >> 1].cyclic }) : "");
      });
      now.style.display = this.history ? "none" : "";
      picture.setAttribute("aria-label", this.described(name, walkers[0]));
    }
  }

  described(name, { curves, cyclic }) {
    if (!curves) return `${name} flexion over the last seconds`;
    const known = curves[name][0].filter((v) => !Number.isNaN(v));
    const [least, most] = [Math.min, Math.max].map((f) => Math.round(f(...known)));
    return `${name} flexion over ${cyclic ? "one cycle" : "the capture"}: from ${least} to ${most} degrees on the left`;
  }

  /** Mark a moment of the cycle, or take in what the angles are now. */
  mark(phase, walker) {
    if (this.history) {
      this.collect(walker.flexions());
      return;
    }
    const x = WIDE * (phase - Math.floor(phase));
    for (const { now } of this.charts) now.setAttribute("transform", `translate(${x.toFixed(1)} 0)`);
  }

  collect(flexions) {
    for (const { name, lines } of this.charts) {
      flexions[name].forEach((value, side) => {
        const kept = this.history[name][side];
        kept.push(value);
        if (kept.length > KEPT) kept.shift();
        lines[side].setAttribute("d", path(kept, RANGE[name], { room: KEPT }));
      });
    }
  }
}
