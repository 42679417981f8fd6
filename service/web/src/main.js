// The page: what is chosen → walkers → the stage, many times a second.

import { Controls } from "./controls.js";
import { asked, downloads } from "./download.js";
import { Figure } from "./figure.js";
import { keys } from "./keys.js";
import { about, listModels, parameters } from "./models.js";
import { Plot } from "./plot.js";
import { normals } from "./random.js";
import { scattered } from "./dots.js";
import { Stage } from "./stage.js";
import { fresh, fromLink, LIMIT, link } from "./state.js";
import { Stream } from "./stream.js";
import { averageMarkers, walkerOf } from "./walkers.js";

const $ = (id) => document.getElementById(id);
const PLOT_EVERY = 3; // frames between two marks in the plot
const LINK_AFTER = 300; // [ms] of rest after which the address says what is shown

/** Everything that is shown, and what changes it. */
class App {
  constructor() {
    this.state = fromLink(location.hash);
    this.cycles = [0, 0];
    this.walkers = [];
    this.paused = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.stats = { frames: 0, script: [] };
    this.stage = new Stage($("view"));
    if (this.state.camera) this.stage.look(this.state.camera);
    this.plot = new Plot($("plot"));
    this.bind();
    this.showPaused();
  }

  get one() {
    return this.state.people[this.state.chosen];
  }

  /** Take on a model: its numbers, its walkers, its sliders. */
  async load(name) {
    this.state.model = name;
    this.say("");
    let found;
    try {
      found = await parameters(name);
    } catch (error) {
      this.say(error.message);
      return;
    }
    if (this.state.model !== name) return;
    this.parameters = found;
    if (found.kind === "tree") this.state.people.length = 1;
    $("about").textContent = about(found.kind);
    this.controls = new Controls(this, found);
    this.people();
  }

  /** Make the walkers anew: another model, or one more or less. */
  people() {
    const { parameters: model, state } = this;
    state.chosen = Math.min(state.chosen, state.people.length - 1);
    this.stream?.close();
    this.stream = null;
    this.walkers = state.people.map(() => walkerOf(model));
    this.walkers.forEach((walker, i) => walker.set(state.people[i]));
    this.stage.show(this.walkers.map((walker, i) => new Figure(walker, i === 1)));
    if (model.kind === "tree") this.listen();
    this.refresh();
  }

  listen() {
    const settings = { model: this.state.model, seed: this.one.seed, temperature: this.state.temperature, paused: this.paused };
    if (this.one.speed !== null) settings.speed = this.one.speed;
    this.stream = new Stream(settings, {
      pose: (pose) => this.walkers[0].arrived?.(pose),
      trouble: (words) => this.say(words),
    });
  }

  /** Change the chosen person by a function of it, and show that in the next frame. */
  change(by) {
    by(this.one);
    this.walkers[this.state.chosen].set(this.one);
    this.stream?.change({ speed: this.one.speed });
    this.refresh();
  }

  /** Let the tree be as warm as this. */
  warm(temperature) {
    this.state.temperature = temperature;
    this.stream?.change({ temperature });
    this.refresh();
  }

  /** Show everywhere what the state says. */
  refresh() {
    const { state, stage, walkers } = this;
    const tree = this.parameters.kind === "tree";
    this.controls.show(this.one, walkers[state.chosen], state.temperature);
    stage.aim(Math.max(...walkers.map((walker) => walker.body.height)));
    stage.figures.forEach((figure) => figure.look(state, this.moves(figure.walker)));
    this.plot.show(walkers);
    $("stage").dataset.figure = state.figure;
    $("dots").hidden = state.figure !== "points";
    for (const id of ["lines", "inverted", "scattered"]) $(id).checked = state[id];
    for (const input of $("figure").querySelectorAll("input")) input.checked = input.value === state.figure;
    for (const input of $("models").querySelectorAll("input")) input.checked = input.value === state.model;
    for (const input of $("chosen").querySelectorAll("input")) input.checked = Number(input.value) === state.chosen;
    $("chosen").hidden = $("names").hidden = state.people.length < 2;
    $("compare").setAttribute("aria-pressed", String(state.people.length > 1));
    $("compare").disabled = $("scrub").disabled = tree;
    $("seed").value = this.one.seed;
    $("facts").textContent = tree ? "" : facts(walkers[state.chosen]);
    this.write();
  }

  moves(walker) {
    if (!this.state.scattered) return null;
    return scattered(averageMarkers(walker), walker.body.height, this.one.seed);
  }

  /** Say the state in the address, once it rests. */
  write() {
    clearTimeout(this.writing);
    this.writing = setTimeout(() => history.replaceState(null, "", `#${link(this.state)}`), LINK_AFTER);
  }

  /** Somebody else: drawn with a seed. */
  draw(seed) {
    const within = (d) => Math.round(100 * Math.min(LIMIT, Math.max(-LIMIT, d))) / 100;
    this.one.seed = seed;
    this.one.deviations = normals(seed, this.parameters.components).map(within);
    if (this.parameters.kind === "tree") this.people();
    else this.change(() => {});
  }

  reset() {
    const [average] = fresh().people;
    this.change((one) => Object.assign(one, average));
    if (this.stream) this.people();
  }

  compare() {
    const { people } = this.state;
    if (this.parameters.kind === "tree") return;
    if (people.length > 1) people.length = 1;
    else people.push({ ...people[0], deviations: [...people[0].deviations] });
    this.state.chosen = people.length - 1;
    this.cycles[1] = this.cycles[0];
    this.people();
  }

  pause(paused = !this.paused) {
    this.paused = paused;
    this.stream?.change({ paused });
    this.showPaused();
  }

  showPaused() {
    $("pause").setAttribute("aria-pressed", String(this.paused));
    $("pause").setAttribute("aria-label", this.paused ? "Walk" : "Pause");
  }

  /** Words over the stage; none hides them. */
  say(words) {
    $("note").textContent = words;
    $("note").hidden = !words;
  }

  bind() {
    keys(this);
    const on = (id, event, then) => $(id).addEventListener(event, then);
    on("figure", "change", ({ target }) => this.look("figure", target.value));
    for (const id of ["lines", "inverted", "scattered"]) on(id, "change", ({ target }) => this.look(id, target.checked));
    on("chosen", "change", ({ target }) => this.look("chosen", Number(target.value)));
    on("randomise", "click", () => this.draw(Math.floor(Math.random() * 1e6)));
    on("seed", "change", ({ target }) => this.draw(Math.max(0, Math.round(target.valueAsNumber || 0))));
    on("reset", "click", () => this.reset());
    on("compare", "click", () => this.compare());
    on("pause", "click", () => this.pause());
    on("scrub", "input", ({ target }) => this.scrub(target.valueAsNumber));
    on("link", "click", () => this.copy());
    for (const button of document.querySelectorAll("[data-view]")) {
      button.addEventListener("click", () => this.view({ around: Number(button.dataset.view), up: 8 }));
    }
    this.stage.controls.addEventListener("end", () => this.view({}));
    const dark = matchMedia("(prefers-color-scheme: dark)");
    dark.addEventListener("change", () => this.stage.theme(dark.matches));
    this.stage.theme(dark.matches);
    const request = () => asked(this.state, this.one, this.parameters, { seconds: $("seconds").valueAsNumber || 4, view: this.stage.view[0] });
    downloads($("downloads").children, request, (words, bad) => {
      $("download-note").textContent = words;
      $("download-note").classList.toggle("bad", bad);
    });
    addEventListener("hashchange", () => this.follow());
  }

  look(name, value) {
    this.state[name] = value;
    this.refresh();
  }

  view(from) {
    this.stage.move(from);
    this.state.camera = this.stage.view;
    this.write();
  }

  scrub(phase) {
    this.pause(true);
    this.cycles = [phase, phase];
  }

  async copy() {
    const address = `${location.href.split("#")[0]}#${link(this.state)}`;
    history.replaceState(null, "", address);
    try {
      await navigator.clipboard.writeText(address);
      $("link").textContent = "Copied";
    } catch {
      $("link").textContent = "It is in the address bar";
    }
    setTimeout(() => ($("link").textContent = "Copy link"), 2000);
  }

  /** Somebody followed a link to another state. */
  follow() {
    if (location.hash === `#${link(this.state)}`) return;
    this.state = fromLink(location.hash);
    if (this.state.camera) this.stage.look(this.state.camera);
    this.load(this.state.model);
  }

  /** One frame, `now` [ms]. */
  frame(now) {
    const begun = performance.now();
    const passed = Math.min(0.1, (now - (this.before ?? now)) / 1000);
    this.before = now;
    this.walkers.forEach((walker, i) => {
      if (!this.paused) this.cycles[i] += passed / walker.seconds;
      walker.show(this.cycles[i]);
    });
    for (const figure of this.stage.figures) figure.update();
    if (this.walkers.length) this.mark();
    const ready = performance.now();
    if (this.walkers.length) this.stage.draw(this.state.figure === "points");
    this.count(begun, ready);
    requestAnimationFrame((time) => this.frame(time));
  }

  mark() {
    if (this.stats.frames % PLOT_EVERY) return;
    const phase = this.cycles[this.state.chosen];
    this.plot.mark(phase, this.walkers[0]);
    if (!this.paused) $("scrub").value = phase - Math.floor(phase);
  }

  /** Times of the last frames, for whoever measures. */
  count(begun, ready) {
    const { script } = this.stats;
    if (this.walkers.length && this.stats.frames++ === 0) performance.mark("walking");
    script.push([ready - begun, performance.now() - begun]);
    if (script.length > 600) script.shift();
  }
}

const facts = ({ speed, seconds, body }) =>
  `${speed.toFixed(2)} m/s · ${(120 / seconds).toFixed(0)} steps/min · ${body.height.toFixed(2)} m`;

function begin() {
  let app;
  try {
    app = new App();
  } catch (error) {
    $("note").hidden = false;
    $("note").textContent = `This browser can't draw in 3D (WebGL), which this page needs: try another, or switch on its graphics acceleration. (${error.message})`;
    return;
  }
  globalThis.motionenv = app;
  app.load(app.state.model).then(() => listModels($("models"), () => app.state.model, (name) => app.load(name)));
  requestAnimationFrame((time) => app.frame(time));
}

begin();
