// One cycle of an eigenwalker on the spot: motionenv/models/treadmill_cycle.py, markers_in_place.

import { Body, place, turnFoot } from "./kinematics.js";
import { evenly, slope } from "./periodic.js";
import { SAMPLES } from "./treadmill_cycle.js";

const PELVIS = 2;
const SHOULDERS = [3, 4];
const LEGS = [
  [9, 11, 13],
  [10, 12, 14],
];

/** 1, sin, cos, sin 2, cos 2 of a phase [rad]. */
const waves = (phase) => [1, Math.sin(phase), Math.cos(phase), Math.sin(2 * phase), Math.cos(2 * phase)];

/** Markers (45) at a phase [rad] of coefficients (5 × 45). */
export function markersAt(w, phase, out) {
  out.fill(0);
  waves(phase).forEach((wave, h) => {
    for (let i = 0; i < 45; i++) out[i] += wave * w[45 * h + i];
  });
  return out;
}

const distance = (m, a, b) => Math.hypot(m[3 * a] - m[3 * b], m[3 * a + 1] - m[3 * b + 1], m[3 * a + 2] - m[3 * b + 2]);

/** Stride length [m] of coefficients (5 × 45): what the foot whose ankle moves back fastest goes in a cycle. */
function strideOf(w, roll) {
  let back = 0;
  for (let j = 0; j < 48; j++) {
    const [, s, c, s2, c2] = waves((j * 2 * Math.PI) / 48);
    const forward = (ankle) => {
      const part = (h) => w[45 * h + ankle];
      return part(1) * c - part(2) * s + 2 * (part(3) * c2 - part(4) * s2);
    };
    back -= Math.min(forward(39), forward(42)) / 48;
  }
  return roll * 2 * Math.PI * back;
}

/** The same person at another speed: motionenv/models/eigenwalkers/speed.py, at_speed. */
function atSpeed(parameters, w, seconds, speed) {
  const { arrays, reach, roll } = parameters;
  const lengthOf = (a) => Math.log(strideOf(a, roll));
  const size = bodyHeight(parameters, w);
  const average = lengthOf(arrays.mean) - Math.log(bodyHeight(parameters, arrays.mean));
  const reached = (x) => Math.max(Math.min(x, 0.5 * (x + average + reach[1])), average + reach[0]);
  const length = lengthOf(w);
  const now = length - Math.log(size);
  const goal = now + arrays.speed_exponent[0] * (Math.log(speed * seconds) - length);
  const change = reached(goal) - reached(now);
  const longer = (step) => w.map((x, i) => x + step * size * arrays.speed_direction[i]);
  let step = change;
  for (let i = 0; i < 2; i++) step += change - (lengthOf(longer(step)) - length);
  return longer(step);
}

/** Coefficients (5 × 45) of the walker, standing on z = 0. */
function coefficients(parameters, deviations, seconds, { speed, height }) {
  const { arrays, components } = parameters;
  let w = Float64Array.from(arrays.mean);
  for (let k = 0; k < components; k++) {
    const score = arrays.mean_scores[k] + arrays.deviations[k] * (deviations[k] ?? 0);
    for (let i = 0; i < w.length; i++) w[i] += score * arrays.components[k * w.length + i];
  }
  if (speed !== null) {
    const size = height === null ? 1 : height / bodyHeight(parameters, w);
    w = atSpeed(parameters, w, seconds, speed / size);
  }
  const markers = new Float64Array(45);
  let lowest = Infinity;
  for (let j = 0; j < 180; j++) {
    markersAt(w, (j * 2 * Math.PI) / 180, markers);
    lowest = Math.min(lowest, markers[3 * 13 + 2], markers[3 * 14 + 2]);
  }
  const pelvis = w[3 * PELVIS + 2];
  return { w, lowest, pelvis };
}

function bodyHeight(parameters, w) {
  const markers = new Float64Array(45);
  let legs = 0;
  let trunk = 0;
  for (let j = 0; j < 12; j++) {
    markersAt(w, (j * 2 * Math.PI) / 12, markers);
    for (const [hip, knee, ankle] of LEGS) legs += (distance(markers, hip, knee) + distance(markers, knee, ankle)) / 12;
    const [a, b] = SHOULDERS.map((i) => markers.subarray(3 * i, 3 * i + 3));
    trunk += Math.hypot(...[0, 1, 2].map((c) => 0.5 * (a[c] + b[c]) - markers[3 * PELVIS + c])) / 12;
  }
  return (0.5 * legs + trunk) / (parameters.leg_share + parameters.trunk_share);
}

/**
 * One cycle: `markers` (SAMPLES × 45) [m], `stride` [m], `seconds`, and the `body` that gives limbs their thickness.
 * With a `height` the walker is scaled to it.
 */
export function walkerInPlace(parameters, deviations, { speed = null, height = null } = {}) {
  const { arrays } = parameters;
  const logFrequency = deviations.reduce((sum, d, k) => sum + d * arrays.log_frequency_weights[k], arrays.log_frequency_mean[0]);
  const ownSeconds = Math.exp(-logFrequency);
  const { w, lowest, pelvis } = coefficients(parameters, deviations, ownSeconds, { speed, height });
  const lift = (parameters.ankle_height / parameters.leg_share) * (pelvis - lowest) - lowest;
  for (let i = 2; i < 45; i += 3) w[i] += lift;
  const own = bodyHeight(parameters, w);
  const scale = height === null ? 1 : height / own;
  const body = new Body(parameters, own);
  const markers = new Float64Array(45 * SAMPLES);
  for (let j = 0; j < SAMPLES; j++) {
    markersAt(w, (j * 2 * Math.PI) / SAMPLES, markers.subarray(45 * j, 45 * j + 45));
  }
  const { way, stride } = evenly(velocity(ballsOf(markers, body), body));
  straighten(markers, way, stride);
  const length = scale * Math.hypot(...stride);
  const seconds = speed === null ? ownSeconds : length / speed;
  if (scale !== 1) for (let i = 0; i < markers.length; i++) markers[i] *= scale;
  return { markers, stride: length, seconds, body: new Body(parameters, own * scale) };
}

function ballsOf(markers, body) {
  const frame = new Frame(body);
  const out = new Float64Array(6 * SAMPLES);
  for (let j = 0; j < SAMPLES; j++) {
    frame.set(markers.subarray(45 * j, 45 * j + 45));
    frame.balls(out.subarray(6 * j, 6 * j + 6));
  }
  return out;
}

/** Velocity (SAMPLES × 2) [m per cycle] that keeps the standing foot's ball going back evenly. */
function velocity(balls, body) {
  const speeds = slope(balls, 6);
  const back = (j, s) => -speeds[6 * j + 3 * s];
  let most = -Infinity;
  for (let j = 0; j < SAMPLES; j++) most = Math.max(most, back(j, 0), back(j, 1));
  const out = new Float64Array(2 * SAMPLES);
  for (let j = 0; j < SAMPLES; j++) {
    const fastest = Math.max(back(j, 0), back(j, 1));
    const weights = [0, 1].map((s) => Math.exp((back(j, s) - fastest) / (body.contact.marker_firmness * most)));
    for (let s = 0; s < 2; s++) {
      const weight = weights[s] / (weights[0] + weights[1]);
      for (let c = 0; c < 2; c++) out[2 * j + c] -= weight * speeds[6 * j + 3 * s + c] * SAMPLES;
    }
  }
  return out;
}

/** Move markers along the way, and turn them so that the stride goes along x. */
function straighten(markers, way, stride) {
  const length = Math.hypot(...stride);
  const [c, s] = [stride[0] / length, stride[1] / length];
  for (let j = 0; j < SAMPLES; j++) {
    for (let i = 45 * j; i < 45 * j + 45; i += 3) {
      const x = markers[i] + way[2 * j];
      const y = markers[i + 1] + way[2 * j + 1];
      markers[i] = c * x + s * y;
      markers[i + 1] = c * y - s * x;
    }
  }
}

/** Frames of the body's segments, told from the 15 markers alone: enough to draw limbs between them. */
export class Frame {
  constructor(body) {
    this.body = body;
    this.nodes = new Float64Array(48);
    this.rotations = new Float64Array(108);
  }

  /** Take over markers (45). */
  set(markers) {
    const { nodes, rotations: r, body } = this;
    nodes.set(markers);
    for (let c = 0; c < 3; c++) nodes[45 + c] = 0.5 * (markers[9 + c] + markers[12 + c]);
    const hips = this.between(10, 9);
    const shoulders = this.between(4, 3);
    const across = hips.map((v, i) => v / Math.hypot(...hips) + shoulders[i] / Math.hypot(...shoulders));
    this.orient(0, this.between(PELVIS, 15), across);
    this.orient(1, this.between(15, 0), shoulders);
    for (const [segment, far, near] of [[2, 5, 3], [3, 7, 5], [4, 6, 4], [5, 8, 6]]) {
      this.orient(segment, this.between(far, near), shoulders);
    }
    for (const [segment, far, near] of [[6, 11, 9], [7, 13, 11], [8, 12, 10], [9, 14, 12]]) {
      this.orient(segment, this.between(far, near), hips);
    }
    turnFoot(r, 63, 90, nodes[3 * 13 + 2], body);
    turnFoot(r, 81, 99, nodes[3 * 14 + 2], body);
  }

  /** From one node to another. */
  between(from, to) {
    const { nodes } = this;
    return [0, 1, 2].map((c) => nodes[3 * to + c] - nodes[3 * from + c]);
  }

  /** A frame whose z points along `up` and whose y is as near to `left` as that lets it. */
  orient(segment, up, left) {
    const size = Math.hypot(...up);
    const z = up.map((v) => v / size);
    const along = left[0] * z[0] + left[1] * z[1] + left[2] * z[2];
    const rest = left.map((v, i) => v - along * z[i]);
    const length = Math.hypot(...rest);
    const y = rest.map((v) => v / length);
    const x = [y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]];
    for (let i = 0; i < 3; i++) {
      const o = 9 * segment + 3 * i;
      this.rotations[o] = x[i];
      this.rotations[o + 1] = y[i];
      this.rotations[o + 2] = z[i];
    }
  }

  /** Balls of both feet, 6 numbers. */
  balls(out) {
    const { nodes, rotations, body } = this;
    const [x, y, z] = body.ball.map((v) => v * body.height);
    place(nodes, 3 * 13, rotations, 90, x, y, z, out, 0);
    place(nodes, 3 * 14, rotations, 99, x, y, z, out, 3);
    return out;
  }
}
