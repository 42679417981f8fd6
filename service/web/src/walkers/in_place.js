// Walkers in place: strides that the service computes, each faded into the next.

import { keptStride, strideOf } from "../api/strides.js";
import { flexions, standing, Walker } from "./base.js";
import { Body, forward, limbEnds } from "./kinematics.js";
import { between } from "./periodic.js";

const FADE = 0.15; // [s] in which a stride turns into the next one
const SAMPLES = 96; // of a stride before the first one is known
const RETRY = 1000; // [ms] in a second

/** A body of its own proportions. */
function bodyOf(parameters, { offsets, radii, height }) {
  const relative = { offsets: offsets.map((x) => x / height), limb_radii: radii.map((x) => x / height) };
  const arrays = { ...parameters.arrays, ...relative };
  return new Body({ ...parameters, arrays }, height);
}

/** Nobody walks before the first stride is there. */
function still(parameters) {
  const body = new Body(parameters, parameters.height);
  const nodes = new Float64Array(48);
  const pose = standing(body.height);
  forward(pose, body, nodes, new Float64Array(108));
  const repeated = (values) => Float64Array.from({ length: SAMPLES * values.length }, (_, i) => values[i % values.length]);
  return {
    poses: repeated(pose),
    markers: repeated(nodes.subarray(0, 45)),
    offsets: body.offsets,
    radii: body.radii.map((x) => x * body.height),
    height: body.height,
    stride: 0,
    seconds: 1,
  };
}

/** What is a `share` of the way from one stride to another. */
function mixed(a, b, share) {
  const mix = (x, y) => x + share * (y - x);
  const arrays = ["poses", "markers", "offsets"].map((name) => [name, b[name].map((y, i) => mix(a[name][i], y))]);
  const numbers = ["height", "stride", "seconds"].map((name) => [name, mix(a[name], b[name])]);
  return Object.fromEntries([...arrays, ...numbers, ["radii", b.radii]]);
}

/** A walker whose strides are the service's: `cycle` is the one that its settings ask for. */
export class WalkerInPlace extends Walker {
  /** `told()` is called when a stride has come, `say(words)` with what went wrong, `paused()` says whether time stands. */
  constructor(parameters, model, { told = () => {}, say = () => {}, paused = () => false } = {}) {
    super(parameters);
    Object.assign(this, { model, told, say, paused });
    this.pose = new Float64Array(25);
    this.shownAt = 0;
    this.take(still(parameters));
  }

  /** Ask for the stride of a person's settings; what walks goes on until it is there. */
  set(one) {
    this.wanted = settingsOf(this.model, this.parameters, one);
    const kept = keptStride(this.wanted);
    if (kept) this.take(kept);
    else this.asking ??= this.ask().finally(() => (this.asking = null));
  }

  /** One request at a time: what is wanted then is asked for next, and what was wanted meanwhile is left out. */
  async ask() {
    for (let asked = null; asked !== this.wanted; ) {
      asked = this.wanted;
      try {
        const stride = await strideOf(asked);
        if (this.closed) return;
        if (asked !== this.wanted && keptStride(this.wanted)) continue;
        this.take(stride);
        if (this.troubled) this.say("");
        this.troubled = false;
        this.told();
      } catch (error) {
        this.troubled = true;
        this.say(error.message);
        if (!error.retryAfter) return;
        await new Promise((done) => setTimeout(done, RETRY * error.retryAfter));
        asked = null;
      }
    }
  }

  /** Walk with a stride from now on. */
  take(cycle) {
    this.from = this.cycle?.stride && !this.paused() ? this.now : cycle;
    this.cycle = cycle;
    this.faded = this.from === cycle ? 1 : 0;
    this.body = bodyOf(this.parameters, cycle);
    this.stride = cycle.stride;
    this.seconds = cycle.seconds;
    this.curves = flexions(Array.from({ length: cycle.poses.length / 25 }, (_, j) => cycle.poses.subarray(25 * j, 25 * j + 25)));
    this.now = this.from;
    this.built = this.faded === 1 ? this.body : bodyOf(this.parameters, this.now);
  }

  after(moment, passed) {
    if (this.faded < 1) {
      this.faded = Math.min(1, this.faded + passed / FADE);
      this.now = this.faded < 1 ? mixed(this.from, this.cycle, this.faded) : this.cycle;
      this.built = this.faded < 1 ? bodyOf(this.parameters, this.now) : this.body;
    }
    return moment + passed / this.now.seconds;
  }

  show(moment) {
    const { now, built, nodes, rotations } = this;
    between(now.poses, 25, moment, this.pose);
    forward(this.pose, built, nodes, rotations);
    limbEnds(nodes, rotations, built, this.limbs);
    between(now.markers, 45, moment, this.markers);
    this.ground[0] += (moment - this.shownAt) * now.stride; // so that another stride doesn't move it
    this.shownAt = moment;
  }

  close() {
    this.closed = true;
  }
}

/** How a request names a person of a model, who may have no components. */
export function settingsOf(model, { components }, { deviations, drawn, seed, who, speed, height, weight }) {
  if (drawn) return { model, seed, person: who, speed, height, weight };
  const all = Array.from({ length: components }, (_, k) => deviations[k] ?? 0);
  return { model, deviations: components ? all : null, speed, height, weight };
}
