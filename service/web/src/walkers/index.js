// Walkers: given settings, each computes its markers and limbs at any time.
//
//   set(settings)         apply settings; expensive, so that frames are cheap
//   show(moment)          set `markers` (45), `limbs` (limbs × 6) and `ground` (x, y), the way of the ground [m]
//   body, stride, seconds, curves, and what `Walker` (base.js) has

import { Frame, walkerInPlace } from "./eigenwalkers.js";
import { SAMPLES, walkInPlace } from "./treadmill_cycle.js";
import { forward, limbEnds } from "./kinematics.js";
import { GrownWalker } from "./recorded.js";
import { between } from "./periodic.js";
import { degrees, flexions, Walker } from "./base.js";

/** Functional PCA: poses of the 25-DOF body. */
class PoseWalker extends Walker {
  set({ deviations, speed, height }) {
    Object.assign(this, walkInPlace(this.parameters, deviations, { speed, height }));
    this.pose = new Float64Array(25);
    this.curves = flexions(Array.from({ length: SAMPLES }, (_, j) => this.poses.subarray(25 * j, 25 * (j + 1))));
  }

  show(cycles) {
    between(this.poses, 25, cycles, this.pose);
    forward(this.pose, this.body, this.nodes, this.rotations);
    limbEnds(this.nodes, this.rotations, this.body, this.limbs);
    this.ground[0] = cycles * this.stride;
  }
}

/** Eigenwalkers: markers, and limbs between them. */
class MarkerWalker extends Walker {
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

  /** Joint angles [degrees]: of hip and shoulder in the sagittal plane, of knee and elbow between the limbs. */
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

const TREADMILLS = { poses: PoseWalker, markers: MarkerWalker };

/** Whether the service sends a model's motion pose by pose, as the page can't compute it. */
export const streamed = ({ treadmill }) => !(treadmill in TREADMILLS);

/** A walker of a model, from its parameters. */
export const walkerOf = (parameters) => new (TREADMILLS[parameters.treadmill] ?? GrownWalker)(parameters);

/** Mean position of each marker over a cycle (15 × 3), around which dots are scrambled. */
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
