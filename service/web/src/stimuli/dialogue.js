// The dialogue in which stimuli for experiments are set up, seen as they will be, and downloaded.

import { motion, ServiceError } from "../api/requests.js";
import { fileName, save } from "../controls/download.js";
import { make } from "../controls/widgets.js";
import { paint } from "./picture.js";
import { PointLights, ringOf } from "./point_lights.js";
import { displayOf, GROUPS, parsed, plain, problem, SETTINGS, setOf, shownIn } from "./settings.js";

const ZIP = "application/zip";
const HINT = "What you see is what the files show. The same settings and seed make the same stimuli again.";
const button = (textContent, properties = {}) => make("button", { type: "button", textContent, ...properties });

/**
 * The dialogue.
 *
 * `walkers` walk in place and `people` are how a request names them; `first` is the one seen at first. `stimulus` are its
 * settings at the start; `changed(stimulus)` tells of others, and of null when it closes. `name` is what files of the
 * walkers are called.
 */
export class StimulusDialogue {
  constructor({ walkers, people, first, stimulus, paused, changed, name }) {
    Object.assign(this, { people, stimulus, paused, changed, name });
    this.rings = walkers.map(ringOf);
    this.edges = walkers[0].parameters.edges;
    this.seen = first;
    this.displays = [];
    this.began = performance.now();
    this.build();
  }

  /** Show it. */
  open() {
    document.body.append(this.dialog);
    this.dialog.showModal();
    this.update();
    this.frame();
  }

  close() {
    this.dialog.close();
  }

  build() {
    this.canvas = make("canvas", {});
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", "The stimulus as it will be");
    this.status = make("p", { className: "status" });
    this.status.setAttribute("role", "status");
    this.why = make("p", { className: "hint bad wrong", id: "wrong-stimulus" });
    const title = make("h2", { id: "stimulus-title", textContent: "Point-light stimuli" });
    const header = make("header", {}, title, make("p", { className: "hint", textContent: HINT }));
    const view = make("div", { className: "naming-view" }, this.canvas, this.playing());
    this.inputs = new Map();
    const groups = Object.entries(GROUPS).map(([name, settings]) =>
      make("fieldset", {}, make("legend", { textContent: name }), ...settings.map((setting) => this.row(setting))),
    );
    const side = make("div", { className: "naming-side settings" }, ...groups);
    side.tabIndex = 0; // it scrolls
    this.dialog = make("dialog", { className: "naming" }, header, view, side, this.footer());
    this.dialog.setAttribute("aria-labelledby", title.id);
    this.dialog.addEventListener("keydown", (event) => event.stopPropagation()); // the page's keys are its own
    this.dialog.addEventListener("close", () => {
      this.dialog.remove();
      this.changed(null);
    });
  }

  playing() {
    this.pausing = button("Pause", { onclick: () => this.pause(!this.paused) });
    const which = this.rings.map((_, i) => make("option", { value: i, textContent: `Walker ${"AB"[i]}`, selected: i === this.seen }));
    const select = make("select", { hidden: this.rings.length < 2 }, ...which);
    select.setAttribute("aria-label", "Walker in the preview");
    select.addEventListener("change", () => {
      this.seen = Number(select.value);
      this.update();
    });
    this.pause(this.paused);
    return make("div", { className: "playing" }, this.pausing, select);
  }

  pause(paused) {
    this.paused = paused;
    this.pausing.textContent = paused ? "Play" : "Pause";
  }

  row(setting) {
    const { name, label, home, min, max, step, unit, choices } = setting;
    let input;
    if (choices) input = make("select", {}, ...Object.entries(choices).map(([value, textContent]) => make("option", { value, textContent })));
    else if (home === false) input = make("input", { type: "checkbox" });
    else input = make("input", { type: "number", min, max, step: "any" });
    input.name = name;
    if (step) input.addEventListener("keydown", (event) => this.nudge(event, input, setting));
    input.addEventListener("change", () => this.set(setting, input.type === "checkbox" ? (input.checked ? "1" : "") : input.value));
    this.inputs.set(name, input);
    const words = make("span", { textContent: label });
    return make("label", { className: "field" }, words, make("span", { className: "with-unit" }, input, unit ? make("small", { textContent: unit }) : ""));
  }

  /** Arrow keys go by the setting's step, as any value is allowed. */
  nudge(event, input, setting) {
    const way = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (!way) return;
    event.preventDefault();
    const next = (input.valueAsNumber || 0) + way * setting.step;
    this.set(setting, String(Math.round(next * 1e6) / 1e6));
  }

  set(setting, text) {
    const value = setting.none && text.trim() === "" ? null : parsed(setting, text);
    this.stimulus = { ...this.stimulus, [setting.name]: value };
    this.last = setting.name;
    this.update();
    const given = Number.parseFloat(text);
    if (setting.step && given !== value && value !== null) this.say(`${setting.label}: ${value} is used; it can be from ${setting.min} to ${setting.max}.`);
    this.changed(this.stimulus);
  }

  footer() {
    this.adding = button("Add to the set", { onclick: () => this.add(), title: "Collect several displays, to download them together" });
    this.clearing = button("Empty the set", { onclick: () => this.empty() });
    const resetting = button("Defaults", { onclick: () => this.reset() });
    this.downloading = button("Download", { className: "strong", onclick: () => this.download() });
    const closing = button("Close", { onclick: () => this.close() });
    const [editing, ending] = [
      [resetting, this.adding, this.clearing],
      [closing, this.downloading],
    ].map((buttons) => make("div", { className: "actions" }, ...buttons));
    return make("footer", {}, this.status, editing, ending);
  }

  reset() {
    this.stimulus = plain();
    this.update();
    this.changed(this.stimulus);
  }

  add() {
    this.displays.push(displayOf(this.stimulus));
    this.update();
  }

  empty() {
    this.displays = [];
    this.update();
  }

  say(text, bad = false) {
    this.status.textContent = text;
    this.status.classList.toggle("bad", bad);
  }

  /** Show the settings as they are now. */
  update() {
    const { stimulus, inputs, canvas, displays } = this;
    for (const { name, home } of SETTINGS) {
      const input = inputs.get(name);
      if (home === false) input.checked = stimulus[name];
      else input.value = stimulus[name] ?? "";
    }
    if (canvas.width !== stimulus.width) canvas.width = stimulus.width;
    if (canvas.height !== stimulus.height) canvas.height = stimulus.height;
    const wrong = problem(stimulus);
    this.lights = wrong ? null : new PointLights(stimulus, this.rings[this.seen]);
    this.painted = null;
    this.adding.disabled = this.downloading.disabled = Boolean(wrong);
    this.clearing.hidden = !displays.length;
    this.mark(wrong);
    this.say(wrong?.words ?? this.summary(), Boolean(wrong));
  }

  /** Mark the settings that can't be as they are, and say why below the one that was changed last. */
  mark(wrong) {
    for (const [name, input] of this.inputs) {
      input.setAttribute("aria-invalid", String(Boolean(wrong?.about.includes(name))));
      input.removeAttribute("aria-describedby");
    }
    this.why.remove();
    if (!wrong) return;
    const input = this.inputs.get(wrong.about.includes(this.last) ? this.last : wrong.about[0]);
    this.why.textContent = wrong.words;
    input.setAttribute("aria-describedby", this.why.id);
    input.closest("label").after(this.why);
  }

  summary() {
    const [people, displays] = [this.people.length, Math.max(1, this.displays.length)];
    const frames = Math.round(this.stimulus.seconds * this.stimulus.fps);
    const set = people * displays === 1 ? "One stimulus" : `${people * displays} stimuli, ${people} × ${displays} of walkers × displays,`;
    return `${set} of ${frames} frames. ${this.displays.length ? "" : "Add other displays to the set, or download this one."}`;
  }

  /** Draw the frame of this moment, if it isn't drawn yet. */
  frame() {
    if (!this.dialog.open) return;
    requestAnimationFrame(() => this.frame());
    if (!this.lights) return;
    const { fps, seconds } = this.stimulus;
    const count = Math.max(1, Math.round(fps * seconds));
    const number = this.paused ? (this.number ?? 0) % count : Math.floor(((performance.now() - this.began) / 1000) * fps) % count;
    if (number === this.painted) return;
    this.painted = this.number = number;
    paint(this.canvas.getContext("2d"), this.stimulus, this.lights.at(number / fps), this.edges);
  }

  async download() {
    const displays = this.displays.length ? this.displays : [displayOf(this.stimulus)];
    this.downloading.disabled = true;
    this.say("Making the stimuli …");
    try {
      const blob = await motion({ path: "/v1/stimuli", body: setOf(this.stimulus, this.people, displays) }, ZIP);
      save(blob, fileName("motionenv", "stimuli", this.name, this.displays.length ? "" : shownIn(this.stimulus), "zip"));
      this.say(`Saved: ${(blob.size / 1000).toFixed(0)} kB. stimuli.json has every setting.`);
    } catch (error) {
      this.say(error instanceof ServiceError ? error.message : `Download failed: ${error.message}`, true);
    }
    this.downloading.disabled = false;
  }
}
