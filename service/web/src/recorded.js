// Walkers whose poses come one by one: those of a capture file, and those that a tree grows while one looks on.

import { Body, forward, limbEnds } from "./kinematics.js";
import { quantile } from "./ring.js";
import { flexions, Room } from "./room.js";
import { Stream } from "./stream.js";

const STANDING = 0.1; // share of a capture's frames in which the lower foot may be lower than where one stands
const HIPS = 0.53; // how high they are, in body heights, where one stands
const GROWN_FPS = 30;
const KEPT = 5 * 60 * GROWN_FPS; // frames of a grown motion
const NEAR = 0.2; // [s] of motion that is grown and not yet seen, below which more is asked for
const FAR = 1; // [s] of it, above which the service waits

/** Poses at a frame rate, with a length. */
class Recorded extends Room {
  constructor(parameters, body, fps) {
    super(parameters);
    this.body = body;
    this.fps = fps;
    this.poses = [];
    this.pose = new Float64Array(25);
    this.cyclic = false;
    this.stride = 0;
  }

  /** Fill markers and limbs with the pose at a frame, or between two; the ground moves instead of the body. */
  showFrame(frame) {
    const at = Math.min(this.poses.length - 1, Math.max(0, frame));
    const [first, second] = [this.poses[Math.floor(at)], this.poses[Math.ceil(at)]];
    const share = at - Math.floor(at);
    for (let i = 0; i < 25; i++) this.pose[i] = share ? (1 - share) * first[i] + share * second[i] : first[i];
    [this.ground[0], this.ground[1]] = this.pose;
    this.draw();
  }

  /** Captures may begin before all limbs are known. */
  stand() {
    this.pose.fill(0);
    this.pose[2] = HIPS * this.body.height;
    this.draw();
  }

  draw() {
    this.pose[0] = 0;
    this.pose[1] = 0;
    forward(this.pose, this.body, this.nodes, this.rotations);
    limbEnds(this.nodes, this.rotations, this.body, this.limbs);
  }
}

/** Of a capture file: the body doing what was captured, over and over: the `motion` and the `walk` that an inspection found. */
export class CaptureWalker extends Recorded {
  constructor(parameters, { fps, height, offsets, radii, poses }, walk) {
    const arrays = {
      offsets: Float64Array.from(offsets.flat(), (x) => x / height),
      limb_radii: Float64Array.from(radii.flat(), (x) => x / height),
      limb_shifts: parameters.arrays.limb_shifts,
    };
    super(parameters, new Body({ ...parameters, arrays }, height), fps);
    this.poses = poses.map((pose) => Float64Array.from(pose, (x) => x ?? Number.NaN));
    this.curves = flexions(this.poses);
    this.seconds = Math.max(1, poses.length - 1) / fps;
    this.marks = (walk?.starts ?? []).map((start) => start / this.seconds).filter((mark) => mark <= 1);
    this.sink = this.floor();
  }

  /** How far the lower ankle is over where one stands [m]; captures have their floors anywhere. */
  floor() {
    const lower = this.poses.map((pose) => {
      forward(pose, this.body, this.nodes, this.rotations);
      return Math.min(this.nodes[41], this.nodes[44]);
    });
    const known = lower.filter(Number.isFinite);
    return known.length ? quantile(known, STANDING) - this.body.ankleHeight * this.body.height : 0;
  }

  show(moment) {
    this.showFrame(this.share(moment) * (this.poses.length - 1));
  }

  draw() {
    this.pose[2] -= this.sink;
    super.draw();
  }

  facts() {
    return `as captured · ${this.seconds.toFixed(1)} s · ${this.body.height.toFixed(2)} m`;
  }

  when(moment) {
    return `${(this.share(moment) * this.seconds).toFixed(1)} s of ${this.seconds.toFixed(1)} s`;
  }
}

/**
 * Of a motion tree: what the service has grown so far, which is a motion to move to and fro in, and grows on.
 *
 * Its moments are seconds since it began.
 */
export class GrownWalker extends Recorded {
  constructor(parameters) {
    super(parameters, new Body(parameters, parameters.height), GROWN_FPS);
    this.stand(); // until the first pose comes
    this.seconds = 1;
    this.forgotten = 0; // frames
    this.seen = 0; // the moment that is shown
    this.resting = false;
    this.curves = null;
  }

  /** The first and the last moment that are kept. */
  get start() {
    return this.forgotten / this.fps;
  }

  get end() {
    return this.start + Math.max(0, this.poses.length - 1) / this.fps;
  }

  /** Let the service grow it; `told` is called at each pose, `say` with words as `Stream` does. */
  grow(model, one, { told, say }) {
    const pose = (arrived) => {
      this.take(arrived);
      told();
    };
    this.stream = new Stream({ model, seed: one.seed, ...steering(one) }, { pose, say });
  }

  set(one) {
    this.stream?.change(steering(one));
  }

  take(pose) {
    this.poses.push(pose);
    if (this.poses.length > KEPT) {
      this.poses.shift();
      this.forgotten++;
    }
    this.pace();
  }

  /** Let the service wait while there is enough to see; of a motion that rests, the first pose is asked for. */
  pace() {
    const ahead = this.end - this.seen;
    if (this.resting ? this.poses.length > 0 : ahead > FAR) this.stream?.hold(true);
    else if (this.resting || ahead < NEAR) this.stream?.hold(false);
  }

  rest(resting, moment) {
    this.resting = resting;
    this.seen = moment;
    this.pace();
  }

  after(moment, passed) {
    this.seen = Math.max(this.start, Math.min(this.end, moment + passed));
    this.pace();
    return this.seen;
  }

  share(moment) {
    return this.end > this.start ? (moment - this.start) / (this.end - this.start) : 1;
  }

  moment(share) {
    return this.start + share * (this.end - this.start);
  }

  /** Steering goes on from the end. */
  changed(moment) {
    return this.end - moment > FAR ? this.end : moment;
  }

  show(moment) {
    if (this.poses.length) this.showFrame((moment - this.start) * this.fps);
    else this.draw();
  }

  /** The frame of a moment, or the last one before. */
  frame(moment) {
    return Math.min(this.poses.length - 1, Math.max(0, Math.floor((moment - this.start) * this.fps + 1e-6)));
  }

  /** Speed in the second before a moment [m/s]. */
  paceAt(moment) {
    const last = this.frame(moment);
    const frames = Math.min(last, this.fps);
    if (!(frames > 0)) return 0;
    const [to, from] = [this.poses[last], this.poses[last - frames]];
    return (Math.hypot(to[0] - from[0], to[1] - from[1]) * this.fps) / frames;
  }

  facts(moment) {
    return `${this.paceAt(moment).toFixed(2)} m/s · ${this.when(moment)}`;
  }

  when(moment) {
    return `${Math.max(0, moment).toFixed(1)} s of ${this.end.toFixed(1)} s`;
  }

  /** Joint angles of the last frames up to a moment. */
  recent(moment, count) {
    const end = this.frame(moment) + 1;
    return flexions(this.poses.slice(Math.max(0, end - count), end));
  }

  close() {
    this.stream?.close();
  }
}

/** What a tree is told of a person's settings. */
export const steering = ({ temperature, activity, speed, heading }) => ({ temperature, activity, speed, heading });
