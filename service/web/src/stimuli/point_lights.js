// Where the dots of a stimulus are at any time: motionenv/data/stimuli/dots.py.

import { block, uniforms } from "./philox.js";

export const WALKER = 15; // dots of the walker
const [PLACES, PHASES, ORDER, MASK] = [1, 2, 3, 4]; // streams of random numbers
const BOX = [0.5, 0.5, 0.88]; // [body heights] in which dots are scrambled
const BELOW = 0.06; // [body heights] of the box
const MEANS = 4; // samples of a cycle from one that counts to the next, for the mean place of a dot

/** One cycle of a walker in place: `markers` (samples × 45) [m], `mean` (45), `stride`, `seconds`, `height`. */
export function ringOf({ cycle: { markers, stride, seconds, height } }) {
  const mean = new Float64Array(45);
  for (let j = 0; j < markers.length; j += 45 * MEANS) {
    for (let i = 0; i < 45; i++) mean[i] += (45 * MEANS * markers[j + i]) / markers.length;
  }
  return { markers, mean, stride, seconds, height };
}

/** Marker `which` of a ring at a phase [cycles]: [x, y, z] [m], by a Catmull-Rom spline. */
function markerAt({ markers }, phase, which) {
  const samples = markers.length / 45;
  const at = (phase - Math.floor(phase)) * samples;
  const first = Math.floor(at);
  const u = at - first;
  const weights = [
    u * (-0.5 + u * (1 - 0.5 * u)),
    1 + u * u * (-2.5 + 1.5 * u),
    u * (0.5 + u * (2 - 1.5 * u)),
    u * u * (-0.5 + 0.5 * u),
  ];
  const sample = (k) => 45 * ((first + k - 1 + samples) % samples) + 3 * which;
  return [0, 1, 2].map((c) => weights.reduce((sum, weight, k) => sum + weight * markers[sample(k) + c], 0));
}

/** The dots of one walker in one display. */
export class PointLights {
  constructor(display, ring) {
    this.display = display;
    this.ring = ring;
    this.order = [];
    this.lives = []; // of each dot of the mask: which life its numbers are of, and they
    this.offsets = display.desynchronised ? uniforms([display.seed, PHASES], WALKER) : Array(WALKER).fill(0);
    this.moves = display.scrambled ? this.scattered() : null;
  }

  scattered() {
    const { seed } = this.display;
    const { height, mean } = this.ring;
    const middle = [0.5, 0.5, 0];
    return uniforms([seed, PLACES], 3 * WALKER).map((number, i) => {
      const place = (number - middle[i % 3]) * BOX[i % 3] + (i % 3 === 2 ? BELOW : 0);
      return place * height - mean[i];
    });
  }

  /** Dots at a time [s]: `{x, y, visible}` each, [body heights] to the right and up from the middle of the body. */
  at(seconds) {
    const { display, ring } = this;
    const phase = display.phase + (display.rate * seconds) / ring.seconds;
    const shown = this.visible(seconds);
    const own = Array.from({ length: WALKER }, (_, i) => {
      const place = markerAt(ring, phase + this.offsets[i], i);
      return { place: this.moves ? place.map((x, c) => x + this.moves[3 * i + c]) : place, visible: shown.includes(i) };
    });
    const mask = Array.from({ length: display.mask }, (_, i) => ({ place: this.masking(seconds, phase, i), visible: true }));
    if (display.across) {
      const way = (ring.stride / ring.seconds) * display.rate * seconds;
      const on = way - Math.floor(way / display.across) * display.across - 0.5 * display.across;
      for (const { place } of own) place[0] += on;
    }
    return [...own, ...mask].map(({ place, visible }) => ({ ...this.projected(place, seconds), visible }));
  }

  /** Which dots of the walker are visible: the last ones of an order in which none comes again while it is visible. */
  visible(seconds) {
    const { dots, lifetime, seed } = this.display;
    const first = lifetime === null ? 0 : Math.floor((Math.max(seconds, 0) * dots) / lifetime);
    while (this.order.length < first + dots) {
      const next = this.order.length;
      if (next % 4 === 0) this.numbers = block([seed, ORDER], next / 4 + 1);
      const recent = this.order.slice(-dots);
      const free = Array.from({ length: WALKER }, (_, i) => i).filter((i) => !recent.includes(i));
      this.order.push(free[Math.floor(this.numbers[next % 4] * free.length)]);
    }
    return this.order.slice(first, first + dots);
  }

  /** Dot `i` of the mask: it moves as one of the walker's, at a random phase around a place that changes with each life. */
  masking(seconds, phase, i) {
    const { mask, mask_size: size, lifetime, seed } = this.display;
    const { height, mean } = this.ring;
    const life = lifetime === null ? 0 : Math.floor(seconds / lifetime + i / mask);
    if (this.lives[i]?.life !== life) this.lives[i] = { life, numbers: block([seed, MASK], life * mask + i + 1) };
    const [offset, ...place] = this.lives[i].numbers;
    const which = i % WALKER;
    const middle = [0, 0, 0.5 * height];
    return markerAt(this.ring, phase + offset, which).map(
      (x, c) => x - mean[3 * which + c] + (place[c] - 0.5) * size * height + middle[c],
    );
  }

  projected([x, y, z], seconds) {
    const { view, turntable, roll, inverted } = this.display;
    const { height } = this.ring;
    const [alpha, beta] = [view + turntable * seconds, roll].map((angle) => (angle * Math.PI) / 180);
    const right = (Math.cos(alpha) * x + Math.sin(alpha) * y) / height;
    const up = (inverted ? height - z : z) / height - 0.5;
    return { x: Math.cos(beta) * right - Math.sin(beta) * up, y: Math.sin(beta) * right + Math.cos(beta) * up };
  }
}
