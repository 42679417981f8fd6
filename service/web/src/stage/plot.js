// Plot of joint angles over one cycle, or over the last seconds of motion without cycles.

import { make } from "../controls/widgets.js";

const NAMES = ["Hip", "Knee", "Shoulder", "Elbow"];
const WIDE = 100;
const HIGH = 60;
const RANGE = { Hip: [-40, 60], Knee: [-10, 95], Shoulder: [-50, 50], Elbow: [-5, 95] };
const KEPT = 90; // frames

/** An SVG element. */
export const svg = (tag, attributes) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
};

/** A line through `values` at even steps, in a picture of `wide` × `high`. */
export const pathOf = (values, [low, high], { closed = false, room = null, wide = WIDE, high: tall = HIGH } = {}) => {
  const points = closed ? [...values, values[0]] : values;
  const last = Math.max(1, (room ?? points.length) - 1);
  let joined = false; // NaN is a gap
  return points
    .map((v, i) => {
      if (Number.isNaN(v)) return (joined = false) || "";
      const step = `${joined ? "L" : "M"}${((wide * i) / last).toFixed(2)} ${((tall * (high - v)) / (high - low)).toFixed(2)}`;
      joined = true;
      return step;
    })
    .join("");
};

/** Four small charts of flexion, left and right, of one walker or two. */
export class Plot {
  constructor(element) {
    this.growing = false;
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

  /** Draw the cycles of one walker or two; streamed motion is drawn by `mark`. */
  show(walkers) {
    const words = [["left", "left"], ["right", "right"], ...(walkers.length > 1 ? [["other", "walker B"]] : [])];
    this.legend.replaceChildren(...words.map(([className, textContent]) => make("span", { className, textContent })));
    this.growing = !walkers[0].curves;
    const cuts = (walkers[0].marks ?? []).map((mark) => `M${(WIDE * mark).toFixed(2)} 0V${HIGH}`).join("");
    for (const { name, picture, marks, lines, now } of this.charts) {
      marks.setAttribute("d", cuts);
      lines.forEach((line, i) => {
        const curves = walkers[i >> 1]?.curves;
        line.setAttribute("d", curves ? pathOf(curves[name][i & 1], RANGE[name], { closed: walkers[i >> 1].cyclic }) : "");
      });
      now.style.display = this.growing ? "none" : "";
      picture.setAttribute("aria-label", this.described(name, walkers[0]));
    }
  }

  described(name, { curves, cyclic }) {
    if (!curves) return `${name} flexion over the last seconds`;
    const known = curves[name][0].filter((v) => !Number.isNaN(v));
    if (!known.length) return `${name} flexion: not captured on the left`;
    const [least, most] = [Math.min, Math.max].map((f) => Math.round(f(...known)));
    return `${name} flexion over ${cyclic ? "one cycle" : "the capture"}: from ${least} to ${most} degrees on the left`;
  }

  /** Mark the current time; of streamed motion, draw the last seconds. */
  mark(walkers, moments, chosen) {
    if (this.growing) {
      walkers.forEach((walker, i) => this.grown(walker.recent(moments[i], KEPT), i));
      return;
    }
    const x = WIDE * walkers[chosen].share(moments[chosen]);
    for (const { now } of this.charts) now.setAttribute("transform", `translate(${x.toFixed(1)} 0)`);
  }

  grown(curves, i) {
    for (const { name, lines } of this.charts) {
      curves[name].forEach((values, side) => {
        lines[2 * i + side].setAttribute("d", pathOf(values, RANGE[name], { room: KEPT }));
      });
    }
  }
}
