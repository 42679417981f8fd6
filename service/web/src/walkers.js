// Walkers: given settings, each says at any time where its markers and its limbs are.
//
//   set(settings)         walk like this from now on; what it costs is paid at once, not in the next frames
//   show(cycles)          fill `markers` (45), `limbs` (limbs × 6) [m] and `ground` (x, y), how far the ground went back
//   body, stride, seconds, curves

import { Frame, walkerInPlace } from "./eigenwalkers.js";
import { SAMPLES, walkInPlace } from "./inplace.js";
import { Body, forward, limbEnds } from "./kinematics.js";
import { between } from "./ring.js";

/** What walkers have in common: room for one frame. */
class Room {
  constructor(parameters) {
    this.parameters = parameters;
    this.limbs = new Float64Array(6 * parameters.limb_nodes.length);
    this.nodes = new Float64Array(48);
    this.markers = this.nodes.subarray(0, 45);
    this.rotations = new Float64Array(108);
    this.ground = [0, 0];
    this.cyclic = true;
  }

  /** Speed [m/s]. */
  get speed() {
    return this.stride / this.seconds;
  }

  /** Whether there is a time to move to and fro in. */
  get scrubbed() {
    return true;
  }

  /** What is to be known of it at a glance. */
  facts() {
    const { speed, seconds, body } = this;
    return `${speed.toFixed(2)} m/s · ${(120 / seconds).toFixed(0)} steps/min · ${body.height.toFixed(2)} m`;
  }
}

/** Of functional components: poses of the 25-DOF body. */
class PoseWalker extends Room {
  set({ deviations, speed, height }) {
    Object.assign(this, walkInPlace(this.parameters, deviations, { speed, height }));
    this.pose = new Float64Array(25);
    this.curves = {
      Hip: [column(this.poses, 17), column(this.poses, 21)],
      Knee: [column(this.poses, 20), column(this.poses, 24)],
      Shoulder: [column(this.poses, 9), column(this.poses, 13)],
      Elbow: [column(this.poses, 12), column(this.poses, 16)],
    };
  }

  show(cycles) {
    between(this.poses, 25, cycles, this.pose);
    forward(this.pose, this.body, this.nodes, this.rotations);
    limbEnds(this.nodes, this.rotations, this.body, this.limbs);
    this.ground[0] = cycles * this.stride;
  }
}

const degrees = (radians) => (radians * 180) / Math.PI;
const column = (poses, at) => Array.from({ length: SAMPLES }, (_, j) => degrees(poses[25 * j + at]));

/** Of eigenwalkers: markers, and limbs between them. */
class MarkerWalker extends Room {
  set({ deviations, speed, height }) {
    const cycle = walkerInPlace(this.parameters, deviations, { speed, height });
    Object.assign(this, { stride: cycle.stride, seconds: cycle.seconds, body: cycle.body, cycle: cycle.markers });
    this.frame = new Frame(this.body);
    this.markers = this.frame.nodes.subarray(0, 45);
    this.sample = new Float64Array(45);
    this.curves = this.angles();
  }

  show(cycles) {
    this.frame.set(between(this.cycle, 45, cycles, this.sample));
    limbEnds(this.frame.nodes, this.frame.rotations, this.body, this.limbs);
    this.ground[0] = cycles * this.stride;
  }

  /** Angles seen from the side for hip and shoulder, between the limbs for knee and elbow [degrees]. */
  angles() {
    const { cycle } = this;
    const point = (j, marker) => cycle.subarray(45 * j + 3 * marker, 45 * j + 3 * marker + 3);
    const every = (angle) => Array.from({ length: SAMPLES }, (_, j) => degrees(angle(j)));
    const swing = (near, far) => every((j) => forwards(point(j, near), point(j, far)));
    const bend = (a, b, c) => every((j) => bent(point(j, a), point(j, b), point(j, c)));
    return {
      Hip: [swing(9, 11), swing(10, 12)],
      Knee: [bend(9, 11, 13), bend(10, 12, 14)],
      Shoulder: [swing(3, 5), swing(4, 6)],
      Elbow: [bend(3, 5, 7), bend(4, 6, 8)],
    };
  }
}

const forwards = (near, far) => Math.atan2(far[0] - near[0], near[2] - far[2]);

function bent(a, b, c) {
  const u = [0, 1, 2].map((i) => b[i] - a[i]);
  const v = [0, 1, 2].map((i) => c[i] - b[i]);
  const along = u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  return Math.acos(Math.min(1, along / (Math.hypot(...u) * Math.hypot(...v))));
}

/** Of a motion tree: poses that come from the service, one by one. */
class StreamWalker extends Room {
  constructor(parameters) {
    super(parameters);
    this.cyclic = false;
    this.body = new Body(parameters, parameters.height);
    this.pose = new Float64Array(25);
    this.pose[2] = 0.53 * parameters.height;
    this.seconds = 1;
    this.stride = 0;
    this.curves = null;
  }

  set() {}

  get scrubbed() {
    return false;
  }

  facts() {
    return "";
  }

  /** The pose (25) that arrived last, less where the body is: the ground moves instead. */
  arrived(pose) {
    this.pose.set(pose);
    this.ground[0] = pose[0];
    this.ground[1] = pose[1];
    this.pose[0] = 0;
    this.pose[1] = 0;
  }

  show() {
    forward(this.pose, this.body, this.nodes, this.rotations);
    limbEnds(this.nodes, this.rotations, this.body, this.limbs);
  }

  flexions() {
    return flexions(this.pose);
  }
}

/** Flexion of hip, knee, shoulder and elbow, left and right [degrees]. */
function flexions(pose) {
  const of = (...at) => at.map((i) => degrees(pose[i]));
  return { Hip: of(17, 21), Knee: of(20, 24), Shoulder: of(9, 13), Elbow: of(12, 16) };
}

/** Of a capture file: the body doing what was captured, over and over: the `motion` and the `walk` that an inspection found. */
export class CaptureWalker extends Room {
  constructor(parameters, { fps, height, offsets, radii, poses }, walk) {
    super(parameters);
    const arrays = {
      offsets: Float64Array.from(offsets.flat(), (x) => x / height),
      limb_radii: Float64Array.from(radii.flat(), (x) => x / height),
      limb_shifts: parameters.arrays.limb_shifts,
    };
    this.body = new Body({ ...parameters, arrays }, height);
    this.poses = poses.map((pose) => Float64Array.from(pose, (x) => x ?? Number.NaN));
    this.pose = new Float64Array(25);
    this.seconds = Math.max(1, poses.length - 1) / fps;
    this.stride = 0;
    this.cyclic = false;
    this.curves = this.angles();
    this.marks = (walk?.starts ?? []).map((start) => start / this.seconds).filter((mark) => mark <= 1);
    this.sink = this.floor();
  }

  /** How far the lowest ankle is over where one stands [m]; captures have their floors anywhere. */
  floor() {
    let lowest = Infinity;
    for (const pose of this.poses) {
      forward(pose, this.body, this.nodes, this.rotations);
      for (const z of [this.nodes[41], this.nodes[44]]) if (z < lowest) lowest = z;
    }
    return Number.isFinite(lowest) ? lowest - this.body.ankleHeight * this.body.height : 0;
  }

  show(cycles) {
    const at = (cycles - Math.floor(cycles)) * (this.poses.length - 1);
    const [first, second] = [this.poses[Math.floor(at)], this.poses[Math.ceil(at)]];
    const share = at - Math.floor(at);
    for (let i = 0; i < 25; i++) this.pose[i] = share ? (1 - share) * first[i] + share * second[i] : first[i];
    [this.ground[0], this.ground[1]] = this.pose;
    this.pose[0] = 0;
    this.pose[1] = 0;
    this.pose[2] -= this.sink;
    forward(this.pose, this.body, this.nodes, this.rotations);
    limbEnds(this.nodes, this.rotations, this.body, this.limbs);
  }

  facts() {
    return `as captured · ${this.seconds.toFixed(1)} s · ${this.body.height.toFixed(2)} m`;
  }

  angles() {
    const every = (...at) => at.map((i) => this.poses.map((pose) => degrees(pose[i])));
    return { Hip: every(17, 21), Knee: every(20, 24), Shoulder: every(9, 13), Elbow: every(12, 16) };
  }
}

const KINDS = { walking: PoseWalker, eigenwalkers: MarkerWalker, tree: StreamWalker };

/** Whether the page can show models of a kind. */
export const known = (kind) => kind in KINDS;

/** A walker of a model, from its parameters. */
export const walkerOf = (parameters) => new KINDS[parameters.kind](parameters);

/** Where each marker is on average over a cycle (15 × 3), and how tall it all is: what dots are scrambled within. */
export function averageMarkers(walker) {
  const mean = new Float64Array(45);
  const steps = walker.cyclic ? 24 : 1;
  const ground = [...walker.ground];
  for (let j = 0; j < steps; j++) {
    walker.show(j / steps);
    for (let i = 0; i < 45; i++) mean[i] += walker.markers[i] / steps;
  }
  walker.ground = ground;
  return mean;
}
