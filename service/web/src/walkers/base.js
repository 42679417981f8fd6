// Base class of walkers: buffers for one frame, and time.

export class Walker {
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

  /** A summary for the header. */
  facts() {
    const { speed, seconds, body } = this;
    return `${speed.toFixed(2)} m/s · ${(120 / seconds).toFixed(0)} steps/min · ${body.height.toFixed(2)} m`;
  }

  /** Show a pose in which all limbs are known. */
  stand() {
    this.show(0);
  }

  /** The time [cycles] `passed` seconds after `moment`. */
  after(moment, passed) {
    return moment + passed / this.seconds;
  }

  /** Position of a time on the scrubber, from 0 to 1; and back. */
  share(moment) {
    return moment - Math.floor(moment);
  }

  moment(share) {
    return share;
  }

  /** The time to show after a change of settings. */
  changed(moment) {
    return moment;
  }

  /** A time as text. */
  when(moment) {
    return `${Math.round(100 * this.share(moment))} % of the cycle`;
  }

  /** Pause at a time, or resume. */
  rest() {}

  /** Free resources. */
  close() {}
}

const HIPS = 0.53; // height of the hips of a standing body, in body heights

/** The pose of somebody of a height [m] who stands. */
export function standing(height) {
  const pose = new Float64Array(25);
  pose[2] = HIPS * height;
  return pose;
}

export const degrees = (radians) => (radians * 180) / Math.PI;

/** Columns of the left and right flexions in a pose. */
export const FLEXIONS = { Hip: [17, 21], Knee: [20, 24], Shoulder: [9, 13], Elbow: [12, 16] };

/** Flexions of poses [degrees]: a left and a right list for each joint. */
export function flexions(poses) {
  const of = (column) => Array.from(poses, (pose) => degrees(pose[column]));
  return Object.fromEntries(Object.entries(FLEXIONS).map(([joint, columns]) => [joint, columns.map(of)]));
}
