// The sliders of the selected walker.

import { moved } from "./holding.js";
import { capital, Choice, Slider } from "./widgets.js";
import { LIMIT, RANGES, settled } from "../state.js";

const deviation = (value) => `${value > 0 ? "+" : value < 0 ? "−" : ""}${Math.abs(value).toFixed(2)}`;
const WALKING = { "pace-title": "Walk", randomise: "Random walker", reset: "Average" };
const GROWING = { "pace-title": "Motion", randomise: "New motion", reset: "Reset" };
const USUAL_BMI = 24; // [kg/m²] where the weight's slider stands if the walker's is unknown
const SLOWER = 0.5; // [m/s] that the speed's slider goes beyond what the model learned from
const FASTER = 0.9;

const sum = (a, b) => a.reduce((total, x, k) => total + x * (b[k] ?? 0), 0);

/** The sliders of a model; they call `app.change(person => …)`. */
export class Controls {
  constructor(app, parameters) {
    this.app = app;
    this.parameters = parameters;
    const { steerable } = parameters;
    this.fill("traits", this.traits());
    this.fill("body", steerable ? [] : this.body());
    this.fill("pace", steerable ? this.steering() : [this.speed()]);
    this.fill("components", this.components());
    const hidden = (id, hide) => (document.getElementById(id).hidden = hide);
    hidden("traits-hint", !this.traitsSliders.length);
    hidden("body-section", !this.bodySliders.length);
    hidden("components-section", !this.componentsSliders.length);
    hidden("who-field", steerable);
    hidden("held-hint", true);
    this.span = steerable ? "over the last seconds" : "over one cycle"; // of the plot
    for (const [id, words] of Object.entries(steerable ? GROWING : WALKING)) document.getElementById(id).textContent = words;
  }

  fill(id, sliders) {
    document.getElementById(id).replaceChildren(...sliders.map((slider) => slider.row));
    this[`${id}Sliders`] = sliders;
  }

  traits() {
    const { traits, arrays, components } = this.parameters;
    this.directions = Object.fromEntries(
      traits.map((_, i) => [`t${i}`, Array.from(arrays.traits.subarray(i * components, (i + 1) * components))]),
    );
    return traits.map(({ name, low, high, note }, i) => this.trait(`t${i}`, name, low, high, note));
  }

  trait(id, name, low, high, note) {
    const label = `${capital(name)}: from ${low} to ${high}, in standard deviations`;
    const ends = { low: capital(low), high: capital(high) };
    const slider = new Slider({ label, ...ends, ...this.holding(id, `${ends.low} – ${ends.high}`) });
    slider.name = `${ends.low} – ${ends.high}`;
    slider.row.title = note;
    return slider;
  }

  /** What sliders have in common whose values stay where a user puts them. */
  holding(slider, name) {
    return {
      id: slider,
      min: -LIMIT,
      max: LIMIT,
      step: 0.05,
      text: deviation,
      changed: (value) => this.app.change((one) => this.along(one, slider, value, name)),
      held: (on) =>
        this.app.change((one) => (one.held = [...one.held.filter((other) => other !== slider), ...(on ? [slider] : [])])),
    };
  }

  /** Move a person along a slider's direction to `value`, as far as the held ones let it; then hold this one, too. */
  along(one, slider, value, name) {
    settled(one, this.app.shown.cycle ?? {});
    const others = one.held.filter((other) => other !== slider);
    one.deviations = moved(one.deviations, this.directions[slider], value, others.map((other) => this.directions[other]));
    one.held = [...others, slider];
    const missed = Math.abs(value - sum(this.directions[slider], one.deviations)) > 0.05;
    this.app.say(missed ? `“${name}” goes no further while other sliders are held. Open the lock beside one of them.` : "");
  }

  speed() {
    const [least, most] = this.parameters.learned_speeds;
    const learned = (value) => value >= 0.99 * (least ?? 0) && value <= 1.01 * (most ?? Infinity);
    const words = (value) => `${value.toFixed(2)} m/s${learned(value) ? "" : ", extrapolated"}`;
    const range = [Math.max(RANGES.speed[0], (least ?? 0) - SLOWER), Math.min(RANGES.speed[1], (most ?? Infinity) + FASTER)];
    const slider = this.own("speed", "Speed", "Speed in metres per second", 0.01, words, range.map((v) => Math.round(100 * v) / 100));
    slider.row.title = this.learned;
    return slider;
  }

  /** At what speeds the walks were that the model learned from, in words. */
  get learned() {
    const [least, most] = this.parameters.learned_speeds.map((speed) => speed?.toFixed(2));
    return most ? `Learned from walks at ${least === most ? "" : `${least} to `}${most} m/s` : "";
  }

  body() {
    return [
      this.own("height", "Height", "Body height in metres", 0.01, (value) => `${value.toFixed(2)} m`),
      this.own("weight", "Weight", "Body weight in kilograms", 1, (value) => `${value.toFixed(0)} kg`),
    ];
  }

  /** A slider for what each walker has of its own until it is set. */
  own(name, named, label, step, text, [min, max] = RANGES[name]) {
    const changed = (value) => this.app.change((one) => (one[name] = value));
    return new Slider({ label, named, min, max, step, text, changed, own: "use the walker's own" });
  }

  steering() {
    const temperature = new Slider({
      label: "Temperature: how far the motion may deviate from the captured clips",
      low: "Like the clips",
      high: "Free",
      min: -2,
      max: 0,
      step: 0.05,
      home: Math.log10(0.05),
      text: (value) => (10 ** value).toFixed(2),
      changed: (value) => this.app.change((one) => (one.temperature = 10 ** value)),
    });
    const activity = new Choice({
      label: "Activity",
      choices: this.parameters.activities,
      none: "any",
      changed: (value) => this.app.change((one) => (one.activity = value)),
    });
    const speed = new Slider({
      label: "Target speed in metres per second",
      named: "Target speed",
      min: RANGES.speed[0],
      max: RANGES.speed[1],
      step: 0.01,
      own: "no target",
      text: (value) => `${value.toFixed(2)} m/s`,
      changed: (value) => this.app.change((one) => (one.speed = value)),
    });
    const heading = new Slider({
      label: "Target heading in degrees, positive to the left",
      named: "Target heading",
      min: -180,
      max: 180,
      step: 5,
      own: "no target",
      text: (value) => (value ? `${Math.abs(value)}° ${value > 0 ? "left" : "right"}` : "straight ahead"),
      changed: (value) => this.app.change((one) => (one.heading = value)),
    });
    return [temperature, activity, speed, heading];
  }

  components() {
    const { components, shares } = this.parameters;
    const percent = (share) => `${(100 * share).toFixed(share < 0.095 ? 1 : 0)} %`;
    return Array.from({ length: components }, (_, k) => {
      this.directions[`c${k}`] = Array.from({ length: components }, (_, i) => Number(i === k));
      const slider = new Slider({
        label: `Direction ${k + 1}, in standard deviations; it explains ${percent(shares[k])} of the variance`,
        named: `${k + 1}  ·  ${percent(shares[k])}`,
        ...this.holding(`c${k}`, `Direction ${k + 1}`),
      });
      slider.name = `Direction ${k + 1}`;
      return slider;
    });
  }

  /** Say what a closed lock does, once there is one. */
  explainLocks({ held }) {
    const name = (slider) => this[slider[0] === "t" ? "traitsSliders" : "componentsSliders"][Number(slider.slice(1))].name;
    const names = held.map((slider) => `“${name(slider)}”`);
    const told = document.getElementById("held-hint");
    told.hidden = !held.length;
    const words = `${names.join(", ")}: held as you set ${held.length > 1 ? "them" : "it"} while other sliders move. Click a closed lock to let its slider move along.`;
    if (told.textContent !== words) told.textContent = words; // it is read aloud
  }

  /** Show the settings of a person. */
  show(one, walker) {
    if (this.parameters.steerable) {
      const [temperature, activity, speed, heading] = this.paceSliders;
      temperature.show(Math.log10(one.temperature));
      activity.show(one.activity);
      speed.show(one.speed ?? 1.2, one.speed !== null, "none");
      heading.show(one.heading ?? 0, one.heading !== null, "none");
      return;
    }
    for (const slider of [...this.traitsSliders, ...this.componentsSliders]) {
      const deviations = one.drawn ? (walker.cycle?.deviations ?? []) : one.deviations;
      slider.show(sum(this.directions[slider.id], deviations)).hold(one.held.includes(slider.id));
    }
    const [speed] = this.paceSliders;
    speed.show(one.speed ?? (walker.speed || 1.2), one.speed !== null, walker.cyclic ? null : "its own");
    const [height, weight] = this.bodySliders;
    height.show(one.height ?? walker.body.height, one.height !== null);
    const own = walker.cycle?.weight ?? null; // null of walkers without a person's body
    weight.show(one.weight ?? own ?? USUAL_BMI * walker.body.height ** 2, one.weight !== null, own === null ? "its own" : null);
    this.explainLocks(one);
  }
}
