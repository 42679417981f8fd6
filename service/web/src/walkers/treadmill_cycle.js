// One cycle of a walk on the spot from the numbers of walk/fpca: motionenv/models/treadmill_cycle.py, walk_in_place.

import { balls, Body, forward } from "./kinematics.js";
import { evenly, quantile, slope, smooth } from "./periodic.js";

export const SAMPLES = 96;
const HINGES = [12, 16, 20, 24];
const HIPS = [17, 21]; // abduction comes next
const HIP_NODES = [9, 10];
const MIDSWING = [0.8, 0.3];

/** log(1 + exp(x)) */
const softplus = (x) => Math.max(x, 0) + Math.log1p(Math.exp(-Math.abs(x)));

/** Columns of the Fourier basis at all phases, (columns × SAMPLES): a constant, cosines, sines. */
function basis(columns) {
  const pairs = (columns - 1) / 2;
  const out = new Float64Array(columns * SAMPLES).fill(1);
  for (let k = 1; k <= pairs; k++) {
    for (let j = 0; j < SAMPLES; j++) {
      const angle = (2 * Math.PI * ((k * j) % SAMPLES)) / SAMPLES;
      out[k * SAMPLES + j] = Math.cos(angle);
      out[(pairs + k) * SAMPLES + j] = Math.sin(angle);
    }
  }
  return out;
}

/** Channels (SAMPLES × 24) of the walker `deviations` standard deviations from the average. */
function channels({ arrays, ...parameters }, deviations) {
  const size = arrays.mean.length;
  const series = Float64Array.from(arrays.mean);
  for (let k = 0; k < parameters.components; k++) {
    const score = arrays.mean_scores[k] + arrays.deviations[k] * (deviations[k] ?? 0);
    for (let i = 0; i < size; i++) series[i] += score * arrays.components[k * size + i];
  }
  const columns = size / 24;
  const waves = basis(columns);
  const out = new Float64Array(24 * SAMPLES);
  for (let h = 0; h < columns; h++) {
    for (let j = 0; j < SAMPLES; j++) {
      const wave = waves[h * SAMPLES + j];
      for (let c = 0; c < 24; c++) out[24 * j + c] += wave * series[24 * h + c];
    }
  }
  return out;
}

/** Seconds of a stride that suit the walker. */
export function strideSeconds({ arrays }, deviations) {
  return Math.exp(deviations.reduce((sum, d, k) => sum + d * arrays.log_seconds_weights[k], arrays.log_seconds_mean[0]));
}

/** The same person at another speed, and the stride time that makes it: motionenv/models/people/pace.py. */
function atSpeed({ arrays, components: q, reach }, deviations, seconds, height, speed) {
  const { pace_weights: weights, pace_curvature: curvature, pace_direction: direction } = arrays;
  const [average] = arrays.pace_length;
  const z = Float64Array.from({ length: q }, (_, k) => deviations[k] ?? 0);
  const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
  const bent = (a) => a.map((_, k) => dot(a, curvature.subarray(q * k, q * k + q)));
  const length = (a) => average + dot(a, weights) + dot(bent(a), a);
  const reached = (x) => Math.max(Math.min(x, 0.5 * (x + average + reach[1])), average + reach[0]);
  const now = length(z);
  const goal = now + arrays.pace_exponent[0] * (Math.log((speed * seconds) / height) - now);
  const change = reached(goal) - reached(now);
  const slope = Math.max(dot(weights, direction) + 2 * dot(bent(z), direction), 0.3);
  const root = Math.sqrt(Math.max(slope ** 2 + 4 * dot(bent(direction), direction) * change, (0.5 * slope) ** 2));
  const step = (2 * Math.min(Math.max(change, -1), 1)) / (slope + root);
  const moved = z.map((x, k) => x + step * direction[k]);
  return [moved, (Math.exp(length(moved)) * height) / speed];
}

/**
 * One cycle: `poses` (SAMPLES × 25), `stride` [m], `seconds`, and the `body`.
 * `speed` and `height` may be null: the walker's own, the model's.
 */
export function walkInPlace(parameters, deviations, { speed = null, height = null } = {}) {
  const body = new Body(parameters, height ?? parameters.height);
  let seconds = strideSeconds(parameters, deviations);
  if (speed !== null) [deviations, seconds] = atSpeed(parameters, deviations, seconds, body.height, speed);
  const values = channels(parameters, deviations);
  const start = new Float64Array(25 * SAMPLES);
  const ankles = new Float64Array(2 * SAMPLES);
  const floor = quantiles(values);
  for (let j = 0; j < SAMPLES; j++) {
    start.set(values.subarray(24 * j, 24 * j + 19), 25 * j + 6);
    start.set(values.subarray(24 * j + 19, 24 * j + 22), 25 * j + 3);
    for (const i of HINGES) start[25 * j + i] = body.contact.stiffness * softplus(start[25 * j + i] / body.contact.stiffness);
    for (let s = 0; s < 2; s++) {
      const over = (values[24 * j + 22 + s] - floor[s]) / body.contact.give;
      ankles[2 * j + s] = body.height * (body.ankleHeight + body.contact.give * softplus(over));
    }
  }
  let carried = null;
  for (let turn = 0; turn < (speed === null ? 1 : body.contact.turns); turn++) {
    carried = carry(start, ankles, SAMPLES / seconds, body);
    if (speed !== null) seconds = carried.stride / speed;
  }
  return { ...carried, seconds, body };
}

function quantiles(values) {
  return [22, 23].map((c) => quantile(Float64Array.from({ length: SAMPLES }, (_, j) => values[24 * j + c]), 0.1));
}

/** Ankles (SAMPLES × 6) and balls of the feet (SAMPLES × 6) of poses. */
function feet(poses, body) {
  const nodes = new Float64Array(48);
  const rotations = new Float64Array(108);
  const found = { ankles: new Float64Array(6 * SAMPLES), balls: new Float64Array(6 * SAMPLES) };
  for (let j = 0; j < SAMPLES; j++) {
    forward(poses.subarray(25 * j, 25 * j + 25), body, nodes, rotations);
    found.ankles.set(nodes.subarray(39, 45), 6 * j);
    balls(nodes, rotations, body, found.balls.subarray(6 * j, 6 * j + 6));
  }
  return found;
}

function carry(start, heights, rate, body) {
  const poses = Float64Array.from(start);
  const low = feet(poses, body).ankles;
  const stands = standing(low, rate, body);
  const bears = smooth(stands, 2, body.contact.shifting * rate);
  for (let j = 0; j < SAMPLES; j++) {
    poses[25 * j + 2] = 0;
    for (let s = 0; s < 2; s++) poses[25 * j + 2] += bears[2 * j + s] * (heights[2 * j + s] - low[6 * j + 3 * s + 2]);
  }
  const { ankles, balls: ball } = feet(poses, body);
  const speeds = slope(ball, 6);
  const velocity = new Float64Array(2 * SAMPLES);
  for (let j = 0; j < SAMPLES; j++) {
    for (let s = 0; s < 2; s++) {
      for (let c = 0; c < 2; c++) velocity[2 * j + c] -= stands[2 * j + s] * speeds[6 * j + 3 * s + c] * SAMPLES;
    }
  }
  const { way, stride } = evenly(smooth(velocity, 2, body.contact.smoothing * rate));
  for (let j = 0; j < SAMPLES; j++) poses.set(way.subarray(2 * j, 2 * j + 2), 25 * j);
  plant(poses, slip(ball, way, stride, stands, rate, body), ankles, body);
  return { poses: straightened(poses, stride), stride: Math.hypot(...stride) };
}

/** How surely each foot stands, (SAMPLES × 2). */
function standing(ankles, rate, body) {
  const speeds = slope(ankles, 6);
  const stands = new Float64Array(2 * SAMPLES);
  for (let j = 0; j < SAMPLES; j++) {
    const back = [-speeds[6 * j] * rate, -speeds[6 * j + 3] * rate];
    const most = Math.max(...back);
    const weights = back.map((b) => Math.exp((b - most) / body.contact.firmness));
    for (let s = 0; s < 2; s++) stands[2 * j + s] = weights[s] / (weights[0] + weights[1]);
  }
  return stands;
}

/** By how much to move the balls of the feet so that they go back evenly, (SAMPLES × 2 × 2) [m]. */
function slip(ball, way, stride, stands, rate, body) {
  const off = new Float64Array(4 * SAMPLES);
  const surely = new Float64Array(2 * SAMPLES);
  for (let s = 0; s < 2; s++) {
    const sums = [0, 0];
    let total = 0;
    for (let j = 0; j < SAMPLES; j++) {
      const cycle = j / SAMPLES + (j / SAMPLES < MIDSWING[s] ? 1 : 0);
      const weight = stands[2 * j + s];
      total += weight;
      for (let c = 0; c < 2; c++) {
        const placed = ball[6 * j + 3 * s + c] + way[2 * j + c] + cycle * stride[c];
        sums[c] += weight * placed;
        off[4 * j + 2 * s + c] = -placed;
      }
    }
    for (let j = 0; j < SAMPLES; j++) {
      const at = 4 * j + 2 * s;
      for (let c = 0; c < 2; c++) off[at + c] += sums[c] / Math.max(total, 1e-9);
      const far = (off[at] / body.contact.reach) ** 2 + (off[at + 1] / body.contact.reach) ** 2;
      surely[2 * j + s] = stands[2 * j + s] * Math.exp(-far);
    }
  }
  const part = smooth(off.map((v, i) => v * surely[i >> 1]), 4, body.contact.settling * rate);
  const whole = smooth(surely, 2, body.contact.settling * rate);
  return part.map((v, i) => v / (whole[i >> 1] + body.contact.looseness));
}

/** Turn the hips so that the feet move by `moves`. */
function plant(poses, moves, ankles, body) {
  for (let j = 0; j < SAMPLES; j++) {
    const forwards = Math.cos(poses[25 * j + 5]);
    const left = Math.sin(poses[25 * j + 5]);
    for (let s = 0; s < 2; s++) {
      const depth = poses[25 * j + 2] + body.offsets[3 * HIP_NODES[s] + 2] - ankles[6 * j + 3 * s + 2];
      const x = moves[4 * j + 2 * s];
      const y = moves[4 * j + 2 * s + 1];
      const side = (s === 0 ? 1 : -1) * (forwards * y - left * x);
      poses[25 * j + HIPS[s]] += (forwards * x + left * y) / depth;
      poses[25 * j + HIPS[s] + 1] += side / Math.hypot(depth, ankles[6 * j + 3 * s]);
    }
  }
}

/** Poses turned so that `stride` goes along x. */
function straightened(poses, stride) {
  const length = Math.hypot(...stride);
  const [c, s] = [stride[0] / length, stride[1] / length];
  for (let j = 0; j < SAMPLES; j++) {
    const x = poses[25 * j];
    const y = poses[25 * j + 1];
    poses[25 * j] = c * x + s * y;
    poses[25 * j + 1] = c * y - s * x;
    poses[25 * j + 5] -= Math.atan2(stride[1], stride[0]);
  }
  return poses;
}
