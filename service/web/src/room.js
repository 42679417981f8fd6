// What walkers have in common: room for one frame, and how their time goes.

export class Room {
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

  /** What is to be known of it at a glance, at a moment where that matters. */
  facts() {
    const { speed, seconds, body } = this;
    return `${speed.toFixed(2)} m/s · ${(120 / seconds).toFixed(0)} steps/min · ${body.height.toFixed(2)} m`;
  }

  /** Show some pose in which all limbs are known. */
  stand() {
    this.show(0);
  }

  /** Which moment it is [cycles] some seconds after another one. */
  after(moment, passed) {
    return moment + passed / this.seconds;
  }

  /** Which share of what can be scrubbed through lies before a moment; and back. */
  share(moment) {
    return moment - Math.floor(moment);
  }

  moment(share) {
    return share;
  }

  /** The moment that a change of its settings is to be seen at. */
  changed(moment) {
    return moment;
  }

  /** A moment in words. */
  when(moment) {
    return `${Math.round(100 * this.share(moment))} % of the cycle`;
  }

  /** Stand still at a moment, or go on from there. */
  rest() {}

  /** It is needed no more. */
  close() {}
}

export const degrees = (radians) => (radians * 180) / Math.PI;

/** Where flexions of hip, knee, shoulder and elbow, left and right, are in a pose. */
export const FLEXIONS = { Hip: [17, 21], Knee: [20, 24], Shoulder: [9, 13], Elbow: [12, 16] };

/** Flexions of poses [degrees]: for each joint a list on the left and one on the right. */
export function flexions(poses) {
  const of = (column) => Array.from(poses, (pose) => degrees(pose[column]));
  return Object.fromEntries(Object.entries(FLEXIONS).map(([joint, columns]) => [joint, columns.map(of)]));
}
