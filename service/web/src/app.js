// What is chosen → walkers → the stage, many times a second.

import { Controls } from "./controls.js";
import { scattered } from "./dots.js";
import { Figure } from "./figure.js";
import { about, parameters } from "./models.js";
import { Plot } from "./plot.js";
import { normals } from "./random.js";
import { Stage } from "./stage.js";
import { fresh, fromLink, LIMIT, link } from "./state.js";
import { Stream } from "./stream.js";
import { averageMarkers, walkerOf } from "./walkers.js";

const $ = (id) => document.getElementById(id);
const PLOT_EVERY = 3; // frames between two marks in the plot
const LINK_AFTER = 300; // [ms] of rest after which the address says what is shown
const SLOW = 700; // [ms] of loading after which something is said
const KEPT = 600; // frames whose times are kept

const pause = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));

/**
 * Everything that is shown, and what changes it.
 *
 * `state` is what a link says; `walkers` do it, or the one `guest` from a capture file does what it was captured doing.
 */
export class App {
  constructor() {
    this.state = fromLink(location.hash);
    this.cycles = [0, 0];
    this.walkers = [];
    this.guest = null;
    this.paused = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.stats = { frames: 0, times: [] };
    this.stage = new Stage($("view"));
    if (this.state.camera) this.stage.look(this.state.camera);
    this.plot = new Plot($("plot"));
    this.showPaused();
  }

  /** The person that the sliders change. */
  get one() {
    return this.state.people[this.state.chosen];
  }

  /** Take on a model: its numbers, its walkers, its sliders. */
  async load(name) {
    this.state.model = name;
    this.mark("models", name);
    this.say("");
    const slow = setTimeout(() => this.say("Loading the model …"), SLOW);
    try {
      const found = await this.patiently(name);
      if (this.state.model !== name) return;
      this.say("");
      this.parameters = found;
      if (found.kind === "tree") this.state.people.length = 1;
      this.controls = new Controls(this, found);
      this.guest = null;
      this.people();
    } catch (error) {
      if (this.state.model === name) this.say(error.message);
    } finally {
      clearTimeout(slow);
    }
  }

  /** A model's parameters; while the service is busy with it, ask again. */
  async patiently(name) {
    for (;;) {
      try {
        return await parameters(name);
      } catch (error) {
        if (!error.again || this.state.model !== name) throw error;
        this.say("The service is still making this model ready. It goes on by itself …");
        await pause(error.again);
      }
    }
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

  /** Show a captured walker, until somebody asks for a model again; null does that. */
  invite(guest) {
    this.guest = guest;
    this.cycles = [0, 0];
    if (!guest) {
      this.people();
      return;
    }
    this.stream?.close();
    this.stream = null;
    this.walkers = [guest];
    this.stage.show([new Figure(guest, false)]);
    this.refresh();
  }

  /** Hear the motion that a tree grows. */
  listen() {
    const { state, one, paused } = this;
    const settings = { model: state.model, seed: one.seed, temperature: state.temperature, paused };
    if (one.speed !== null) settings.speed = one.speed;
    const [walker] = this.walkers;
    this.stream = new Stream(settings, { pose: (pose) => walker.arrived(pose), say: (words) => this.say(words) });
  }

  /** Change the chosen person by a function of it, and show that in the next frame. */
  change(by) {
    by(this.one);
    if (this.guest) {
      this.invite(null);
      return;
    }
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

  /** Choose how walkers look, or which of them is changed. */
  look(name, value) {
    this.state[name] = value;
    this.refresh();
  }

  /** Show everywhere what the state says. */
  refresh() {
    const { state, stage, walkers, guest } = this;
    const shown = walkers[guest ? 0 : state.chosen];
    if (!shown) return;
    if (!guest) this.controls.show(this.one, shown, state.temperature);
    stage.aim(Math.max(...walkers.map((walker) => walker.body.height)));
    stage.figures.forEach((figure) => figure.look(state, this.moves(figure.walker)));
    this.plot.show(walkers);
    if ($("stage").dataset.figure !== state.figure) {
      $("stage").dataset.figure = state.figure;
      $("dots").hidden = state.figure !== "points";
      stage.resize(); // other things cover its edges now
    }
    for (const id of ["lines", "inverted", "scattered"]) $(id).checked = state[id];
    this.mark("figure", state.figure);
    this.mark("models", state.model);
    this.mark("chosen", String(state.chosen));
    const two = walkers.length > 1;
    $("chosen").hidden = $("names").hidden = !two;
    $("compare").setAttribute("aria-pressed", String(two));
    $("compare").disabled = this.parameters.kind === "tree";
    $("scrub").disabled = !shown.scrubbed;
    $("seed").value = this.one.seed;
    $("facts").textContent = shown.facts();
    $("about").textContent = guest ? "This is your capture. Move a slider or choose a model to go on." : about(this.parameters.kind);
    for (const button of $("downloads").children) button.disabled = guest !== null;
    stage.changed = true;
    this.write();
  }

  /** Check the radio button of a fieldset that has a value. */
  mark(id, value) {
    for (const input of $(id).querySelectorAll("input")) input.checked = input.value === value;
  }

  /** By how much a walker's dots are moved, where they are scattered. */
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
    if (this.stream) this.people();
    else this.change(() => {});
  }

  /** The average walker at its own pace. */
  reset() {
    const [average] = fresh().people;
    this.change((one) => Object.assign(one, average));
    if (this.stream) this.people();
  }

  /** Two walkers side by side, or one again. */
  compare() {
    const { people } = this.state;
    if (this.parameters.kind === "tree") return;
    this.guest = null;
    if (people.length > 1) people.length = 1;
    else people.push({ ...people[0], deviations: [...people[0].deviations] });
    this.state.chosen = people.length - 1;
    this.cycles[1] = this.cycles[0];
    this.people();
  }

  /** Stand still, or walk on. */
  pause(paused = !this.paused) {
    this.paused = paused;
    this.stream?.change({ paused });
    this.showPaused();
  }

  showPaused() {
    $("pause").setAttribute("aria-pressed", String(this.paused));
    $("pause").setAttribute("aria-label", this.paused ? "Walk" : "Pause");
  }

  /** Stand still at a moment of the cycle. */
  scrub(phase) {
    this.pause(true);
    this.cycles = [phase, phase];
    this.stage.changed = true;
  }

  /** Look from somewhere else. */
  view(from) {
    this.stage.move(from);
    this.state.camera = this.stage.view;
    this.write();
  }

  /** Words over the stage; none hides them. */
  say(words) {
    $("note").textContent = words;
    $("note").hidden = !words;
  }

  /** Put a link to what is shown where it can be pasted from; whether that worked. */
  async copyLink() {
    history.replaceState(null, "", `#${link(this.state)}`);
    try {
      await navigator.clipboard.writeText(location.href);
      return true;
    } catch {
      return false;
    }
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
    requestAnimationFrame((time) => this.frame(time));
    const begun = performance.now();
    const passed = Math.min(0.1, (now - (this.before ?? now)) / 1000);
    this.before = now;
    this.stage.controls.update();
    if (!this.walkers.length || (this.paused && !this.stage.changed)) return;
    this.walkers.forEach((walker, i) => {
      if (!this.paused) this.cycles[i] += passed / walker.seconds;
      walker.show(this.cycles[i]);
    });
    for (const figure of this.stage.figures) figure.update();
    if (this.stats.frames % PLOT_EVERY === 0) this.follows();
    const ready = performance.now();
    this.stage.draw(this.state.figure === "points");
    this.count(begun, ready);
  }

  /** Let plot and scrubber follow the walker. */
  follows() {
    const phase = this.cycles[this.guest ? 0 : this.state.chosen];
    this.plot.mark(phase, this.walkers[0]);
    if (!this.paused) $("scrub").value = phase - Math.floor(phase);
  }

  /** Keep the times of the last frames [ms]: at the start, with everything moved, and drawn. */
  count(begun, moved) {
    const { times } = this.stats;
    if (this.stats.frames++ === 0) performance.mark("walking");
    times.push([begun, moved, performance.now()]);
    if (times.length > KEPT) times.shift();
  }
}
