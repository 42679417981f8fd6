// What is chosen → walkers → the stage, many times a second.

import { Controls } from "./controls.js";
import { scattered } from "./dots.js";
import { Figure } from "./figure.js";
import { about, parameters } from "./models.js";
import { Plot } from "./plot.js";
import { normals } from "./random.js";
import { Stage } from "./stage.js";
import { fresh, fromLink, LIMIT, link } from "./state.js";
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

  /** The walker that plot and scrubber follow. */
  get shown() {
    return this.walkers[this.guest ? 0 : this.state.chosen];
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
      for (const one of this.state.people) if (!found.activities?.includes(one.activity)) one.activity = null;
      this.loaded = name;
      this.controls = new Controls(this, found);
      this.people();
    } catch (error) {
      if (this.state.model === name) this.failed(error);
    } finally {
      clearTimeout(slow);
    }
  }

  /** Say why a model can't be shown; the one that is goes on, and the other can be chosen again. */
  failed(error) {
    this.say(error.message);
    if (!this.parameters) return;
    this.state.model = this.loaded;
    this.mark("models", this.loaded);
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
    this.guest = null;
    this.dismiss();
    this.walkers = state.people.map(() => walkerOf(model));
    this.walkers.forEach((walker, i) => walker.set(state.people[i]));
    this.stage.show(this.walkers.map((walker, i) => new Figure(walker, i === 1)));
    if (model.kind === "tree") this.grow();
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
    this.dismiss();
    this.walkers = [guest];
    this.stage.show([new Figure(guest, false)]);
    this.refresh();
  }

  /** Let all walkers go. */
  dismiss() {
    for (const walker of this.walkers) walker.close();
  }

  /** Let the motions of a tree begin. */
  grow() {
    const said = [];
    this.say("");
    this.cycles = [0, 0];
    this.walkers.forEach((walker, i) => {
      const say = (words) => {
        said[i] = words;
        this.say(said.find(Boolean) ?? "");
      };
      walker.rest(this.paused, 0);
      walker.grow(this.state.model, this.state.people[i], { told: () => (this.stage.changed = true), say });
    });
  }

  /** Change the chosen person by a function of it, and show that in the next frame. */
  change(by) {
    by(this.one);
    if (this.guest) {
      this.invite(null);
      return;
    }
    this.walkers[this.state.chosen].set(this.one);
    this.cycles = this.cycles.map((moment) => this.walkers[0].changed(moment));
    this.refresh();
  }

  /** Choose how walkers look, or which of them is changed. */
  look(name, value) {
    this.state[name] = value;
    this.refresh();
  }

  /** Lay out what goes with the figure and with one walker or two; not anew for each slider, as it takes a while. */
  arrange() {
    const [figure, two] = [this.state.figure, this.walkers.length > 1];
    if (this.arranged === `${figure} ${two}`) return;
    this.arranged = `${figure} ${two}`;
    $("chosen").hidden = $("names").hidden = !two;
    $("facts").hidden = two;
    $("stage").dataset.figure = figure;
    $("dots").hidden = figure !== "points";
    this.stage.resize(); // other things cover its edges now
  }

  /** Show everywhere what the state says. */
  refresh() {
    const { state, stage, walkers, guest, shown } = this;
    if (!shown) return;
    if (!guest) this.controls.show(this.one, shown);
    stage.aim(Math.max(...walkers.map((walker) => walker.body.height)));
    stage.figures.forEach((figure) => figure.look(state, this.moves(figure.walker)));
    this.plot.show(walkers);
    for (const id of ["lines", "inverted", "scattered"]) $(id).checked = state[id];
    this.mark("figure", state.figure);
    this.mark("models", state.model);
    this.mark("chosen", String(state.chosen));
    $("compare").setAttribute("aria-pressed", String(walkers.length > 1));
    $("seed").value = this.one.seed;
    this.arrange();
    this.tell();
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
    this.anew();
  }

  /** The average walker at its own pace. */
  reset() {
    Object.assign(this.one, fresh().people[0]);
    this.anew();
  }

  /** Let the chosen person begin anew; what grows, grows from its seed. */
  anew() {
    if (this.parameters.kind === "tree") this.people();
    else this.change(() => {});
  }

  /** Two walkers side by side, or one again. */
  compare() {
    const { people } = this.state;
    if (people.length > 1) people.length = 1;
    else people.push({ ...people[0], deviations: [...people[0].deviations] });
    this.state.chosen = people.length - 1;
    this.cycles[1] = this.cycles[0];
    this.people();
  }

  /** Stand still, or walk on. */
  pause(paused = !this.paused) {
    this.paused = paused;
    this.walkers.forEach((walker, i) => walker.rest(paused, this.cycles[i]));
    this.showPaused();
  }

  showPaused() {
    $("pause").setAttribute("aria-pressed", String(this.paused));
    $("pause").setAttribute("aria-label", this.paused ? "Walk" : "Pause");
  }

  /** Stand still at a moment: a share of the cycle, or of what there is of a motion. */
  scrub(share) {
    this.cycles = this.cycles.fill(this.shown.moment(share));
    this.pause(true);
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
    if (!this.paused) this.pass(passed);
    this.walkers.forEach((walker, i) => walker.show(this.cycles[i]));
    for (const figure of this.stage.figures) figure.update();
    if (this.paused || this.stats.frames % PLOT_EVERY === 0) this.follows();
    const ready = performance.now();
    this.stage.draw(this.state.figure === "points");
    this.count(begun, ready);
  }

  /** Let time go on by some seconds; motions that grow side by side are shown at one moment. */
  pass(seconds) {
    this.walkers.forEach((walker, i) => (this.cycles[i] = walker.after(this.cycles[i], seconds)));
    const grown = this.parameters.kind === "tree" && !this.guest;
    if (grown) this.cycles.fill(Math.min(...this.cycles.slice(0, this.walkers.length)));
  }

  /** Let plot, scrubber and words follow the walkers. */
  follows() {
    const { walkers, cycles, shown, paused } = this;
    const moment = cycles[walkers.indexOf(shown)];
    this.plot.mark(walkers, cycles, walkers.indexOf(shown));
    if (paused) $("scrub").setAttribute("aria-valuetext", shown.when(moment));
    else $("scrub").value = shown.share(moment);
    if (!shown.cyclic) this.tell();
  }

  /** Say of each walker what is to be known. */
  tell() {
    const { walkers, cycles } = this;
    const facts = walkers.map((walker, i) => walker.facts(cycles[i]));
    const places = walkers.length > 1 ? $("names").querySelectorAll("span") : [$("facts")];
    places.forEach((place, i) => (place.textContent = facts[i]));
  }

  /** Keep the times of the last frames [ms]: at the start, with everything moved, and drawn. */
  count(begun, moved) {
    const { times } = this.stats;
    if (this.stats.frames++ === 0) performance.mark("walking");
    times.push([begun, moved, performance.now()]);
    if (times.length > KEPT) times.shift();
  }
}
