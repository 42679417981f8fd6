// The gait of a walk: joint angles over the gait cycle beside people's, step parameters, and both as CSV.

import { fileName, save } from "../controls/download.js";
import { make } from "../controls/widgets.js";
import { chart } from "./charts.js";

const ORDER = ["pelvis", "hip", "knee", "ankle", "foot"];
const MAIN = ["speed", "cadence", "stride_length", "step_length", "step_width", "stride_time", "stance", "double_support", "step_length_symmetry", "step_time_symmetry"];
const words = (name) => `${name[0].toUpperCase()}${name.slice(1).replaceAll("_", " ")}`;
const counted = (n, one) => (n === 1 ? `one ${one}` : `${n} ${one}s`);
/** Strides of both sides in words, as a report has them. */
export const sided = ({ left, right }) => `${counted(left, "left stride")} and ${counted(right, "right stride")}`;
const rounded = (value, unit) => (value === null ? "" : value.toFixed(unit === "m" || unit === "m/s" || unit === "s" ? 2 : 1).replace("-", "−"));

/** The dialogue of a `GaitReport`; `title` says whose gait it is, and `name` what its files are called. */
export class GaitDialogue {
  constructor(report, title, name = title) {
    this.report = report;
    const heading = make("h2", { id: "gait-title", textContent: `Gait: ${title}` });
    this.walks = report.captures.filter(({ strides }) => strides);
    this.sides = Object.fromEntries(["left", "right"].map((side) => [side, this.most(side)]));
    const files = report.captures.length > 1 ? ` of ${report.captures.length} files` : "";
    this.drawn = make("div", { className: "charts" }, ...this.charts(null));
    const hint = make("p", { className: "hint", textContent: `${sided(this.sides)}${files}, in percent of the gait cycle from initial contact. Dashed: toe-off. An arrow tells how far a curve leaves the axis.` });
    const body = make("div", { className: "gait", tabIndex: 0 }, ...this.doubts(), this.legend(), ...this.choice(), this.drawn, this.table(), ...this.profile(), this.notes());
    body.setAttribute("role", "region");
    body.setAttribute("aria-label", "Joint angles and step parameters");
    const csv = make("button", { type: "button", textContent: "Save as CSV", onclick: () => this.save(name) });
    const closing = make("button", { type: "button", className: "strong", textContent: "Close", onclick: () => this.dialog.close() });
    const footer = make("footer", {}, make("div", { className: "actions" }, csv, closing));
    this.dialog = make("dialog", { className: "naming gait-dialogue" }, make("header", {}, heading, hint), body, footer);
    this.dialog.setAttribute("aria-labelledby", heading.id);
    this.dialog.addEventListener("keydown", (event) => event.stopPropagation()); // the page's keys are its own
    this.dialog.addEventListener("close", () => this.dialog.remove());
  }

  /** Show it. */
  open() {
    document.body.append(this.dialog);
    this.dialog.showModal();
  }

  /** What isn't plausible, before everything else. */
  doubts() {
    const told = this.report.captures.flatMap(({ name, doubts }) => doubts.map((doubt) => `${name} is not plausible: ${doubt}.`));
    const lines = told.map((textContent) => make("p", { className: "hint bad", textContent }));
    for (const one of lines) one.setAttribute("role", "alert");
    return lines;
  }

  /** How many strides of a side the angles are of. */
  most(side) {
    const { angles } = this.report;
    return Math.max(0, ...Object.keys(angles).filter((name) => name.startsWith(side)).map((name) => angles[name].n));
  }

  legend() {
    const { band } = this.report;
    const sides = Object.entries(this.sides).map(([side, n]) => [side, `${side}: ${n > 1 ? "mean ± SD of " : ""}${counted(n, "stride")}`]);
    const kinds = [...sides, ...(band ? [["band", `${band.people} people, mean ± SD`]] : [])];
    return make("p", { className: "legend" }, ...kinds.map(([className, textContent]) => make("span", { className, textContent })));
  }

  /** The choice of one walk among several, whose angles are then drawn instead of all walks' means. */
  choice() {
    if (this.walks.length < 2) return [];
    const names = this.walks.map(({ name, sides }) => make("option", { value: name, textContent: `${name} (${sided(sides)})` }));
    const select = make("select", {}, make("option", { value: "", textContent: "the mean of all files" }), ...names);
    select.addEventListener("change", () => this.drawn.replaceChildren(...this.charts(select.value || null)));
    return [make("label", { className: "field", textContent: "Bold: " }, select)];
  }

  /** The charts, with the walk of a name drawn boldly, or the mean of all. */
  charts(chosen) {
    const { angles, band, axes } = this.report;
    const names = [...new Set(Object.keys(angles).map((name) => name.replace(/^(left|right)_/, "")))];
    const place = (name) => ORDER.findIndex((part) => name.startsWith(part));
    names.sort((a, b) => place(a) - place(b));
    const off = Object.fromEntries(["left", "right"].map((side) => [side, this.parameter("stance", side)?.mean]));
    const of = (all, name) => ({ left: all[`left_${name}`], right: all[`right_${name}`] });
    const walks = this.walks.length > 1 ? this.walks : [];
    return names.map((name) => {
      const single = walks.map((walk) => ({ name: walk.name, sides: walk.sides, ...of(walk.angles, name) }));
      return chart(words(name), axes[name], { ...of(angles, name), band: band?.angles[name] }, off, single, chosen);
    });
  }

  parameter(name, side) {
    return this.report.parameters.find((one) => one.name === name && one.side === side);
  }

  table() {
    const spread = (one) => (one.n === 1 ? " (one stride)" : one.sd === null ? "" : ` ± ${rounded(one.sd, one.unit)}`);
    const cell = (one) => (one ? `${rounded(one.mean, one.unit)}${spread(one)}` : "");
    const rows = MAIN.filter((name) => this.parameter(name, "")).map((name) => {
      const [both, left, right] = ["", "left", "right"].map((side) => this.parameter(name, side));
      return make("tr", {}, make("th", { scope: "row", textContent: `${words(name)} [${both.unit}]` }), ...[left, right, both].map((one) => make("td", { textContent: cell(one) })));
    });
    return this.framed("Mean ± standard deviation over strides", rows);
  }

  framed(caption, rows) {
    const heads = ["", "Left", "Right", "Both"].map((textContent) => make(textContent ? "th" : "td", { textContent, ...(textContent && { scope: "col" }) }));
    return make("table", {}, make("caption", { textContent: caption }), make("thead", {}, make("tr", {}, ...heads)), make("tbody", {}, ...rows));
  }

  /** The movement analysis profile, if there is a band. */
  profile() {
    const { profile, band } = this.report;
    if (!profile.length) return [];
    const totals = { gait_profile_score: "Gait Profile Score", deviation: "These angles together, no Gait Profile Score" };
    const range = (one) => (one.median === null ? "" : ` (${one.median.toFixed(1)}; ${one.low.toFixed(1)} to ${one.high.toFixed(1)})`);
    const rows = [...new Set(profile.map(({ name }) => name))].map((name) => {
      const cells = ["left", "right", ""].map((side) => profile.find((one) => one.name === name && one.side === side));
      const texts = cells.map((one) => (one ? `${one.value.toFixed(1)}${range(one)}${one.n === 1 ? ", one stride" : ""}` : ""));
      return make("tr", {}, make("th", { scope: "row", textContent: totals[name] ?? words(name) }), ...texts.map((textContent) => make("td", { textContent })));
    });
    const caption = `Root mean square difference from the mean of ${band.people} people [°] (their own median; range)`;
    return [this.framed(caption, rows)];
  }

  notes() {
    const { captures, left_out: left, band } = this.report;
    const told = [...this.report.notes, ...new Set(captures.flatMap(({ notes }) => notes))];
    told.push(...Object.entries(left).map(([name, why]) => `${name} was left out: ${why}.`));
    if (band) told.push(`Grey: ${band.who}`);
    return make("ul", { className: "found" }, ...told.map((textContent) => make("li", { textContent })));
  }

  save(name) {
    const rows = [["kind", "name", "side", "percent", "unit", "mean", "sd", "n"]];
    for (const { name, side, unit, mean, sd, n } of this.report.parameters) rows.push(["parameter", name, side, "", unit, mean, sd, n]);
    for (const { name, side, value, n } of this.report.profile) rows.push(["profile", name, side, "", "degrees", value, "", n]);
    for (const [whole, { mean, sd, n }] of Object.entries(this.report.angles)) {
      const [, side, name] = whole.match(/^(left|right)_(.*)$/);
      mean.forEach((value, percent) => rows.push(["angle", name, side, percent, "degrees", value, sd[percent], n]));
    }
    const text = rows.map((row) => row.map((value) => value ?? "").join(",")).join("\n");
    save(new Blob([`${text}\n`], { type: "text/csv" }), fileName(name, "gait", "csv"));
  }
}
