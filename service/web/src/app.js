// Application state, and the frame loop.

import { Controls } from "./controls/controls.js";
import { StimulusDialogue } from "./stimuli/dialogue.js";
import { plain } from "./stimuli/settings.js";
import { scattered } from "./stage/point_lights.js";
import { Figure } from "./stage/figure.js";
import { numberOf } from "./controls/widgets.js";
import { parameters, titleOf } from "./controls/model_list.js";
import { Plot } from "./stage/plot.js";
import { Stage } from "./stage/stage.js";
import { wordsOf } from "./controls/download.js";
import { GaitDialogue } from "./gait/dialogue.js";
import { gaitOf } from "./api/requests.js";
import { History } from "./controls/history.js";
import { drawn, enter, FLAGS, fresh, fromLink, level, link, settled } from "./state.js";
import { captureOf } from "./capture/recall.js";
import { strideOf } from "./api/strides.js";
import { settingsOf } from "./walkers/in_place.js";
import { averageMarkers, streamed, walkerOf } from "./walkers/index.js";

const $ = (id) => document.getElementById(id);
const PLOT_EVERY = 3; // frames between updates of the plot
const LINK_AFTER = 300; // [ms] without changes after which the address is updated
const SLOW = 700; // [ms] of loading after which a message is shown
const KEPT = 600; // frame times that are kept
export const UP = 8; // [degrees] that the named views look down
const NEAR = 1; // [degrees] from a named view within which it is that view

const pause = (seconds) => new Promise((done) => setTimeout(done, 1000 * seconds));

/**
 * The application.
 *
 * `state` is what a link contains; `walkers` show it, unless there is a `guest`, a captured walker.
 */
export class App {
  constructor() {
    this.state = fromLink(location.hash);
    this.cycles = [0, 0];
    this.walkers = [];
    this.guest = null;
    this.history = new History();
    this.paused = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.stats = { frames: 0, times: [] };
    this.stage = new Stage($("view"));
    if (this.state.camera) this.stage.look(this.state.camera);
    this.plot = new Plot($("plot"));
    this.showPaused();
  }

  /** The person that the sliders apply to. */
  get one() {
    return this.state.people[this.state.chosen];
  }

  /** The walker that plot and scrubber show. */
  get shown() {
    return this.walkers[this.guest ? 0 : this.state.chosen];
  }

  /** Load a model: parameters, walkers, sliders; until it is there, the page goes on as it was. */
  async load(name, state = this.state) {
    this.wanted = name;
    this.mark("models", name);
    this.say("");
    const slow = setTimeout(() => this.say("Loading the model …"), SLOW);
    try {
      const found = await this.patiently(name, state.people);
      if (this.wanted !== name) return;
      this.say("");
      const capture = state.model === name ? state.capture : null;
      this.parameters = found;
      this.stepped ||= state === this.state && state.model !== name;
      if (this.state !== state || !this.shown) $("who").value = state.people[0].who; // of a link, for both
      this.state = state;
      state.model = name;
      for (const one of state.people) enter(one, name, found);
      this.controls = new Controls(this, found);
      this.people();
      $("models-section").open ||= name !== fresh().model;
      if (capture) await this.recall(capture);
      if (state.camera) this.stage.look(state.camera);
      if (state.stimulus) this.stimulate();
    } catch (error) {
      if (this.wanted === name) await this.failed(error, state);
    } finally {
      clearTimeout(slow);
    }
  }

  /** Report that a state can't be loaded, and keep the current one; a first link to nobody shows the average walker. */
  async failed(error, state) {
    this.wanted = this.state.model;
    if (this.parameters) this.mark("models", this.wanted);
    else if ([404, 422].includes(error.status) && link(state) !== link(fresh())) {
      await this.load(fresh().model, fresh());
    }
    this.say(error.message);
  }

  /** A model's parameters, with the people's strides at hand; retries while the service is loading it. */
  async patiently(name, people) {
    for (;;) {
      try {
        const found = await parameters(name);
        const entered = people.map((one) => enter({ ...one }, name, found));
        if (!streamed(found)) await Promise.all(entered.map((one) => strideOf(settingsOf(name, found, one))));
        return found;
      } catch (error) {
        if (!error.retryAfter || this.wanted !== name) throw error;
        this.say("The service is loading this model. Please wait …");
        await pause(error.retryAfter);
      }
    }
  }

  /** Create the walkers, for a new model or number of walkers. */
  people() {
    const { parameters: model, state } = this;
    state.chosen = Math.min(state.chosen, state.people.length - 1);
    state.capture = this.guest = null;
    this.dismiss();
    const how = { told: () => this.refresh(), say: (words) => this.say(words), paused: () => this.paused };
    this.walkers = state.people.map(() => walkerOf(model, state.model, how));
    this.walkers.forEach((walker, i) => walker.set(state.people[i]));
    this.stage.show(this.walkers.map((walker, i) => new Figure(walker, i === 1)));
    if (streamed(model)) this.grow();
    this.refresh();
  }

  /** Show the capture of an inspection, if the service still keeps it. */
  async recall(id) {
    const guest = await captureOf(id).catch((error) => this.say(error.message));
    if (guest) this.invite(guest, id);
  }

  /** Show a captured walker, of the inspection `id`; null returns to the model. */
  invite(guest, id = null) {
    this.stepped = true;
    this.guest = guest;
    this.state.capture = id;
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

  /** Close all walkers. */
  dismiss() {
    for (const walker of this.walkers) walker.close();
  }

  /** Start the streams from the service. */
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

  /** Apply a function to the selected person and update its walker. */
  change(by) {
    this.history.remember(this.state);
    by(this.one);
    this.apply();
  }

  /** Show the selected person as he is set now. */
  apply() {
    if (this.guest) {
      this.invite(null);
      return;
    }
    this.walkers[this.state.chosen].set(this.one);
    this.cycles = this.cycles.map((moment) => this.walkers[0].changed(moment));
    this.refresh();
  }

  /** Set the appearance, or the selected walker. */
  look(name, value) {
    this.state[name] = value;
    this.refresh();
  }

  /** Update the layout, only if it changes: that is expensive. */
  arrange() {
    const [figure, two, guest] = [this.state.figure, this.walkers.length > 1, this.guest !== null];
    if (this.arranged === `${figure} ${two} ${guest}`) return;
    this.arranged = `${figure} ${two} ${guest}`;
    $("chosen").hidden = $("names").hidden = !two;
    $("in-step").hidden = !two || streamed(this.parameters);
    for (const part of document.querySelectorAll(".of-model")) part.hidden = guest;
    if (guest) $("subject").after($("capture")); // what can be done with it, before all else
    else document.querySelector(".panel footer").before($("capture"));
    $("facts").hidden = two;
    $("stage").dataset.figure = figure;
    $("dots").hidden = figure !== "points";
    this.stage.resize(); // other things cover its edges now
  }

  /** Update the page from the state. */
  refresh() {
    const { state, stage, walkers, guest, shown } = this;
    if (!shown) return;
    if (!guest) this.controls.show(this.one, shown);
    stage.aim(Math.max(...walkers.map((walker) => walker.body.height)));
    stage.figures.forEach((figure) => figure.look(state, this.moves(figure.walker)));
    this.plot.show(walkers);
    for (const id of FLAGS) $(id).checked = state[id];
    this.mark("figure", state.figure);
    this.mark("models", this.wanted);
    this.mark("chosen", String(state.chosen));
    $("compare").setAttribute("aria-pressed", String(walkers.length > 1));
    if (document.activeElement !== $("seed")) {
      $("seed").value = this.one.seed; // not what somebody is typing
      numberOf($("seed"));
    }
    $("together").checked = state.together;
    $("undo").disabled = !this.history.past.length;
    $("redo").disabled = !this.history.future.length;
    this.arrange();
    this.tell();
    $("about").textContent = this.parameters.about;
    const model = titleOf(state.model);
    const own = state.model.startsWith("fitted/") ? `Model: ${model}` : "";
    $("model-name").textContent = model;
    $("subject").hidden = !guest && !own;
    $("subject-title").textContent = guest ? `Your capture: ${guest.name}` : own;
    $("subject-facts").textContent = guest ? guest.facts() : this.controls.learned;
    $("traits-hint").textContent = `0 is the average ${own ? "walk that the model learned from" : "of all people"}; most are between −2 and +2.`;
    $("angles-span").textContent = guest ? "over the capture" : this.controls.span;
    $("captured").hidden = !guest?.points;
    $("gait").disabled = this.parameters.steerable;
    $("stimulate").disabled = streamed(this.parameters);
    stage.changed = true;
    this.write();
  }

  /** Check the radio button with a value. */
  mark(id, value) {
    for (const input of $(id).querySelectorAll("input")) input.checked = input.value === value;
  }

  /** Displacements of a walker's dots if they are scrambled, otherwise null. */
  moves(walker) {
    if (!this.state.scattered) return null;
    return scattered(averageMarkers(walker), walker.body.height, this.one.seed);
  }

  /** Write the state to the address, debounced; after a `step`, Back returns to the address before. */
  write() {
    clearTimeout(this.writing);
    this.writing = setTimeout(() => {
      const address = `#${link(this.state)}`;
      if (this.stepped && address !== location.hash) history.pushState(null, "", address);
      else history.replaceState(null, "", address);
      this.stepped = false;
    }, LINK_AFTER);
  }

  /** Something is about to be done to people that is a step of its own, for Undo and for Back. */
  step() {
    this.history.remember(this.state, true);
    this.stepped = true;
    this.say("");
  }

  /** A random walker. */
  draw(seed = Math.floor(Math.random() * 1e6)) {
    this.step();
    drawn(Object.assign(this.one, { who: $("who").value }), seed);
    this.anew();
  }

  /** Nothing of what was done is remembered, as a part of it isn't there any more. */
  forget() {
    this.history = new History();
    this.refresh();
  }

  /** The average walker at its own speed. */
  reset() {
    this.step();
    level(this.one);
    this.anew();
  }

  /** Restart the selected person; streams start again from the seed. */
  anew() {
    if (streamed(this.parameters)) this.people();
    else this.apply();
  }

  /** Two walkers side by side, the second drawn at random, or one again. */
  compare() {
    this.step();
    const { people } = this.state;
    if (people.length > 1) people.length = 1;
    else people.push(drawn({ ...people[0] }, people[0].seed + 1));
    this.state.chosen = people.length - 1;
    this.cycles[1] = this.cycles[0];
    this.people();
  }

  /** Go one step back in what was done to people, or forward again; the model comes along. */
  turnBack(back = true) {
    const then = back ? this.history.back(this.state) : this.history.forth(this.state);
    if (then) this.load(then.model, { ...this.state, ...then, capture: null });
  }

  /** Pause or resume. */
  pause(paused = !this.paused) {
    this.paused = paused;
    this.walkers.forEach((walker, i) => walker.rest(paused, this.cycles[i]));
    this.showPaused();
  }

  showPaused() {
    $("pause").setAttribute("aria-pressed", String(this.paused));
    $("pause").setAttribute("aria-label", this.paused ? "Walk" : "Pause");
  }

  /** Pause at a share of the cycle or of the motion. */
  scrub(share) {
    if (!this.shown) return; // nobody walks yet
    this.cycles = this.cycles.fill(this.shown.moment(share));
    this.pause(true);
    this.stage.changed = true;
  }

  /** The button of the named view that is the present one, or undefined. */
  get facing() {
    const [around, up] = this.stage.view;
    const near = ({ dataset }) => Math.abs(up - UP) < NEAR && Math.abs(around - Number(dataset.view)) < NEAR;
    return [...document.querySelectorAll("[data-view]")].find(near);
  }

  /** Show which of the named views is the present one. */
  markView() {
    const { facing } = this;
    for (const button of document.querySelectorAll("[data-view]")) button.setAttribute("aria-pressed", String(button === facing));
  }

  /** Change the view. */
  view(from) {
    this.stage.move(from);
    this.state.camera = this.stage.view;
    this.write();
  }

  /** Open the dialogue of stimuli for experiments, which needs walkers in place. */
  stimulate() {
    this.stimuli?.close();
    if (this.guest || streamed(this.parameters)) {
      this.state.stimulus = null;
      this.say("Stimuli need a walker in place: choose another model.");
      return;
    }
    const { state, walkers, paused } = this;
    state.stimulus ??= this.stimulus ?? plain();
    const changed = (stimulus) => {
      this.stimulus = stimulus ?? state.stimulus; // for the next time
      state.stimulus = stimulus;
      this.write();
    };
    const people = state.people.map((one, i) => {
      const { weight, ...settings } = settingsOf(state.model, this.parameters, settled({ ...one }, walkers[i].cycle));
      return settings; // dots don't show how heavy somebody is
    });
    const name = state.people.map((one) => wordsOf(state, one, this.parameters)).join(" and ");
    this.stimuli = new StimulusDialogue({ walkers, people, first: state.chosen, stimulus: state.stimulus, paused, changed, name });
    this.stimuli.open();
    this.write();
  }

  /** Show the gait of the selected person, as the service analyses it. */
  async analyse() {
    const who = settingsOf(this.state.model, this.parameters, this.one);
    const report = await gaitOf({ ...who, seed: this.one.seed, variation: 0 });
    const title = this.walkers.length > 1 ? `walker ${"AB"[this.state.chosen]}` : "this walker";
    new GaitDialogue(report, title, `motionenv ${wordsOf(this.state, this.one, this.parameters)}`).open();
  }

  /** Show a message over the stage; an empty one hides it. */
  say(words) {
    $("note").textContent = words;
    $("note").hidden = !words;
  }

  /** Copy a link to the state; returns whether the clipboard could be used. */
  async copyLink() {
    this.stepped = true;
    this.write();
    try {
      await navigator.clipboard.writeText(`${location.href.split("#")[0]}#${link(this.state)}`);
      return true;
    } catch {
      return false;
    }
  }

  /** From a capture, or a model of one's own, back to the model that everybody has. */
  leave() {
    if (this.guest) this.invite(null);
    else this.load(fresh().model);
  }

  /** Everything works: let it be used. */
  ready() {
    for (const part of document.querySelectorAll("[inert]")) part.inert = false;
    $("loading").hidden = true;
  }

  /** The address changed: show its state. */
  follow() {
    if (this.wanted === this.state.model && location.hash === `#${link(this.state)}`) return;
    const state = fromLink(location.hash);
    this.stimuli?.close();
    this.load(state.model, state);
  }

  /** One frame, `now` [ms]. */
  frame(now) {
    requestAnimationFrame((time) => this.frame(time));
    const begun = performance.now();
    const passed = Math.min(0.1, (now - (this.before ?? now)) / 1000);
    this.before = now;
    this.stage.controls.update();
    if (this.state.stimulus) return; // the dialogue is over the stage
    if (!this.walkers.length || (this.paused && !this.stage.changed)) return;
    if (!this.paused) this.pass(passed);
    this.walkers.forEach((walker, i) => walker.show(this.cycles[i]));
    for (const figure of this.stage.figures) figure.update();
    if (this.paused || this.stats.frames % PLOT_EVERY === 0) this.follows();
    const ready = performance.now();
    this.stage.draw(this.state.figure === "points");
    this.count(begun, ready);
  }

  /** Advance time; streams side by side are shown at the same time, and who walks in step has a common cadence. */
  pass(seconds) {
    const { walkers, state } = this;
    const together = state.together && walkers.length > 1 && walkers.every(({ cyclic }) => cyclic);
    const common = together ? (walkers[0].seconds + walkers[1].seconds) / 2 : null;
    walkers.forEach((walker, i) => {
      const passed = together ? (seconds * walker.seconds) / common : seconds;
      this.cycles[i] = walker.after(this.cycles[i], passed);
    });
    if (together) this.cycles.fill(this.cycles[0]);
    const grown = streamed(this.parameters) && !this.guest;
    if (grown) this.cycles.fill(Math.min(...this.cycles.slice(0, this.walkers.length)));
  }

  /** Update plot, scrubber and text. */
  follows() {
    const { walkers, cycles, shown, paused } = this;
    const moment = cycles[walkers.indexOf(shown)];
    this.plot.mark(walkers, cycles, walkers.indexOf(shown));
    if (paused) $("scrub").setAttribute("aria-valuetext", shown.when(moment));
    else $("scrub").value = shown.share(moment);
    if (!shown.cyclic) this.tell();
  }

  /** Show the summary of each walker. */
  tell() {
    const { walkers, cycles } = this;
    const places = walkers.length > 1 ? $("names").querySelectorAll("span") : [$("facts")];
    places.forEach((place, i) => (place.textContent = walkers[i].facts(cycles[i])));
  }

  /** Record times of the frame [ms]: start, update, draw. */
  count(begun, moved) {
    const { times } = this.stats;
    if (this.stats.frames++ === 0) {
      performance.mark("walking");
      $("poster").hidden = true;
    }
    times.push([begun, moved, performance.now()]);
    if (times.length > KEPT) times.shift();
  }
}
