// Forward kinematics of the 25-DOF body: motionenv/body/kinematics.py, whose docstring says what the angles mean.
// Rotations are nine numbers, rows first.

const HEAD = 0;
const PELVIS = 2;
const NECK = 15;
const TORSO_NODES = [1, 2, 3, 4, 9, 10, 15];
/** Per limb: first entry in the pose, signs of flexion, abduction and rotation, of the hinge, and its nodes. */
const LIMBS = [
  { at: 9, sign: [-1, 1, -1], hinge: -1, nodes: [3, 5, 7] },
  { at: 13, sign: [-1, -1, 1], hinge: -1, nodes: [4, 6, 8] },
  { at: 17, sign: [-1, 1, -1], hinge: 1, nodes: [9, 11, 13] },
  { at: 21, sign: [-1, -1, 1], hinge: 1, nodes: [10, 12, 14] },
];
const FEET = [
  { segment: 10, shin: 7, ankle: 13 },
  { segment: 11, shin: 9, ankle: 14 },
];
const SKULL = 1; // the head's segment

/** A body of some height: what of a model's parameters its pictures need. */
export class Body {
  constructor(parameters, height) {
    const { arrays } = parameters;
    this.height = height;
    this.offsets = arrays.offsets.map((x) => x * height);
    this.radii = arrays.limb_radii;
    this.ankleHeight = parameters.ankle_height;
    this.limbNodes = parameters.limb_nodes;
    this.limbSegments = parameters.limb_segments;
    // A head grows less than the rest: its limbs are shifted as far as its radius says.
    const head = (this.radii[2 * parameters.limbs.indexOf("head") + 1] / parameters.head_radius) * height;
    this.shifts = arrays.limb_shifts.map((x, i) => x * (this.limbSegments[Math.floor(i / 6)] === SKULL ? head : height));
    const at = 6 * parameters.limbs.indexOf("left_foot");
    const foot = arrays.limb_shifts.subarray(at, at + 6);
    this.heel = [-foot[0], -foot[2]];
    this.toe = [foot[3], -foot[5]];
  }
}

/** parent · R_y(flexion) R_x(abduction) R_z(rotation). */
function turn(parent, p, flexion, abduction, rotation, out, o) {
  const cy = Math.cos(flexion);
  const sy = Math.sin(flexion);
  const cx = Math.cos(abduction);
  const sx = Math.sin(abduction);
  const cz = Math.cos(rotation);
  const sz = Math.sin(rotation);
  for (let i = 0; i < 9; i += 3) {
    const a = parent[p + i];
    const b = parent[p + i + 1];
    const c = parent[p + i + 2];
    const x = a * cy - c * sy;
    const q = a * sy + c * cy;
    const r = b * cx + q * sx;
    out[o + i] = x * cz + r * sz;
    out[o + i + 1] = r * cz - x * sz;
    out[o + i + 2] = q * cx - b * sx;
  }
}

/** parent · R_y(flexion). */
function hinge(parent, p, flexion, out, o) {
  const c = Math.cos(flexion);
  const s = Math.sin(flexion);
  for (let i = 0; i < 9; i += 3) {
    const x = parent[p + i];
    const z = parent[p + i + 2];
    out[o + i] = x * c - z * s;
    out[o + i + 1] = parent[p + i + 1];
    out[o + i + 2] = x * s + z * c;
  }
}

/** R_z(heading) R_x(obliquity) R_y(tilt). */
function root(pose, out) {
  const cy = Math.cos(pose[3]);
  const sy = Math.sin(pose[3]);
  const cx = Math.cos(pose[4]);
  const sx = Math.sin(pose[4]);
  const cz = Math.cos(pose[5]);
  const sz = Math.sin(pose[5]);
  out[0] = cz * cy - sz * sx * sy;
  out[1] = -sz * cx;
  out[2] = cz * sy + sz * sx * cy;
  out[3] = sz * cy + cz * sx * sy;
  out[4] = cz * cx;
  out[5] = sz * sy - cz * sx * cy;
  out[6] = -cx * sy;
  out[7] = sx;
  out[8] = cx * cy;
}

/** out = nodes[from] + rotation · (x, y, z). */
function place(nodes, from, rotations, r, x, y, z, out, to) {
  for (let i = 0; i < 3; i++) {
    const row = r + 3 * i;
    out[to + i] = nodes[from + i] + rotations[row] * x + rotations[row + 1] * y + rotations[row + 2] * z;
  }
}

function placeNode(nodes, rotations, body, from, segment, node) {
  const o = 3 * node;
  const { offsets } = body;
  place(nodes, 3 * from, rotations, 9 * segment, offsets[o], offsets[o + 1], offsets[o + 2], nodes, o);
}

/** Write the rotation of a foot (at `o`) that follows the shin (at `s`) but stays above the ground. */
function turnFoot(rotations, s, o, ankleZ, body) {
  const length = Math.hypot(rotations[s + 1], rotations[s + 4]);
  if (!(length > 1e-3)) {
    rotations.copyWithin(o, s, s + 9);
    return;
  }
  const lx = rotations[s + 1] / length;
  const ly = rotations[s + 4] / length;
  const fx = ly;
  const fy = -lx;
  const rigid = Math.atan2(-rotations[s + 6], rotations[s] * fx + rotations[s + 3] * fy);
  const down = toeDown(rigid, ankleZ / body.height - body.ankleHeight, body);
  const c = Math.cos(down);
  const d = Math.sin(down);
  const rows = [fx * c, lx, fx * d, fy * c, ly, fy * d, -d, 0, c];
  for (let i = 0; i < 9; i++) rotations[o + i] = rows[i];
}

function toeDown(rigid, free, body) {
  const sine = ([along, below]) => Math.asin(Math.min(1, Math.max(-1, (free + below) / Math.hypot(along, below))));
  const most = sine(body.toe) - Math.atan2(body.toe[1], body.toe[0]);
  const least = Math.atan2(body.heel[1], body.heel[0]) - sine(body.heel);
  return Math.min(Math.max(rigid, Math.min(least, 0)), Math.max(most, -0.3));
}

/** Nodes (16 × 3) and rotations (12 × 9) of one pose (25). */
export function forward(pose, body, nodes, rotations) {
  root(pose, rotations);
  for (let i = 0; i < 3; i++) nodes[3 * PELVIS + i] = pose[i];
  for (const node of TORSO_NODES) if (node !== PELVIS) placeNode(nodes, rotations, body, PELVIS, 0, node);
  turn(rotations, 0, pose[6], -pose[7], pose[8], rotations, 9);
  placeNode(nodes, rotations, body, NECK, 1, HEAD);
  for (let i = 0; i < 4; i++) {
    const { at, sign, hinge: bends, nodes: chain } = LIMBS[i];
    const upper = 9 * (2 + 2 * i);
    turn(rotations, 0, sign[0] * pose[at], sign[1] * pose[at + 1], sign[2] * pose[at + 2], rotations, upper);
    hinge(rotations, upper, bends * pose[at + 3], rotations, upper + 9);
    placeNode(nodes, rotations, body, chain[0], 2 + 2 * i, chain[1]);
    placeNode(nodes, rotations, body, chain[1], 3 + 2 * i, chain[2]);
  }
  for (const { segment, shin, ankle } of FEET) turnFoot(rotations, 9 * shin, 9 * segment, nodes[3 * ankle + 2], body);
}

/** Ends of the axes of the drawn limbs: limbs × 6 numbers. */
export function limbEnds(nodes, rotations, body, out) {
  const { shifts } = body;
  body.limbNodes.forEach((ends, limb) => {
    for (let e = 0; e < 2; e++) {
      const s = 6 * limb + 3 * e;
      const r = 9 * body.limbSegments[limb];
      place(nodes, 3 * ends[e], rotations, r, shifts[s], shifts[s + 1], shifts[s + 2], out, s);
    }
  });
  return out;
}
