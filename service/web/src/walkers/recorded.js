// Walkers that play poses: from a capture file, or streamed from the service.

import { Body, forward, limbEnds } from "./kinematics.js";
import { quantile } from "./periodic.js";
import { flexions, standing, Walker } from "./base.js";
import { Stream } from "../api/stream.js";

const STANDING = 0.1; // share of a capture's frames in which the lower foot may be below the ground
const UPPER = [6, 17]; // entries of a pose that are of neck and arms
const TRUNK = [1, 3, 4, 15]; // nodes: sternum, shoulders, neck
const GROWN_FPS = 30;
const KEPT = 5 * 60 * GROWN_FPS; // frames of streamed motion
const NEAR = 0.2; // [s] of buffered motion below which the stream resumes
const FAR = 1; // [s] of buffered motion above which the stream is paused

/** Poses at a frame rate, with a length. */
class Recorded extends Walker {
  constructor(parameters, body, fps) {
    super(parameters);
    this.body = body;
    this.fps = fps;
    this.poses = [];
    this.pose = new Float64Array(25);
    this.cyclic = false;
    this.stride = 0;
  }

  /** Set markers and limbs to the pose at a frame, interpolated; the ground moves instead of the body. */
  showFrame(frame) {
    const at = Math.min(this.poses.length - 1, Math.max(0, frame));
    const [first, second] = [this.poses[Math.floor(at)], this.poses[Math.ceil(at)]];
    const share = at - Math.floor(at);
    for (let i = 0; i < 25; i++) this.pose[i] = share ? (1 - share) * first[i] + share * second[i] : first[i];
    for (let i = 0; i < 2; i++) if (Number.isFinite(this.pose[i])) this.ground[i] = this.pose[i]; // it stays in a gap
    this.draw();
  }

  /** A standing pose: captures may begin with unknown limbs. */
  stand() {
    this.pose.set(standing(this.body.height));
    this.draw();
  }

  draw() {
    this.pose[0] = 0;
    this.pose[1] = 0;
    forward(this.pose, this.body, this.nodes, this.rotations);
    limbEnds(this.nodes, this.rotations, this.body, this.limbs);
  }
}

/** Plays a capture in a loop: a file of an inspection. What it doesn't know is NaN, and isn't drawn. */
export class CaptureWalker extends Recorded {
  constructor(parameters, { name, motion, walk }) {
    const { fps, height, offsets, radii, poses, points } = motion;
    const arrays = {
      offsets: Float64Array.from(offsets.flat(), (x) => x / height),
      limb_radii: Float64Array.from(radii.flat(), (x) => x / height),
      limb_shifts: parameters.arrays.limb_shifts,
    };
    super(parameters, new Body({ ...parameters, arrays }, height), fps);
    Object.assign(this, { name, walk });
    this.poses = poses.map((pose) => Float64Array.from(pose, (x) => x ?? Number.NaN));
    this.captured = points?.map((frame) => Float64Array.from(frame.flat(), (x) => x ?? Number.NaN));
    this.points = this.captured && new Float64Array(this.captured[0].length);
    this.curves = flexions(this.poses);
    this.seconds = Math.max(1, poses.length - 1) / fps;
    this.marks = (walk?.starts ?? []).map((start) => start / this.seconds).filter((mark) => mark <= 1);
    this.sink = this.floor();
    this.legsOnly = this.poses.every((pose) => pose.subarray(...UPPER).every(Number.isNaN));
  }

  /** Height of the captured ground [m]: captures have their floors anywhere. */
  floor() {
    const lower = this.poses.map((pose) => {
      forward(pose, this.body, this.nodes, this.rotations);
      return Math.min(...[this.nodes[41], this.nodes[44]].filter(Number.isFinite));
    });
    const known = lower.filter(Number.isFinite);
    return known.length ? quantile(known, STANDING) - this.body.ankleHeight * this.body.height : 0;
  }

  show(moment) {
    const frame = this.share(moment) * (this.poses.length - 1);
    this.showFrame(frame);
    if (this.points) this.place(frame);
  }

  /** Set `points` to those of a frame, interpolated, where the body is shown. */
  place(frame) {
    const [first, second, share] = [this.captured[Math.floor(frame)], this.captured[Math.ceil(frame)], frame % 1];
    const moved = [...this.ground, this.sink];
    this.points.forEach((_, i) => (this.points[i] = (1 - share) * first[i] + share * second[i] - moved[i % 3]));
  }

  draw() {
    this.pose[2] -= this.sink;
    super.draw();
    if (this.legsOnly && Number.isNaN(this.pose[UPPER[0]])) this.hideTrunk();
  }

  /** A capture of pelvis and legs says nothing of the trunk above, which poses have no angles for. */
  hideTrunk() {
    for (const node of TRUNK) this.nodes.fill(Number.NaN, 3 * node, 3 * node + 3);
    this.body.limbNodes.forEach((ends, limb) => {
      if (ends.some((node) => TRUNK.includes(node))) this.limbs.fill(Number.NaN, 6 * limb, 6 * limb + 6);
    });
  }

  facts() {
    const pace = this.walk ? [`${this.walk.speed.toFixed(2)} m/s`, `${(120 / this.walk.stride).toFixed(0)} steps/min`] : [];
    return [...pace, `${this.body.height.toFixed(2)} m`, `${this.seconds.toFixed(1)} s`].join(" · ");
  }

  when(moment) {
    return `${(this.share(moment) * this.seconds).toFixed(1)} s of ${this.seconds.toFixed(1)} s`;
  }
}

/**
 * Plays motion streamed by a model that the page can't compute; what has arrived so far can be scrubbed.
 *
 * Its time is in seconds since the start.
 */
export class GrownWalker extends Recorded {
  constructor(parameters) {
    super(parameters, new Body(parameters, parameters.height), GROWN_FPS);
    this.stand(); // until the first pose comes
    this.seconds = 1;
    this.forgotten = 0; // frames
    this.seen = 0; // time of the frame on screen
    this.resting = false;
    this.curves = null;
  }

  /** The first and the last time that are kept. */
  get start() {
    return this.forgotten / this.fps;
  }

  get end() {
    return this.start + Math.max(0, this.poses.length - 1) / this.fps;
  }

  /** Start streaming; `told` is called at each pose, `say` as by `Stream`. */
  grow(model, one, { told, say }) {
    const pose = (arrived) => {
      this.take(arrived);
      told();
    };
    this.stream = new Stream({ model, seed: one.seed, ...this.told(one) }, { pose, say });
  }

  set(one) {
    const height = this.parameters.steerable ? null : one.height;
    this.body = new Body(this.parameters, height ?? this.parameters.height);
    this.stream?.change(this.told(one));
  }

  /** What the service is told of a person's settings. */
  told(one) {
    const { steerable, components } = this.parameters;
    if (steerable) return steering(one);
    const { speed, height, deviations } = one;
    return { speed, height, deviations: components && deviations.length ? deviations : null };
  }

  take(pose) {
    this.poses.push(pose);
    if (this.poses.length > KEPT) {
      this.poses.shift();
      this.forgotten++;
    }
    this.pace();
  }

  /** Pause the stream while enough is buffered; a paused walker needs its first pose only. */
  pace() {
    const ahead = this.end - this.seen;
    if (this.resting ? this.poses.length > 0 : ahead > FAR) this.stream?.pause(true);
    else if (this.resting || ahead < NEAR) this.stream?.pause(false);
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

  /** Steering takes effect at the end. */
  changed(moment) {
    return this.end - moment > FAR ? this.end : moment;
  }

  show(moment) {
    if (this.poses.length) this.showFrame((moment - this.start) * this.fps);
    else this.draw();
  }

  /** The last frame at or before a time. */
  frame(moment) {
    return Math.min(this.poses.length - 1, Math.max(0, Math.floor((moment - this.start) * this.fps + 1e-6)));
  }

  /** Mean speed over the last second [m/s]. */
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

  /** Joint angles of the last `count` frames before a time. */
  recent(moment, count) {
    const end = this.frame(moment) + 1;
    return flexions(this.poses.slice(Math.max(0, end - count), end));
  }

  close() {
    this.stream?.close();
  }
}

/** The settings of a person that steer a model. */
export const steering = ({ temperature, activity, speed, heading }) => ({ temperature, activity, speed, heading });
