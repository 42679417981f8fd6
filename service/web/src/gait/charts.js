// Charts of joint angles over the gait cycle, from initial contact to the next one, as gait laboratories draw them.

import { make } from "../controls/widgets.js";
import { pathOf, svg } from "../stage/plot.js";

const [WIDE, HIGH] = [220, 130]; // of the plot itself
const [LEFT, BOTTOM] = [30, 18]; // room for the axes' numbers
const STEPS = [2, 5, 10, 20, 30]; // [degrees] between ticks
const MOST_TICKS = 7;
const PERCENTS = [0, 20, 40, 60, 80, 100];

const known = (values) => values.filter((value) => value !== null);

/** Mean ± standard deviation as two lists; null where either is unknown. */
function edges({ mean, sd }) {
  const shifted = (sign) => mean.map((value, i) => (value === null || sd[i] === null ? null : value + sign * sd[i]));
  return [shifted(-1), shifted(1)];
}

/** Ticks [degrees] that hold all values. */
function ticksFor(values) {
  const [least, most] = [Math.min(...values), Math.max(...values)];
  const step = STEPS.find((size) => Math.ceil(most / size) - Math.floor(least / size) < MOST_TICKS) ?? 60;
  const first = Math.floor(least / step);
  return Array.from({ length: Math.ceil(most / step) - first + 1 }, (_, i) => (first + i) * step);
}

/**
 * One angle: `curves` are {left, right, band}, each {mean, sd} or undefined, and `off` the toe-offs [%] of both sides.
 *
 * `walks` are the means {name, left, right} of single walks, drawn thin, and boldly if they are `chosen`.
 */
export function chart(title, curves, off, walks = [], chosen = null) {
  const present = Object.values(curves).filter(Boolean);
  const means = walks.flatMap(({ left, right }) => [...(left ?? []), ...(right ?? [])]);
  const ticks = ticksFor(known([...present.flatMap((curve) => [...curve.mean, ...edges(curve).flat()]), ...means]));
  const range = [ticks[0], ticks.at(-1)];
  const up = (value) => (HIGH * (range[1] - value)) / (range[1] - range[0]);
  const picture = svg("svg", { viewBox: `${-LEFT} -6 ${WIDE + LEFT + 8} ${HIGH + BOTTOM + 6}`, role: "img" });
  picture.setAttribute("aria-label", described(title, curves));
  for (const tick of ticks) {
    picture.append(svg("line", { class: tick ? "grid" : "zero", x1: 0, x2: WIDE, y1: up(tick), y2: up(tick) }));
    picture.append(text(`${tick}°`.replace("-", "−"), -4, up(tick) + 3.5, "end"));
  }
  for (const percent of PERCENTS) picture.append(text(percent === 100 ? "100 %" : String(percent), (WIDE * percent) / 100, HIGH + 14, percent === 100 ? "end" : "middle"));
  if (curves.band) picture.append(area(curves.band, range, "band"));
  for (const side of ["left", "right"]) {
    if (!curves[side]) continue;
    picture.append(area(curves[side], range, `${side} spread`));
    for (const walk of walks) if (walk[side]) picture.append(named(svg("path", { class: `${side} walk`, d: line(walk[side], range) }), walk.name));
    const mean = chosen ? walks.find(({ name }) => name === chosen)[side] : curves[side].mean;
    if (mean) picture.append(svg("path", { class: side, d: line(mean, range) }));
    if (off[side]) picture.append(svg("line", { class: `${side} off`, x1: (WIDE * off[side]) / 100, x2: (WIDE * off[side]) / 100, y1: 0, y2: HIGH }));
  }
  return make("figure", {}, make("figcaption", { textContent: title }), picture);
}

const line = (values, range) => pathOf(values.map((value) => value ?? Number.NaN), range, { wide: WIDE, high: HIGH });

/** The area between mean − SD and mean + SD. */
function area(curve, range, className) {
  const [low, high] = edges(curve).map((edge) => edge.map((value, i) => [(WIDE * i) / (edge.length - 1), value]).filter(([, value]) => value !== null));
  const up = (value) => (HIGH * (range[1] - value)) / (range[1] - range[0]);
  const points = [...low, ...high.reverse()].map(([x, value]) => `${x.toFixed(1)},${up(value).toFixed(1)}`);
  return svg("polygon", { class: className, points: points.join(" ") });
}

/** An element with a name that is shown on hover. */
function named(element, name) {
  const title = svg("title", {});
  title.textContent = name;
  element.append(title);
  return element;
}

function text(content, x, y, anchor) {
  const element = svg("text", { x, y, "text-anchor": anchor });
  element.textContent = content;
  return element;
}

function described(title, curves) {
  const sides = ["left", "right"].filter((side) => curves[side]).map((side) => {
    const values = known(curves[side].mean);
    return `${side} from ${Math.round(Math.min(...values))} to ${Math.round(Math.max(...values))} degrees`;
  });
  return `${title} over the gait cycle: ${sides.join(", ")}`;
}
