// Charts of joint angles over the gait cycle, from initial contact to the next one, as gait laboratories draw them.

import { make } from "../controls/widgets.js";
import { pathOf, svg } from "../stage/plot.js";

const [WIDE, HIGH] = [220, 130]; // of the plot itself
const [LEFT, BOTTOM] = [30, 18]; // room for the axes' numbers
const STEPS = [5, 10, 20]; // [degrees] between ticks
const MOST_TICKS = 7;
const PERCENTS = [0, 20, 40, 60, 80, 100];

const known = (values) => values.filter((value) => value !== null);

/** Mean ± standard deviation as two lists; null where either is unknown. */
function edges({ mean, sd }) {
  const shifted = (sign) => mean.map((value, i) => (value === null || sd[i] === null ? null : value + sign * sd[i]));
  return [shifted(-1), shifted(1)];
}

/** Ticks [degrees] of an axis. */
function ticksOf([low, high]) {
  const step = STEPS.find((size) => (high - low) / size <= MOST_TICKS);
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, i) => (first + i) * step);
}

/**
 * One angle on the axis `range` [degrees]: `curves` are {left, right, band}, each {mean, sd, n} or undefined, and `off`
 * the toe-offs [%] of both sides.
 *
 * `walks` are the means {name, left, right, sides} of single walks, drawn thin, and boldly if they are `chosen`.
 */
export function chart(title, range, curves, off, walks = [], chosen = null) {
  const up = (value) => (HIGH * (range[1] - value)) / (range[1] - range[0]);
  const picture = svg("svg", { viewBox: `${-LEFT} -6 ${WIDE + LEFT + 8} ${HIGH + BOTTOM + 6}`, role: "img" });
  picture.setAttribute("aria-label", described(title, curves));
  for (const tick of ticksOf(range)) {
    picture.append(svg("line", { class: tick ? "grid" : "zero", x1: 0, x2: WIDE, y1: up(tick), y2: up(tick) }));
    picture.append(text(`${tick}°`.replace("-", "−"), -4, up(tick) + 3.5, "end"));
  }
  for (const percent of PERCENTS) picture.append(text(percent === 100 ? "100 %" : String(percent), (WIDE * percent) / 100, HIGH + 14, percent === 100 ? "end" : "middle"));
  const inside = svg("svg", { width: WIDE, height: HIGH, viewBox: `0 0 ${WIDE} ${HIGH}` }); // cuts off what leaves the axis
  if (curves.band) inside.append(area(curves.band, range, "band"));
  for (const side of ["left", "right"]) {
    const curve = curves[side];
    if (!curve) continue;
    if (curve.n > 1) inside.append(area(curve, range, `${side} spread`));
    for (const walk of walks) if (walk[side]) inside.append(named(svg("path", { class: `${side} walk`, d: line(walk[side], range) }), walk.name));
    const bold = chosen && walks.find(({ name }) => name === chosen);
    const mean = bold ? bold[side] : curve.n > 1 ? curve.mean.map((value, i) => (curve.sd[i] === null ? null : value)) : curve.mean;
    const one = (bold ? bold.sides[side] : curve.n) === 1 ? " single" : "";
    if (mean) inside.append(svg("path", { class: `${side}${one}`, d: line(mean, range) }));
    if (off[side]) inside.append(svg("line", { class: `${side} off`, x1: (WIDE * off[side]) / 100, x2: (WIDE * off[side]) / 100, y1: 0, y2: HIGH }));
  }
  picture.append(inside, ...beyond(range, curves, walks));
  return make("figure", {}, make("figcaption", { textContent: title }), picture);
}

/** Arrows with the values that are furthest beyond the axis, at its ends. */
function beyond([low, high], curves, walks) {
  const rows = { "▲": 0, "▼": 0 };
  const mark = (arrow, value, side) => {
    const row = 12 * rows[arrow]++;
    const element = text(`${arrow} ${Math.round(value)}°`.replace("-", "−"), WIDE - 2, arrow === "▲" ? 10 + row : HIGH - 3 - row, "end");
    element.setAttribute("class", side);
    return element;
  };
  return ["left", "right", "band"].filter((side) => curves[side]).flatMap((side) => {
    const all = known([...curves[side].mean, ...edges(curves[side]).flat(), ...walks.flatMap((walk) => walk[side] ?? [])]);
    const [least, most] = [Math.min(...all), Math.max(...all)];
    return [...(most > high ? [mark("▲", most, side)] : []), ...(least < low ? [mark("▼", least, side)] : [])];
  });
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
